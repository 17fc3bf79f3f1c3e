"""Take the pages of the refractiveindex.info database that come with the package from a copy of the database:

    python tools/substances.py refractiveindex.info-database/database [shelf/book/page]...

They are those in the catalogue of the package, `src/velatura/stack/refractiveindex`, and the ones that are named. The
package has them in the form of the database: its catalogue, with these pages alone, and their files, unchanged. The
database is in the public domain (CC0 1.0).
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable
from pathlib import Path

from velatura.stack.substances import CATALOG, PACKAGED, catalog, names

NOTICE = """# A part of the refractiveindex.info database, taken by tools/substances.py
# refractiveindex.info database is in the public domain
# copyright and related rights waived via CC0 1.0
"""


def main(copy: Path, pages: Iterable[str]) -> None:
    """Replace the pages of the package by those of a copy of the database."""
    listed = catalog(copy)
    lines, before = [NOTICE], ("", "")
    pages = sorted({*names(), *pages})
    shutil.rmtree(PACKAGED)
    for name in pages:
        shelf, book, page = name.split("/")
        entry = listed[name]
        if shelf != before[0]:
            lines.append(f"- SHELF: {shelf}\n  content:")
        if (shelf, book) != before:
            lines.append(f'    - BOOK: {book}\n      name: "{entry.book}"\n      content:')
        before = (shelf, book)
        data = entry.path.relative_to(copy / "data").as_posix()
        lines.append(f'        - PAGE: {page}\n          name: "{entry.title}"\n          data: {data}')
        target = PACKAGED / "data" / data
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(entry.path, target)
    (PACKAGED / CATALOG).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), sys.argv[2:])
