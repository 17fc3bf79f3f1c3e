"""`velatura explore`: stacks with equal lobes at normal incidence, by their difference at grazing angles."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Annotated, Any

import typer

from velatura.cli import invert, options, progress
from velatura.errors import InvalidInput

COLUMNS = 4  # of the contact sheet
SEEN = 5e-3  # optical depth that two digits show


def explore(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="A target file, as `velatura invert --help` describes it.")
    ],
    sheet: Annotated[bool, typer.Option("--sheet", help="Render the stacks into one picture.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="F", help="The sheet; default: TARGET, ending in -sheet.png, here."),
    ] = None,
    count: Annotated[int, typer.Option(min=1, max=100, metavar="N", help="Number of stacks.")] = 8,
    env: Annotated[
        str, typer.Option(metavar="NAME|F", help="studio, sky, furnace, or an .hdr or .exr file.")
    ] = "studio",
    spp: Annotated[int, typer.Option(min=1, max=2**16, metavar="N", help="Samples per pixel.")] = 32,
    size: Annotated[int, typer.Option(min=16, max=2048, metavar="N", help="Pixels of each picture.")] = 192,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of the random stacks.")] = 0,
    model: options.Model = None,
    settings: invert.Switches = None,
) -> None:
    """List stacks that look alike head-on, and not at grazing.

    Every line is a stack that gives the target's lobes, from the top: absorption above, index and roughness of each
    interface. The number before it is its reflectance minus that of the stack that `velatura invert` finds,
    as a share of the incident light: the mean over colours and cosines of incidence .5, .4, .3, .2, .1.
    """
    # Refuse what cannot work before anything slow begins
    import numpy as np

    from velatura import inverse

    wanted, name, switches = invert.read(target, model, settings)
    path = _sheet(output or Path(f"{Path(target).stem}-sheet.png")) if sheet else None
    if output and not sheet:
        raise InvalidInput("-o: is for the sheet; add --sheet")

    # Sort them by how much more or less they reflect than the first
    with progress.clock(f"Solving {Path(target).name}"):
        found = inverse.alternatives(wanted, count, name, seed, **switches)
    seen = [inverse.grazing(solution.stack, solution.model) for solution in found]
    apart = [float(np.abs(energy - seen[0]).mean()) for energy in seen]
    order = np.argsort(apart, kind="stable")
    for n in order:
        print(f"{apart[n]:.4f}  {_listed(found[n])}")
    invert.say_for_which(found[0].model)
    if path:
        title = (
            f"{wanted.name or Path(target).stem}: stacks with the same lobes head-on, by {found[0].model.name}. "
            "Difference from the first in what is reflected at cosines .5 to .1, as a share of the light"
        )
        labels = [f"{_indices(found[n])}\ndifference {apart[n]:.3f}" for n in order]
        _render([found[n].stack for n in order], title, labels, path, found[0].model, env, spp, size, seed)
        print(path)


def _sheet(path: Path) -> Path:
    from velatura import comparison

    comparison.check_figure(path)
    return path


def _listed(solution: Any) -> str:
    """A stack in a line, from the top: absorption, index and roughness of every interface."""
    import numpy as np

    def colour(value: Any) -> str:
        numbers = [f"{x:.4g}" for x in np.ravel(value)]
        return numbers[0] if len(set(numbers)) == 1 else "[" + ", ".join(numbers) + "]"

    parts = []
    for layers in solution.layers:
        tau = f"tau {colour(layers.tau)} | " if np.max(layers.tau) > 1e-6 else ""
        k = f" + {colour(layers.kappa)}i" if layers.kappa is not None else ""
        blur = colour(layers.roughness[:2])
        parts.append(f"{tau}eta {colour(layers.eta)}{k} alpha {blur}")
    return " | ".join(parts)


def _indices(solution: Any) -> str:
    """The indices of a stack from the top, and what absorbs above each interface, the mean of the colours."""
    import numpy as np

    each = [
        f"{np.mean(layers.eta):.2f}" + ("" if layers.kappa is None else f" + {np.mean(layers.kappa):.2f}i")
        for layers in solution.layers
    ]
    tau = [float(np.mean(layers.tau)) for layers in solution.layers]
    return f"eta {', '.join(each)}" + (f"\ntau {', '.join(f'{x:.2f}' for x in tau)}" if max(tau) > SEEN else "")


def _render(
    stacks: list[Any], title: str, labels: list[str], path: Path, model: Any, env: str, spp: int, size: int, seed: int
) -> None:
    import velatura
    from velatura import inverse
    from velatura.figures import canvas

    # A renderer knows only lobes that are blurred alike in all colours
    seen = model.with_switches(channels="mean")
    rows = -(-len(stacks) // COLUMNS)
    columns = min(len(stacks), COLUMNS)
    figure = canvas.canvas(2.4 * columns, 3.1 * rows + 0.5)
    figure.suptitle(textwrap.fill(title, 34 * columns), fontsize="medium")
    with progress.bar(f"Rendering {path.name}") as advance:
        for n, (stack, label) in enumerate(zip(stacks, labels), 1):
            image = velatura.render(inverse.on_black(stack), "sphere", env, spp, (size, size), seen, seed)
            canvas.show(figure.add_subplot(rows, columns, n), image, label)
            advance(n, len(stacks))
    canvas.save(figure, path)
