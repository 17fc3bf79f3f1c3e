"""Materials of other programs as stacks: what of a folder's files can be read, what is left, and whether laws hold.

Without a folder: how far stacks of OpenPBR materials of our own are from that model's own formulas, by lobes.
"""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from pathlib import Path

import velatura as vt
from velatura import imports


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of files to import, with those in folders below it")
    parser.add_argument("--no-check", action="store_true", help="read them only")
    arguments = parser.parse_args()
    counts = {"read": 0, "refused": 0, "broken": 0}
    print("| file | material | layers | left | laws |\n|---|---|---|---|---|")
    for path in sorted(arguments.folder.rglob("*")):
        if path.suffix.lower() in imports.FORMATS:
            for row in rows(path, counts, not arguments.no_check):
                print(f"| {path.name} | {' | '.join(row)} |", flush=True)
    print(f"\n{counts}, {time.process_time():.0f} s of processor time")


def rows(path: Path, counts: dict[str, int], checked: bool) -> list[tuple[str, str, str, str]]:
    try:
        names = list(import_module(imports.FORMATS[path.suffix.lower()]).materials(path))
    except vt.InvalidInput as error:
        counts["refused"] += 1
        return [("", f"refused: {error}", "", "")]
    found = []
    for name in names:
        try:
            made = imports.read(path, name)
        except vt.InvalidInput as error:
            counts["refused"] += 1
            found.append((name, f"refused: {error}", "", ""))
            continue
        counts["read"] += 1
        laws = ""
        if checked:
            report = vt.check(made.stack)
            laws = "kept" if report.passed else ", ".join(report.broken)
            counts["broken"] += not report.passed
        layers = ", ".join(made.stack.kinds) + (", thin" if made.stack.thin else "")
        found.append((name, layers, ", ".join(each.parameter for each in made.left), laws))
    return found


if __name__ == "__main__":
    main()
