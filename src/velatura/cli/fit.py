"""`velatura fit`: the stack that comes closest to a table of reflectance over angles."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import invert, options, progress
from velatura.errors import InvalidInput, MissingTool, one_line

if TYPE_CHECKING:
    from velatura.inverse import Fit, ModelError, ReflectanceTable
    from velatura.inverse.fitting.fit_set import Entry
    from velatura.model import Model
    from velatura.stack import Described

Output = Annotated[Path | None, typer.Option("--output", "-o", metavar="F", help="The material (YAML or JSON).")]

MOST = 10  # pairs of parameters that are printed


def fit(
    tables: Annotated[
        list[str],
        typer.Argument(
            metavar="TABLE...",
            help="CSV (theta_i,theta_o,phi,r,g,b or theta_i,phi_i,theta_o,phi_o,r,g,b, in degrees and 1/sr), "
            "or a measurement of MERL (.binary), RGL (_rgb.bsdf, _spec.bsdf), KAIST (.pbsdf), by ASTM E1392 (.astm), "
            "or of Zemax (.bsdf); several, or a folder of them.",
        ),
    ],
    target: Annotated[
        str,
        typer.Argument(
            metavar="TARGET",
            help="Its approximate lobes at normal incidence: a file as `velatura invert --help` describes.",
        ),
    ],
    starts: Annotated[int, typer.Option(min=1, max=100, metavar="N", help="Stacks to descend from.")] = 4,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="F", help="The material (YAML or JSON); of several tables, a folder of results."
        ),
    ] = None,
    walks: Annotated[
        int,
        typer.Option(
            min=0, max=10**6, metavar="N", help="Random walks per direction that the model is held against; 0 for none."
        ),
    ] = 1000,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of these stacks.")] = 0,
    plot: Annotated[bool, typer.Option("--plot", help="Draw table and fit to TABLE, ending in .png, here.")] = False,
    model: options.Model = None,
    settings: invert.Switches = None,
    as_json: options.Json = False,
) -> None:
    """Find the stack closest to a table of reflectance over angles.

    Several tables, or a folder of them, are fitted one after the other: each gets a material and a report (JSON) in the
    folder -o, and is left as it is where it was fitted before; one that fails is named, and the others are done.

    Reports the interval of each parameter (95 %), the parameters of which one makes up for the other, other stacks
    that fit as well, and the error of the model itself beside random walks of the stack, below which no fit is known.
    """
    # Refuse what cannot work before anything slow begins
    from velatura import inverse

    wanted, name, switches = invert.read(target, model, settings)
    if len(tables) > 1 or Path(tables[0]).is_dir():

        def beside(found: Fit, rows: ReflectanceTable) -> ModelError | None:
            return _beside_walks(found, rows, walks, seed)

        made = inverse.fit_set(
            tables, wanted, _folder(output), starts, name, seed, beside if walks else None, **switches
        )
        _set(made, output, plot, as_json)
        return
    (table,) = tables
    rows = inverse.load_table(table)
    check(output)
    picture = invert.picture(table) if plot else None
    with progress.clock(f"Fitting {Path(table).name}"):
        found = inverse.fit_target(rows, wanted, starts, name, seed, **switches)
        own = _beside_walks(found, rows, walks, seed) if walks else None
    if picture:
        draw(rows, found, wanted.name or Path(table).name, picture)
    show(found, output, picture, as_json, own)


def _folder(output: Path | None) -> Path:
    """The folder of the results of several tables."""
    if output is None or output.suffix.lower() in invert.ENDINGS or output.is_file():
        raise InvalidInput(f"-o{f' {output}' if output else ''}: needs a folder for the results of several tables")
    return output


def _set(made: Iterable[Entry], folder: Path | None, plot: bool, as_json: bool) -> None:
    """Print a line for each table of a set, draw its fit, and fail if one has none."""
    reports, failed = dict[str, Any](), False
    for each in made:
        if each.report is None:
            failed = True
            where = "" if each.why.startswith(str(each.path)) else f"{each.path}: "
            print(one_line(f"velatura: {where}{each.why}"), file=sys.stderr)
            continue
        reports[str(each.path)] = each.report
        if not as_json:
            own = each.report.get("model_error")
            beside = f", of the model itself {own['error']:.2g}" if own else ""
            print(
                f"{each.path}: error {each.report['error']:.2g}{beside}{'' if each.found else ' (known)'}", flush=True
            )
        if plot and each.found and each.table and folder:
            draw(each.table, each.found, each.path.name, folder / f"{each.path.stem}.png")
    if as_json:
        print(json.dumps(reports, allow_nan=False))
    if failed:
        raise typer.Exit(1)


def _beside_walks(found: Fit, rows: ReflectanceTable, walks: int, seed: int) -> ModelError | None:
    """The error of the model itself; None where there is nothing to walk with, so that the fit is kept."""
    from velatura import inverse

    try:
        return inverse.model_error(found, rows.directions, walks, seed)
    except MissingTool as error:
        print(f"velatura: no walks: {error}", file=sys.stderr)
        return None


def check(output: Path | None) -> None:
    """Raises `InvalidInput` unless a material can be written there."""
    from velatura import files

    if output:
        files.check_writable(output, "a material file", invert.ENDINGS)


def show(found: Fit, output: Path | None, picture: Path | None, as_json: bool, own: ModelError | None = None) -> None:
    """Write the material, and print it with its error, that of the model itself, and the name of a picture of it."""
    from velatura.stack import save

    if output:
        save(found.stack, output)
    if as_json:
        walked = {"model_error": vars(own)} if own else {}
        print(json.dumps({"model": found.model.name, **found.to_dict(), **walked}, allow_nan=False))
        return
    report(found, own)
    conclude(found.model, found.stack, output, [picture] if picture else [])


def conclude(model: Model, material: Described, output: Path | None, pictures: Sequence[Path]) -> None:
    """Print for which model a material holds, the file that it was written to or itself, and its pictures."""
    from velatura.stack import dumps

    invert.say_for_which(model)
    print(output if output else dumps(material, "yaml"), end="\n" if output else "")
    for picture in pictures:
        print(picture)


def report(found: Fit, own: ModelError | None = None) -> None:
    """Print errors, energies, parameters and other stacks of a fit."""
    console = options.console()
    of = "log(1 + f cos), and ten times of energies" if found.energies else "log(1 + f cos)"
    print(f"Error of {of}: {found.error:.2g} (from other starts: {_others(found)})")
    if own:
        print(f"Error of {found.model.name} itself beside walks of this stack: {own.error:.2g} (noise {own.noise:.2g})")
    for table in found.as_tables():
        console.print(table)
    for one, two, correlation in found.trades[:MOST]:
        print(f"{one} and {two} trade places (correlation {correlation:+.3f})")
    if len(found.trades) > MOST:
        print(f"and {len(found.trades) - MOST} more pairs: --json")
    for n, other in enumerate(found.others, 1):
        count = len(other.stack.interfaces)
        layers = " | ".join(_written(layer) for layer in other.stack.layers)
        print(f"Fits as well ({n}): error {other.error:.2g}, {count} interface{'s' * (count > 1)}: {layers}")


def _written(layer: Any) -> str:
    """A layer in a line: its values that are not those by default."""

    def digits(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else "[" + ", ".join(f"{x:.3g}" for x in value) + "]"

    values = layer.to_dict()
    return layer.kind + "".join(
        f" {key} {digits(value)}" for key, value in values.items() if not isinstance(value, str)
    )


def draw(rows: ReflectanceTable, found: Fit, title: str, path: Path) -> None:
    """A picture of the table and the fit, written whole or not at all."""
    from velatura import files

    figure = found.plot(rows, title)
    with files.whole(path) as unfinished:
        figure.savefig(unfinished, dpi=110)


def _others(found: Fit) -> str:
    return ", ".join(f"{error:.2g}" for error in found.errors[1:]) or "none"
