"""`velatura benchmark`: the open benchmark of layered models."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from velatura.cli import options, progress
from velatura.errors import InvalidInput, one_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from velatura.benchmark import Factory, Scores

app = typer.Typer(
    help="Score models of layered materials against random walks.",
    rich_markup_mode=None,
    no_args_is_help=True,
)

Kinds = Annotated[
    list[str] | None, typer.Option("--kind", metavar="KIND", help="Stacks of this kind only; may be repeated.")
]

Edition = Annotated[
    int, typer.Option("--edition", metavar="N", help="1: stacks of every sort; 2: as people make them.")
]


@app.command()
def score(
    models: Annotated[
        str | None,
        typer.Option("--model", metavar="NAME,NAME,...", help="Entrants; default: all, which takes minutes."),
    ] = None,
    values: Annotated[
        Path | None,
        typer.Option(metavar="F", help="Values of a model of your own (.npy), at the pairs of `benchmark pairs`."),
    ] = None,
    edition: Edition = 1,
    kinds: Kinds = None,
    cost: Annotated[bool, typer.Option("--cost", help="Measure what an evaluation costs as well.")] = False,
    keep: Annotated[
        Path | None,
        typer.Option(
            parser=options.folder, metavar="FOLDER", help="Keep scores there; those that it has are not made again."
        ),
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="F", help="A figure of the scores (PNG, PDF or SVG).")] = None,
    as_json: options.Json = False,
) -> None:
    """Score entrants, or the values of another model."""
    # Refuse what cannot work before anything slow begins
    from velatura import benchmark
    from velatura.comparison import check_figure

    if plot:
        check_figure(plot)
    if values and kinds:
        raise InvalidInput("--values: holds all kinds of stacks; not together with --kind")
    own = dict([_from_file(values, edition)]) if values else {}
    names = models.split(",") if models else [] if values else list(benchmark.ENTRANTS)
    factories = {**{name: benchmark.entrant(name) for name in names}, **own}
    found = []
    for name, factory in factories.items():
        with progress.bar(f"Scoring {name}") as advance:
            place = keep and keep / f"{name}.json"
            found.append(benchmark.kept_score(place, factory, name, kinds, cost, advance, edition))
    if plot:
        benchmark.save_figure(found, plot)

    if as_json:
        print(json.dumps([each.to_dict() for each in found], allow_nan=False))
        return
    for line in _table(found):
        print(line)


@app.command()
def pairs(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", parser=options.folder, metavar="FOLDER", help="For stacks.json and pairs.npz."),
    ],
    edition: Edition = 1,
) -> None:
    """Write the stacks, and the pairs of directions that `score --values` takes values of."""
    from velatura import benchmark

    count = benchmark.write_task(output, edition)
    print(f"{output}: stacks.json; pairs.npz, {count} pairs")


@app.command()
def truth(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", parser=options.folder, metavar="FOLDER", help="Continued where it was begun."),
    ],
    edition: Edition = 1,
    stacks: Annotated[
        int | None, typer.Option(min=1, max=20, metavar="N", help="Of each kind; default: as many as the edition has.")
    ] = None,
    paths: Annotated[int, typer.Option(min=2, max=2**24, metavar="N", help="Random walks for each direction.")] = 2**21,
    seed: Annotated[
        int | None,
        typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of stacks and walks; default: the edition's."),
    ] = None,
) -> None:
    """Walk through all stacks again: the truth as the package has it, or that of another seed."""
    from velatura import benchmark

    with progress.bar("Walking") as advance:
        benchmark.walk_all(output, stacks, paths, seed, advance, edition)
    print(f"{output}: stacks.json, truth.npz, energies.csv")


def _from_file(path: Path, edition: int) -> tuple[str, Factory]:
    """The name of a candidate, and the values that a file has of it."""
    from velatura import benchmark

    name = one_line(path.stem)
    if name in benchmark.ENTRANTS:
        raise InvalidInput(f"{path}: --values: has the name of an entrant; rename the file")
    try:
        return name, benchmark.from_values(benchmark.values_of(path), benchmark.edition(edition))
    except InvalidInput as error:
        raise InvalidInput(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None


def _table(scores: Sequence[Scores]) -> Iterator[str]:
    """A line per candidate, those that express most first."""
    width = max(len(each.name) for each in scores)
    columns = {
        "variation": ("variation", 4),
        "floor": ("noise", 4),
        "albedo": ("albedo", 4),
        "worst_albedo": ("worst", 3),
        "width": ("width", 3),
        "spread": ("spread", 2),
        "cost": ("cost", 2),
    }
    yield f"{'':{width}}   scored" + "".join(f"{title:>10s}" for title, _ in columns.values())
    summaries = [(each.name, each.summary()) for each in scores]
    for name, found in sorted(summaries, key=lambda pair: (-pair[1]["records"], pair[1].get("variation", 0))):
        cells = [f"{found[key]:10.{n}f}" if key in found else f"{'-':>10s}" for key, (_, n) in columns.items()]
        yield f"{name:{width}}  {found['records']:3d}/{found['asked']:3d}" + "".join(cells)
