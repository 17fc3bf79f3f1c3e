"""XML: files as plain trees, without document types, so without entities, and of limited size; and texts of files."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from velatura import files
from velatura.errors import InvalidInput

LARGEST = 2**24  # bytes of a file
DEEPEST = 100  # elements within each other


@dataclass
class Element:
    """An element: its tag with any prefix, its attributes, its parent, and the elements in it."""

    tag: str
    attributes: dict[str, str]
    parent: Element | None = None
    children: list[Element] = field(default_factory=list)

    def get(self, key: str) -> str | None:
        """An attribute; None without it."""
        return self.attributes.get(key)

    @property
    def name(self) -> str:
        """Its attribute `name`; empty without one."""
        return self.attributes.get("name", "")

    def of(self, *tags: str) -> Iterator[Element]:
        """The elements in it of some tags."""
        return (child for child in self.children if child.tag in tags)

    @functools.cached_property
    def named(self) -> dict[str, list[Element]]:
        """The elements in it by their names, once all are there."""
        found: dict[str, list[Element]] = {}
        for child in self.children:
            found.setdefault(child.name, []).append(child)
        return found

    def child(self, tag: str, name: str) -> Element | None:
        """The first element in it of a tag and a name."""
        return next((child for child in self.named.get(name, ()) if child.tag == tag), None)

    def all(self) -> Iterator[Element]:
        """The element, and all in it, in their order."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += reversed(element.children)

    def outwards(self) -> Iterator[Element]:
        """The element, and those that it is in, outwards."""
        element: Element | None = self
        while element is not None:
            yield element
            element = element.parent


def read(path: Path) -> Element:
    """The root of a file.

    Raises:
        InvalidInput: it cannot be read, is no XML, beyond the budget, or has a document type; one line that names it.
    """
    root, parser = Element("", {}), expat.ParserCreate()
    at = [root]

    def where() -> str:
        return f"{path}: line {parser.CurrentLineNumber}"

    def begin(tag: str, attributes: dict[str, str]) -> None:
        left.spend(where(), "elements")
        if len(at) > DEEPEST:
            raise InvalidInput(f"{where()}: holds more than {DEEPEST} elements within each other")
        at.append(Element(tag, attributes, at[-1]))
        at[-2].children.append(at[-1])

    def doctype(*_: object) -> None:
        raise InvalidInput(f"{where()}: has a document type, which is not read")

    parser.StartElementHandler, parser.StartDoctypeDeclHandler = begin, doctype
    parser.EndElementHandler = lambda _: at.pop()
    try:
        with files.budget() as left:
            parser.Parse(files.content(path, LARGEST), True)
    except expat.ExpatError as error:
        raise InvalidInput(f"{path}: line {error.lineno}: is not valid XML: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:  # an encoding that there is not
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{path}: cannot be read: {error}") from None
    return root.children[0]


def comment(lines: Iterable[str]) -> list[str]:
    """The lines of a comment, which holds no two hyphens in a row."""
    return ["  <!--", *(f"    {re.sub('-(?=-)', '- ', line)}" for line in lines), "  -->"]


def numbers(value: float | tuple[float, ...]) -> str:
    """A number or a colour as an attribute."""
    return ", ".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"
