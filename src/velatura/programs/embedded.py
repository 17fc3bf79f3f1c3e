"""The stack that a bake was made of, inside its file, for as long as nothing else in the file is changed."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any

from velatura.programs import xml

KEY = "velatura"
READ = "holds the stack that the parameters were fitted to, which is read"


def in_xml(material: Any, body: str) -> str:
    """A comment with a material as its file has it, and the text that follows, which it holds for."""
    text = json.dumps({"digest": digest(body), "material": material})
    # Comments of XML hold no two hyphens in a row
    return f"<!-- {KEY} {text.replace('--', '-' + chr(92) + 'u002d')} -->\n{body}"


def document(head: list[str], about: list[str], material: Any, body: list[str]) -> str:
    """A document of XML with remarks in a comment, and the material in another."""
    return "\n".join([*head, *xml.comment(about), f"  {in_xml(material, chr(10).join(body))}"])


def of_xml(text: str) -> Any | None:
    """The material in a text of `in_xml`; None without one, or where what follows it was changed."""
    comment, _, body = text.partition(f"<!-- {KEY} ")[2].partition(" -->\n")
    try:
        held = json.loads(comment) if comment.startswith("{") else {}
    except (ValueError, RecursionError):
        return None
    return held.get("material") if held.get("digest") == digest(body) else None


def in_gltf(material: Any, entry: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of `extras` that hold a material, for an entry of `materials` without them."""
    return {"digest": digest(_values(entry)), "material": material}


def of_gltf(entry: Mapping[str, Any]) -> Any | None:
    """The material in an entry with what `in_gltf` gives; None without one, or where the entry was changed."""
    extras = entry.get("extras")
    held = extras.get(KEY) if isinstance(extras, Mapping) else None
    if not isinstance(held, Mapping) or held.get("digest") != digest(_values(entry)):
        return None
    return held.get("material")


def loosened(data: bytes) -> bytes:
    """A bake of which the parameters are read, and not the material that it holds."""
    return re.sub(rb'(\\?"digest\\?": \\?")', rb"\1-", data)  # USD has it in a text


def _values(entry: Mapping[str, Any]) -> str:
    """The entry without its name and extras, in one order."""
    kept = {key: value for key, value in entry.items() if key not in ("name", "extras")}
    return json.dumps(kept, sort_keys=True)


def digest(text: str) -> str:
    """A short text that is another one for any other text."""
    return hashlib.sha256(text.strip().encode()).hexdigest()[:16]
