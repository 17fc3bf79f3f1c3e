"""Fits of many tables, one result for each in a folder, which is continued where it was interrupted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from velatura import files
from velatura.errors import InvalidInput, VelaturaError, one_line
from velatura.inverse.fitting.angles import ReflectanceTable
from velatura.inverse.fitting.descent import Fit
from velatura.inverse.fitting.model_error import ModelError
from velatura.inverse.fitting.simplify import fit_target
from velatura.inverse.lobes.target import Target
from velatura.inverse.measured import READERS, load_table
from velatura.model import DEFAULT, Model
from velatura.stack import save
from velatura.version import __version__

ENDINGS = (".csv", *READERS)  # of the tables in a folder
LARGEST = 2**24  # bytes that are read at once, and of a report that is read back

Beside = Callable[[Fit, ReflectanceTable], ModelError | None]


@dataclass(frozen=True)
class Entry:
    """A table of a set: the report of its fit, or why there is none; `found`: the fit, where it was done just now."""

    path: Path
    report: dict[str, Any] | None = None
    why: str = ""
    found: Fit | None = None
    table: ReflectanceTable | None = None


def tables_of(paths: Sequence[str | Path]) -> list[Path]:
    """Files, and those in folders that end as tables do.

    Raises:
        InvalidInput: a folder without any, or two of one name, whose results would be one file.
    """
    found: list[Path] = []
    for path in map(Path, paths):
        inside = sorted(each for each in path.iterdir() if each.suffix.lower() in ENDINGS) if path.is_dir() else [path]
        if not inside:
            raise InvalidInput(f"{path}: holds no table ({', '.join(ENDINGS)})")
        found += inside
    names: dict[str, Path] = {}
    for each in found:
        if (other := names.setdefault(each.stem, each)) != each:
            raise InvalidInput(f"{each}: has the name of {other}; fit them into folders of their own")
    return list(names.values())


def fit_set(
    paths: Sequence[str | Path],
    target: Target,
    folder: str | Path,
    starts: int = 4,
    model: str | Model = DEFAULT,
    seed: int = 0,
    beside: Beside | None = None,
    **switches: str,
) -> Iterator[Entry]:
    """Fits of tables to a target, each as `fit_target`; in a folder NAME.yaml, the material, and NAME.json, the report.

    A table whose report answers the same question is not fitted again. One that fails does not end the others.

    Args:
        paths: files, and folders of such.
        beside: the error of the model itself beside a fit, for its report.

    Raises:
        InvalidInput: as `tables_of`, or a folder that cannot be written.
    """
    every, folder = tables_of(paths), Path(folder)
    files.make_folder(folder)
    options = [target.to_dict(), str(model), starts, seed, switches, bool(beside), __version__]
    for path in every:
        try:
            yield _fitted(path, target, folder, starts, model, seed, beside, switches, options)
        except (VelaturaError, OSError) as error:
            yield Entry(path, why=one_line(str(error)))


def _fitted(
    path: Path,
    target: Target,
    folder: Path,
    starts: int,
    model: str | Model,
    seed: int,
    beside: Beside | None,
    switches: dict[str, str],
    options: list[Any],
) -> Entry:
    asked, report = _asked(path, options), folder / f"{path.stem}.json"
    if (known := _known(report)).get("asked") == asked and report.with_suffix(".yaml").is_file():
        return Entry(path, known)
    table = load_table(path)
    found = fit_target(table, target, starts, model, seed, **switches)
    own = beside(found, table) if beside else None
    made = {"model": found.model.name, **found.to_dict(), **({"model_error": vars(own)} if own else {}), "asked": asked}
    save(found.stack, report.with_suffix(".yaml"))
    with files.whole(report) as unfinished:
        unfinished.write_text(json.dumps(made, allow_nan=False), encoding="utf-8")
    return Entry(path, made, found=found, table=table)


def _asked(path: Path, options: list[Any]) -> str:
    """A digest of a table and of what is asked about it."""
    files.check_regular(path)
    digest = hashlib.sha256(json.dumps(options).encode())
    with path.open("rb") as file:  # measurements may be larger than what is read at once
        while part := file.read(LARGEST):
            digest.update(part)
    return digest.hexdigest()


def _known(report: Path) -> dict[str, Any]:
    """A report that was written; empty where there is none."""
    try:
        known = json.loads(files.content(report, LARGEST), parse_constant=_no_number)
        errors = [known["error"], *([known["model_error"]["error"]] if "model_error" in known else [])]
    except (VelaturaError, OSError, ValueError, TypeError, KeyError, RecursionError):
        return {}
    return known if all(isinstance(error, float) for error in errors) else {}


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number")
