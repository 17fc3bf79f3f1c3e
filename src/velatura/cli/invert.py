"""`velatura invert`: stacks with given lobes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import options, progress
from velatura.errors import InvalidInput, needs
from velatura.results import cell

if TYPE_CHECKING:
    from velatura.inverse import Answer, Solution, Target, TargetLobe
    from velatura.model import Model

SHOWN = 5e-5  # difference of energies or roughnesses that four digits show
ENDINGS = (".yaml", ".yml", ".json")

TargetFile = Annotated[str, typer.Argument(metavar="TARGET", help="A target file (YAML or JSON).")]
Switches = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A switch of the model (tir=off); may be repeated."),
]


def invert(
    target: TargetFile,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            parser=options.folder,
            metavar="F",
            help="A material file, or a folder if --count is given.",
        ),
    ] = None,
    count: Annotated[
        int, typer.Option(min=1, max=1000, metavar="N", help="Number of stacks; all but the first are random.")
    ] = 1,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of the random stacks.")] = 0,
    way: Annotated[
        int, typer.Option(min=0, metavar="N", help="Where there is no stack: take the N-th of the ways out.")
    ] = 0,
    plot: Annotated[bool, typer.Option("--plot", help="Draw the classes to TARGET, ending in .png, here.")] = False,
    model: options.Model = None,
    settings: Switches = None,
    as_json: options.Json = False,
) -> None:
    """Find stacks that have given lobes, or another appearance.

    A target file lists lobes at normal incidence from the top, each by its energy and its blur:

    \b
    name: Hazy metal
    lobes:
      - {energy: 0.1, alpha: 0}
      - {energy: [0.35, 0.25, 0.3], alpha: 0.1, base: conductor}

    \b
    Of a lobe:
      energy      share of the light: a number, or [r, g, b]
      alpha       GGX roughness, 0 to 1, 0 unless given; or variance in its place;
                  [u, v] along two axes of a brushed lobe
      rotation    of these, in degrees anticlockwise as seen from outside
      interfaces  that make it: 1, a pair, 2, or 3
      base        dielectric or, of the last lobe, conductor
      tint        of a conductor, 0 (strongest edge tint) to 1
      fixed       {eta, k, alpha, tau, films}: of each interface, or null: [1.5]
    Of the whole: exterior (1), eta_max (4), channels (mean or separate), name;
      start       a material, as a file has it, or a preset's name, with which
                  the search begins
      available   substances that interfaces may lie above: [water, bk7, 1.6, Au],
                  and lacquers: {eta: 1.5, sigma_a: [0.1, 0.2, 0.9]}
      thinnest    the least depth of a medium, of lacquers above all
    Without lobes, both of these ask for those of the start.

    Wishes beyond these, of lobes or of a start alone: energy, and angle (degrees):

    \b
      grazing     what is reflected at a second angle (75); lobe, alpha
      passed      what a pane passes; alpha, or haze in its place
      body        the colour of a base or scattering medium, seen from outside
      film        the colour by a film's thickness; layer, film,
                  thinnest_nm, thickest_nm
      mixture     the colour of a start with mix, by the weights of its parts
    """
    # Refuse what cannot work before anything slow begins
    from velatura import inverse
    from velatura.inverse import Infeasible

    wanted, name, switches = read(target, model, settings)
    folder = _folder(output, count)
    if plot and wanted.beyond_lobes:
        raise InvalidInput(f"--plot: draws classes of lobes alone; the target asks for {wanted.beyond_lobes[0]}, too")
    drawn = picture(target) if plot else None

    solve: Callable[..., list[Any]] = inverse.answers if wanted.beyond_lobes else inverse.alternatives
    try:
        with progress.clock(f"Solving {Path(target).name}"):
            found = solve(wanted, count, name, seed, **switches)
    except Infeasible as error:
        if not 0 < way <= len(error.directions):
            if as_json:
                nearest = error.nearest.to_dict() if error.nearest else None
                report = {"feasible": False, "model": name, "why": error.why, "nearest": nearest}
                print(json.dumps(report | {"ways": [each.to_dict() for each in error.directions]}, allow_nan=False))
            raise
        taken = error.directions[way - 1]
        if not as_json:
            print(f"No stack: {error.why}. Taken in its place: {taken.words}.")
        found = solve(taken.target, count, name, seed, **switches)
    paths = _write(found, output, folder, Path(target).stem)
    if wanted.beyond_lobes:
        _say(found, paths, as_json)
        return
    if drawn:
        draw_classes(found[0], drawn)

    if as_json:
        first = found[0]
        classes = [members.to_dict() for members in first.classes]
        answer = {"stack": first.stack.to_dict(), "class": {"lobes": classes}}
        report = {"feasible": True, "model": first.model.name, **answer}
        report |= {"reached": first.reached.to_dict()} if first.reached else {}
        print(json.dumps(report | ({"stacks": [s.stack.to_dict() for s in found]} if count > 1 else {})))
        return
    for solution in found:
        for table in solution.as_tables():
            options.console().print(table)
        for line in _missed(solution):
            print(line)
    say_for_which(found[0].model)
    for path in [*paths, *([drawn] if drawn else [])]:
        print(path)


def _say(found: list[Answer], paths: list[Path], as_json: bool) -> None:
    """Print answers to wishes beyond lobes: what is asked for, what the stacks have, and these, unless they are
    written."""
    from velatura.stack import dumps

    if as_json:
        first = found[0]
        report = {"feasible": True, "model": first.model.name, "stack": first.stack.to_dict(), "missed": first.missed}
        more = {"stacks": [each.stack.to_dict() for each in found]} if len(found) > 1 else {}
        print(json.dumps({**report, "reached": first.reached.to_dict(), **more}, allow_nan=False))
        return
    for one in found:
        for n, (lobe, own) in enumerate(zip(one.target.lobes, one.reached.lobes), 1):
            print(f"asked: lobe {n} {_described(lobe)}; has: {_described(own)}")
        for wish, has in zip(one.target.further, one.reached.further):
            print(f"asked: {wish.words()}; has: {has.words()}")
        if not paths:
            print(dumps(one.stack, "yaml"), end="")
    say_for_which(found[0].model)
    for path in paths:
        print(path)


def _described(lobe: TargetLobe) -> str:
    alpha = lobe.axes[:2] if lobe.brushed else lobe.roughness
    return f"energy {cell(lobe.energy)}, alpha {cell(alpha)}"


def read(target: str, model: str | None, settings: list[str] | None) -> tuple[Target, str, dict[str, str]]:
    """The target that the user named, the model, and its switches. Raises `InvalidInput`."""
    from velatura import inverse
    from velatura.model import SWITCHES
    from velatura.stack.schema import unknown

    switches = {}
    for setting in settings or ():
        key, _, value = setting.partition("=")
        if key not in SWITCHES:
            raise InvalidInput(f"--set {key}: {unknown('switch', key, SWITCHES)}")
        switches[key] = value
    return inverse.load_target(target), options.model_name(model), switches


def say_for_which(model: Model) -> None:
    """Print for which model an answer holds."""
    from velatura.model import DEFAULT

    if model.name == DEFAULT:
        print(f"Holds for {DEFAULT}, which renders.")
    else:
        print(
            f"Holds for {model.name}; renders are by {DEFAULT}, whose lobes differ: --model {DEFAULT} answers for it."
        )


def draw_classes(solution: Solution, path: Path) -> None:
    """A picture of every lobe's class, written whole or not at all."""
    from velatura import files

    figure = solution.plot(solution.target.name or path.stem)
    with files.whole(path) as unfinished:
        figure.savefig(unfinished, dpi=120)


