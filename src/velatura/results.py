"""Results that show themselves: as tables where they are printed, and in notebooks."""

from __future__ import annotations

import shutil
import sys
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from velatura.errors import one_line, short

if TYPE_CHECKING:
    from rich.table import Table as RichTable

LINES = 24  # of a printed result
WIDTH = 120  # characters of a line, or as many as the terminal has
WIDE = 90  # characters of a value


@dataclass(frozen=True)
class Table:
    """A table of text.

    Args:
        title, caption: above and below it; may be empty.
        columns: the headings.
        rows: a text for each column, or fewer; None for a rule.
        right: headings of the columns that are flush right, as numbers are.
        aside: headings of the columns that a short form leaves out.
        styles: of cells by their text, as Rich names them.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str] | None]
    right: Sequence[str] = ()
    aside: Sequence[str] = ()
    caption: str = ""
    styles: Mapping[str, str] = field(default_factory=dict)

    def __rich__(self) -> RichTable:
        """The table in a terminal; Rich's markup in its texts is text."""
        from rich.table import Table as RichTable
        from rich.text import Text

        title, caption = (Text(text) if text else None for text in (self.title, self.caption))
        table = RichTable(title=title, title_justify="left", caption=caption, caption_justify="left")
        for heading in self.columns:
            table.add_column(Text(heading), justify="right" if heading in self.right else "left", overflow="fold")
        for row in self.rows:
            if row is None:
                table.add_section()
            else:
                table.add_row(*(Text(cell, self.styles.get(cell, "")) for cell in row))
        return table

    def html(self) -> str:
        """The table for a notebook, with all text escaped."""
        from html import escape

        def cell(tag: str, heading: str, text: str) -> str:
            side = "right" if heading in self.right else "left"
            return f'<{tag} style="text-align: {side}">{escape(text).replace(chr(10), "<br>")}</{tag}>'

        head = "".join(cell("th", heading, heading) for heading in self.columns)
        rows = (
            "".join(cell("td", heading, text) for heading, text in zip(self.columns, row))
            for row in self.rows
            if row is not None
        )
        body = "".join(f"<tr>{row}</tr>" for row in rows)
        title = f'<caption style="text-align: left">{escape(self.title)}</caption>' if self.title else ""
        caption = f"<p>{escape(self.caption)}</p>" if self.caption else ""
        return f"<table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{caption}"

    def shortened(self, most: int) -> Table:
        """The table with so many lines of rows at most, from the top; the caption counts the others."""
        places = [place for place, heading in enumerate(self.columns) if heading not in self.aside]
        rows = [None if row is None else [row[place] for place in places if place < len(row)] for row in self.rows]
        kept: list[Sequence[str] | None] = []
        lines = 0
        for row in rows:
            lines += max((cell.count("\n") + 1 for cell in row), default=1) if row is not None else 1
            if lines > most:
                break
            kept.append(row)
        columns = [self.columns[place] for place in places]
        left = sum(row is not None for row in rows[len(kept) :])
        return replace(self, columns=columns, rows=kept, caption=f"{left} more rows" if left else self.caption)


class Result(ABC):
    """A result that is printed as tables of a few lines; in a notebook as a whole."""

    @abstractmethod
    def as_tables(self) -> Sequence[Table]:
        """All that it holds, as tables."""

    def brief(self) -> Sequence[Table]:
        """The tables that are printed, of which rows beyond `LINES` are left out."""
        return self.as_tables()

    def __repr__(self) -> str:
        tables = self.brief()
        frame = sum(4 + bool(table.title) + bool(table.caption) for table in tables)  # lines around the rows
        most = max((LINES - frame - len(tables)) // max(len(tables), 1), 1)
        text = printed([table.shortened(most) for table in tables])
        while most > 1 and text.count("\n") >= LINES:  # a narrow terminal folds rows
            most -= 1
            text = printed([table.shortened(most) for table in tables])
        return text

    def _repr_html_(self) -> str:
        return "".join(table.html() for table in self.as_tables())


class Fields(Result):
    """A record (a dataclass) that is printed as a row per field, of arrays their shape and range."""

    def as_tables(self) -> list[Table]:
        """A row per field."""
        rows = [(each.name, _summary(getattr(self, each.name))) for each in fields(self) if each.repr]  # type: ignore[arg-type]
        return [Table(type(self).__name__, ("field", "value"), rows)]


def _summary(value: Any) -> str:
    """A value in a line."""
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        shape = "x".join(map(str, value.shape)) or "number"
        if not value.size or value.dtype.kind not in "fiu":
            return f"{shape} {value.dtype}"
        return f"{shape}: {value.min():.4g} to {value.max():.4g}"
    if isinstance(value, Result):
        return type(value).__name__
    if isinstance(value, list | tuple) and value and not all(isinstance(x, int | float | str) for x in value):
        return short("; ".join(map(_summary, value)), WIDE)
    if isinstance(value, Mapping):
        return short("; ".join(f"{key}: {_summary(each)}" for key, each in value.items()), WIDE)
    return short(one_line(f"{value:.4g}" if isinstance(value, float) else str(value)), WIDE)


def printed(tables: Sequence[Table]) -> str:
    """Tables as plain text, as wide as the terminal at most."""
    from rich.console import Console

    terminal = sys.stdout and sys.stdout.isatty()  # Windows' pythonw has no output
    width = min(shutil.get_terminal_size().columns, WIDTH) if terminal else WIDTH
    console = Console(
        width=width, markup=False, emoji=False, color_system=None, force_terminal=False, force_jupyter=False
    )  # which would show an empty output in a notebook
    with console.capture() as captured:
        for table in tables:
            console.print(table)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def digits(value: float | tuple[float, ...]) -> str:
    """A number or a colour in a message."""
    return f"{value:.4g}" if isinstance(value, float) else "[" + ", ".join(f"{x:.4g}" for x in value) + "]"


def cell(values: Any) -> str:
    """Numbers in a line of four digits, one where they are all alike; a dash for None."""
    import numpy as np

    found = ["-"] if values is None else [f"{x:.4f}" for x in np.ravel(values)]
    return found[0] if len(set(found)) == 1 else " ".join(found)


def numbers(values: Any, form: str = ".4f") -> str:
    """Numbers in a line; with one set of them per channel, a line each."""
    if values.ndim > 1:
        return "\n".join(numbers(row, form) for row in values)
    return " ".join(format(value, form) for value in values.ravel())
