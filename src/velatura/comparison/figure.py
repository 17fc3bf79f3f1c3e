"""A comparison as one figure: lobes against the angle, the distribution, and the spheres if there are any."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from velatura import files, scenes
from velatura.comparison.result import Comparison, Pictures
from velatura.errors import needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".webp", ".pdf", ".svg")

_TRUTH: dict[str, Any] = {"color": "black", "fmt": "o", "markersize": 4, "capsize": 3, "label": "truth"}
_HEADROOM = 1.3  # over the bars, for their legend
_WIDTH, _HEIGHT = 3.2, 2.7  # of one plot, inches


def check_figure(path: str | Path) -> Path:
    """The path of a figure, once it is sure that it can be drawn and written there.

    Raises:
        InvalidInput: it cannot be written there.
        MissingTool: the extra `plots` is not installed.
    """
    with needs("plots"):
        import matplotlib  # noqa: F401  (before what is slow)
    return files.check_writable(path, "a figure", SUFFIXES)


def save_figure(comparison: Comparison, path: str | Path) -> None:
    """Draw a comparison into a PNG, WebP, PDF or SVG, written whole or not at all.

    Above: energy and roughness of every lobe, the truth with its standard errors, the models as lines (dashed along the
    second axis of roughness). Then total variation, and the distribution in the plane of incidence. Below, if
    there are pictures: the spheres, and what each model has too much (red) or too little (blue).

    Raises:
        InvalidInput, MissingTool: as `check_figure`.
    """
    from matplotlib.figure import Figure

    target = check_figure(path)
    figure = _drawn(comparison, Figure)
    with files.whole(target) as unfinished:
        figure.savefig(unfinished, dpi=120)


def shown(comparison: Comparison) -> Figure:
    """The figure among those of `pyplot`, which notebooks show.

    Raises:
        MissingTool: the extra `plots` is not installed.
    """
    with needs("plots"):
        from matplotlib import pyplot
    return _drawn(comparison, pyplot.figure)


def _drawn(comparison: Comparison, new: Callable[..., Figure]) -> Figure:
    lobes, angles = len(comparison.lobe_names), len(comparison.cos_theta)
    shown = comparison.pictures
    columns = max(lobes, angles + 1)
    heights = (2, 1, len(comparison.models)) if shown else (2, 1)
    figure = new(figsize=(_WIDTH * columns, _HEIGHT * sum(heights)), layout="constrained")
    figure.suptitle(f"{comparison.name or 'Material'}: models against the truth, {comparison.paths} paths")
    parts: Any = figure.subfigures(len(heights), 1, height_ratios=heights)
    _draw_lobes(parts[0].subplots(2, lobes, squeeze=False, sharex=True), comparison)
    parts[0].legend(*parts[0].axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    _draw_distribution(parts[1].subplots(1, angles + 1), comparison)
    if shown:
        _draw_pictures(parts[2], shown)
    return figure


def _draw_lobes(axes: NDArray[Any], comparison: Comparison) -> None:
    degrees = np.degrees(np.arccos(comparison.cos_theta))
    models = comparison.models.items()
    for k, name in enumerate(comparison.lobe_names):
        true, error = comparison.truth.lobes[k], comparison.standard_error[k]
        # Energy, the mean of the colours
        upper, lower = axes[:, k]
        upper.set_title(f"{name}: energy")
        upper.errorbar(degrees, true.energy.mean(axis=0), error.energy.mean(axis=0), **_TRUTH)
        for model, account in models:
            upper.plot(degrees, account.lobes[k].energy.mean(axis=0), label=model)
        # Roughness along both axes
        lower.set_title(f"{name}: alpha")
        lower.set_xlabel("angle of incidence (°)")
        for axis, style in enumerate(("-", "--")):
            lower.errorbar(degrees, true.alpha[axis], error.alpha[axis], **_TRUTH)
            for i, (_, account) in enumerate(models):
                lower.plot(degrees, account.lobes[k].alpha[axis], color=f"C{i}", linestyle=style)
        for plot in (upper, lower):
            plot.set_ylim(0, 1.15 * max(plot.dataLim.y1, 1e-3))
    axes[0, 0].set_ylabel("share of the light")
    axes[1, 0].set_ylabel("GGX alpha (2nd axis dashed)")


def _draw_distribution(axes: NDArray[Any], comparison: Comparison) -> None:
    # Total variation as bars, one group for each direction
    bars = axes[0]
    places, width = np.arange(len(comparison.cos_theta)), 0.8 / (len(comparison.models) + 1)
    bars.bar(places, comparison.noise, width, color="0.8", label="noise of the truth")
    for i, variation in enumerate(comparison.total_variation.values(), 1):
        bars.bar(places + i * width, variation, width, color=f"C{i - 1}")
    bars.set_xticks(places + 0.4 - width / 2, [f"{cosine:g}" for cosine in comparison.cos_theta])
    bars.set(title="total variation", xlabel="cosine of incidence", ylabel="misplaced share of the light")
    bars.set_ylim(0, _HEADROOM * bars.dataLim.y1)
    bars.legend(fontsize="small", loc="upper left")
    # The distribution in the plane of incidence
    for n, cosine in enumerate(comparison.cos_theta):
        axes[n + 1].set(title=f"plane of incidence, cos {cosine:g}", xlabel="x on the disc")
        _draw_slices(axes[n + 1], comparison, n)
    axes[1].set_ylabel("light per area of the disc")


def _draw_slices(axes: Axes, comparison: Comparison, n: int) -> None:
    """Energy per area of the disc in the two rows of bins along the plane of incidence."""
    bins = comparison.truth.distribution.shape[-1]
    edges = np.linspace(-1, 1, bins + 1)

    def row(grid: NDArray[np.floating]) -> NDArray[np.floating]:
        return grid[:, n, :, bins // 2 - 1 : bins // 2 + 1].mean(axis=(0, 2)) * (bins / 2) ** 2

    axes.stairs(row(comparison.truth.distribution), edges, fill=True, color="0.8", label="truth")
    for i, account in enumerate(comparison.models.values()):
        axes.stairs(row(account.distribution), edges, color=f"C{i}")
    axes.set_yscale("log")
    axes.set_ylim(1e-3, None)
    axes.legend(fontsize="small", loc="upper right")


def _draw_pictures(figure: Any, shown: Pictures) -> None:
    """A row per model: the truth, the model, the difference."""
    rows = figure.subplots(len(shown.models), 3, squeeze=False)
    differences = {name: (image - shown.truth).mean(axis=-1) for name, image in shown.models.items()}
    limit = max(float(np.percentile(np.abs(d), 99)) for d in differences.values()) or 1.0
    for (true, modelled, apart), (name, image) in zip(rows, shown.models.items()):
        true.imshow(scenes.tone_map(shown.truth))
        modelled.imshow(scenes.tone_map(image))
        drawn = apart.imshow(differences[name], cmap="RdBu_r", vmin=-limit, vmax=limit)
        figure.colorbar(drawn, ax=apart, shrink=0.8, label=f"{name} - truth")
        true.set_title("truth")
        modelled.set_title(name)
        apart.set_title(f"RMSE {shown.rmse(name):.4f} (noise {shown.noise:.4f})")
    for axes in rows.flat:
        axes.set_axis_off()