def _folder(output: Path | None, count: int) -> Path | None:
    """The folder to write to, None for one file or none at all."""
    from velatura import files

    if output is None:
        return None
    if output.suffix.lower() in ENDINGS:
        if count > 1:
            raise InvalidInput(f"{output}: is one file; -o needs a folder for {count} stacks")
        files.check_writable(output, "a material file", ENDINGS)
        return None
    if count == 1 and output.suffix and not output.is_dir():
        raise InvalidInput(f"{output}: a material file ends in {' or '.join(ENDINGS)}; a folder has no ending")
    if output.exists() and not output.is_dir():
        raise InvalidInput(f"{output}: is a file; -o needs a folder, or a name that ends in {', '.join(ENDINGS)}")
    files.check_folder(output if output.is_dir() else output.parent, str(output))
    return output


def picture(source: str) -> Path:
    """Where `--plot` draws: the name of a file, ending in .png, in the working folder."""
    from velatura import files

    with needs("plots"):
        import matplotlib  # noqa: F401  (before what is slow)
    return files.check_writable(Path(f"{Path(source).stem}.png"), "a picture", (".png",))


def _write(found: Sequence[Solution | Answer], output: Path | None, folder: Path | None, stem: str) -> list[Path]:
    from velatura.stack import save

    if output is None:
        return []
    if folder is None:
        paths = [output]
    else:
        folder.mkdir(exist_ok=True)
        paths = [folder / f"{stem}-{n}.yaml" for n in range(1, len(found) + 1)]
    for solution, path in zip(found, paths):
        save(solution.stack, path)
    return paths


def _missed(solution: Solution) -> list[str]:
    """A line for each lobe that the stack misses since too much is fixed."""
    from velatura.inverse import Fixed

    if solution.reached is None:
        return []
    lines = []
    for n, lobes in enumerate(zip(solution.target.lobes, solution.reached.lobes), 1):
        asked, has = ((*lobe.colour, *lobe.axes[:2]) for lobe in lobes)
        if max(abs(a - b) for a, b in zip(asked, has)) > SHOWN:
            why = "what is fixed allows no more" if lobes[0].fixed != Fixed() else "none was found that is nearer"
            lines.append(f"lobe {n}: has energy {cell(has[:3])} and alpha {cell(has[3:])}; {why}")
    return lines
