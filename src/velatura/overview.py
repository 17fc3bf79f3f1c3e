"""A material on one page: its layers with the light that they reflect, a picture, and the numbers of its lobes."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from velatura import files
from velatura.comparison import check_figure
from velatura.errors import MissingTool, needs, short
from velatura.model import DEFAULT, Model
from velatura.model.lobe_statistics import StackLobes
from velatura.optics import ggx
from velatura.stack import MaterialLike, Mix, Stack, cross_section, load

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INCIDENCE = np.pi / 4  # of the light on the drawing
COSINES = np.cos(np.radians([0, 15, 30, 40, 50, 60, 65, 70, 75, 80, 85]))
SECTION, ABOVE = 1.6, 1.1  # width of a cross-section, and how high lobes may rise above it
APART = 1.1  # from one section to the next, in widths
BAND = 0.22  # height of a band
UNEVEN = 0.06  # height of a surface of alpha 1
ROOT = 3.0  # lobes are drawn by this root of their values
PAGE, DPI = (11, 7.5), 110  # of a file, in inches
SPP, PIXELS = 64, 320  # samples per pixel of the ball, and its pixels along a side


def show(
    material: MaterialLike,
    path: str | Path | None = None,
    model: str | Model = DEFAULT,
    *,
    spp: int = SPP,
    size: int = PIXELS,
    progress: Callable[[int, int], None] | None = None,
    **switches: Any,
) -> Figure:
    """A material on one page: a cross-section, a ball, and the energy and roughness of its lobes.

    The cross-section has the colours of white light: of media what passes them twice and what they scatter, of metals
    what they reflect along the normal. Above it are the lobes in the plane of incidence, f cos by their cube roots, of
    light that comes at 45 degrees.

    Args:
        material: a stack, a mixture, a file, or a preset's name.
        path: a file to write (PNG, WebP, PDF or SVG), whole or not at all; none unless given.
        model: a named model, its choices changed by `switches`.
        spp, size: samples per pixel of the ball and its pixels; where Mitsuba is missing, there is none.
        progress: called with (samples done, spp) now and then.

    Returns:
        A figure of Matplotlib, among those of `pyplot`, which notebooks show.

    Raises:
        InvalidInput: not a valid material, an unknown model or switch, a texture, or a file that cannot be written.
        MissingTool: the extra `plots` is not installed.
    """
    target = None if path is None else check_figure(path)
    with needs("plots"):
        from matplotlib import pyplot
    figure: Figure = pyplot.figure(figsize=PAGE, layout="constrained")
    _draw(figure, material, model, spp, size, progress, switches)
    if target:
        with files.whole(target) as unfinished:
            figure.savefig(unfinished, dpi=DPI)
    return figure


def page(
    material: MaterialLike, kind: str, model: str | Model = DEFAULT, *, spp: int = SPP, size: int = PIXELS
) -> bytes:
    """The contents of a file of such a page, of a `kind` as Matplotlib has it (png, svg, pdf), in any thread.

    Raises:
        InvalidInput, MissingTool: as `show`.
    """
    with needs("plots"):
        from matplotlib.figure import Figure

    figure, contents = Figure(figsize=PAGE, layout="constrained"), io.BytesIO()
    _draw(figure, material, model, spp, size, None, {})
    figure.savefig(contents, format=kind, dpi=DPI)
    return contents.getvalue()


def _draw(
    figure: Figure,
    material: MaterialLike,
    model: str | Model,
    spp: int,
    size: int,
    progress: Callable[[int, int], None] | None,
    switches: Mapping[str, Any],
) -> None:
    from velatura import api

    described = load(material)
    lobes = api.lobes(described, COSINES, model=model, **switches)
    drawn = api.lobes(described, np.cos(INCIDENCE), model=model, **switches)
    parts: Any = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    upper, lower = parts
    sections, ball = upper.subplots(1, 2, width_ratios=(1.7, 1))
    _draw_sections(sections, described, drawn.parts)
    try:
        picture = api.render(described, spp=spp, size=size, model=model, progress=progress, **switches)
    except MissingTool as error:
        ball.text(0.5, 0.5, short(str(error), 60), ha="center", wrap=True)
    else:
        from velatura.scenes import tone_map

        ball.imshow(tone_map(picture))
    ball.set_axis_off()
    axes = lower.subplots(1, 3, width_ratios=(1, 1, 1.1))
    lobes.plot(axes[:2])
    _draw_numbers(axes[2], lobes)
    name = model if isinstance(model, str) else model.name
    figure.suptitle(f"{_text(described.name or 'Material')} ({name})")


def _draw_sections(axes: Axes, material: Stack | Mix, lobes: Sequence[StackLobes]) -> None:
    """The stacks of a material side by side, each with its lobes above."""
    for n, ((path, stack), own) in enumerate(zip(material.leaves(), lobes)):
        left = n * APART * SECTION
        _draw_bands(axes, stack, left)
        _draw_lobes(axes, own, left)
        if path:
            axes.text(left + SECTION / 2, ABOVE, " ".join(f"part{number}" for number in path), ha="center", va="bottom")
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_bands(axes: Axes, stack: Stack, left: float) -> None:
    found = cross_section.bands(stack)[1:]
    bottom = -BAND * len(found)
    for n, band in enumerate(found):
        points = np.array(cross_section.outline(band.alpha or 0.0, SECTION))
        x, y = left + points[:, 0], UNEVEN * points[:, 1] - n * BAND
        axes.fill_between(x, y, bottom, color=band.colour, linewidth=0)
        if band.alpha is not None:
            axes.plot(x, y, color="0.2", linewidth=0.8)
        words = "\n".join(short(each, 64) for each in (band.surface, band.words) if each)
        dark = float(np.dot(band.colour, (0.2126, 0.7152, 0.0722))) < 0.45
        colour = "white" if dark else "black"
        axes.text(left + 0.02, -(n + 0.5) * BAND, _text(words), va="center", fontsize=6.5, color=colour)


def _draw_lobes(axes: Axes, lobes: StackLobes, left: float) -> None:
    """Each lobe around the middle of the section, and the ray of light that makes them."""
    middle = left + SECTION / 2
    theta = np.linspace(-np.pi / 2 + 0.01, np.pi / 2 - 0.01, 721)
    half = (theta - INCIDENCE) / 2
    normal = np.sin(half), 0.0, np.cos(half)
    reflected = {name: lobe for name, lobe in lobes.named.items() if name != "T"}
    shapes = {}
    for name, lobe in reflected.items():
        across, along = lobe.alpha.reshape(-1, 2, lobe.alpha.shape[-1]).mean(axis=0)[::-1, 0]
        turned = float(np.mean(lobe.rotation))
        alpha = max(float(np.hypot(along * np.cos(turned), across * np.sin(turned))), 0.02)
        shapes[name] = lobe.energy.mean() * ggx.ndf(normal, alpha, alpha)
    highest = max((float(shape.max()) for shape in shapes.values()), default=0.0)
    for n, (name, shape) in enumerate(shapes.items()):
        reach = 0.95 * ABOVE * (shape / highest) ** (1 / ROOT) if highest > 0 else 0 * shape
        x, y = middle + reach * np.sin(theta), reach * np.cos(theta)
        axes.fill(x, y, facecolor=f"C{n}", alpha=0.25, edgecolor=f"C{n}")
        peak = int(np.argmax(shape))
        axes.text(x[peak], y[peak], name, color=f"C{n}", fontsize=8)
    start = (middle - SECTION / 2, SECTION / 2 / np.tan(INCIDENCE))
    axes.annotate("", (middle, 0.0), start, arrowprops={"arrowstyle": "->", "color": "0.3"})


def _draw_numbers(axes: Axes, lobes: Any) -> None:
    """The lobes of light along the normal, and of that at 60 degrees."""
    axes.set_axis_off()
    rows = [row for table in lobes.as_tables() for row in table.rows if row and row[0] in ("1", "0.5")]
    lines = [f"{'cos':4} {'lobe':10} {'energy':21} {'alpha':13}"]
    for cosine, name, energy, *alpha in rows[:22]:
        first = energy.splitlines()[0]
        lines.append(f"{cosine:4} {short(name, 10):10} {first:21} {(alpha[0].splitlines()[0] if alpha else ''):13}")
    axes.text(0, 1, _text("\n".join(lines)), va="top", family="monospace", fontsize=7)


def _text(words: str) -> str:
    """Words that Matplotlib takes as they are, and not for mathematics."""
    return words.replace("$", r"\$")
