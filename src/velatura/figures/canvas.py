"""Helpers of all figures: spheres rendered alike, albedos measured alike, plots saved whole or not at all."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter

from velatura import api, files, kernel, scenes
from velatura.checks.probe import Probe, ProbeSamples
from velatura.comparison import check_figure
from velatura.errors import needs
from velatura.figures import Progress
from velatura.scenes.denoise import can_denoise, denoised
from velatura.stack import Measured, Stack, Texture

Array = NDArray[np.floating]
Item = TypeVar("Item")
Paint = Callable[[Any, dict[str, Any]], None]
Draw = Callable[[dict[str, Any], str | Path], None]

SIZE, SAMPLES = 512, 8  # of a picture: pixels along a side, and samples of each
COARSE = 128  # pixels along a side of pictures that are compared, at most: finer ones have more noise
PASSES = 8  # of a picture, each of its own random numbers: the noise of an error is that between them
DPI = 120  # of what is drawn, at least: a picture has all its pixels
PAGE = (1200, 1250)  # pixels across and down, at most, of a .webp without pictures, which stands on a web page
QUALITY = 60  # of a .webp
PASS_SAMPLES = 2**18  # of a pass, where there are so many: a pass has a cost of its own
PICTURE = "picture"  # the group of matplotlib's images that are rendered
#: Of every model: light meets one facet of an interface at a time, as in the reference that it is compared with.
CHOICES: dict[str, Any] = {"reflectance": "fgd"}
#: The model of Belcour 2018 in the form that the paper renders offline (its section 7), and in the other one.
FORMS: dict[str, tuple[str, dict[str, Any]]] = {
    form: ("belcour2018", {"form": form}) for form in ("symmetric", "forward")
}
COLUMNS: dict[str, tuple[str, dict[str, Any]]] = FORMS | {name: (name, {}) for name in ("weidlich_wilkie", "reference")}
STYLES: dict[str, dict[str, Any]] = {
    "symmetric": {"color": "C0"},
    "forward": {"color": "C0", "linestyle": ":"},
    "weidlich_wilkie": {"color": "C1"},
    "reference": {"color": "black", "linestyle": "--"},
}


def track(items: Sequence[Item], progress: Progress | None) -> Iterator[Item]:
    """The items; `progress` is called when each is done."""
    for done, item in enumerate(items, 1):
        yield item
        if progress:
            progress(done, len(items))


def in_channels(stack: Stack) -> Stack:
    """The stack whose metals have one eta and k a channel, as those of the papers; walks would have their spectrum."""
    indices = {address.name: address.plain(x, "") for address, x in stack.values() if isinstance(x, Measured)}
    return stack.replace(**indices)


def bsdf(stack: Stack, model: str, **switches: Any) -> Any:
    """The BSDF of a model with the figures' choices, or a plugin, changed by switches; of a stack `in_channels`."""
    return api.bsdf(in_channels(stack), model, **({} if model in api.PLUGINS else CHOICES) | switches)


def spheres(stack: Stack, model: str, env: str, size: int, spp: int, seed: int, **switches: Any) -> Array:
    """Pictures of a sphere, linear RGB of shape (passes, size, size, 3), each by its share of the samples."""
    return pictures("sphere", stack, model, env, size, spp, seed, **switches)


def pictures(scene: str, stack: Stack, model: str, env: str, size: int, spp: int, seed: int, **switches: Any) -> Array:
    """Pictures of any object, as those of `spheres`."""
    return taken(bsdf(stack, model, **switches), model, scene, env, size, spp, seed)


def taken(made: Any, name: str, scene: str, env: str, size: int, spp: int, seed: int) -> Array:
    """Pictures of a BSDF, whose name chooses its random numbers, as those of `pictures`."""
    mi = kernel.mitsuba()
    count = min(max(size**2 * spp // PASS_SAMPLES, 3), PASSES)  # no fewer than a standard error takes
    numbers = np.random.default_rng([seed, *name.encode()]).integers(2**31, size=count)
    loaded = kernel.load_dict(staged(made, scene, env, size))
    kernel.limit_threads()
    return np.array([mi.render(loaded, spp=max(spp // count, 1), seed=int(number)) for number in numbers])


def staged(made: Any, scene: str, env: str, size: int) -> dict[str, Any]:
    """The scene of a BSDF, as `mi.load_dict` takes it, for pictures whose pixels share no noise."""
    described = scenes.scene_dict(scene, env, made, (size, size))
    described["sensor"]["film"]["rfilter"] = {"type": "box"}
    return described


def texture(path: Path, image: ArrayLike) -> Texture:
    """An image (height, width) of numbers or (height, width, 3) of colours, written to an .exr, as a texture."""
    pixels = np.asarray(image, np.float32)
    scenes.write_image(pixels if pixels.ndim == 3 else np.repeat(pixels[..., None], 3, axis=-1), path)
    return Texture(texture=path, channel="rgb" if pixels.ndim == 3 else "r")


def timed(loaded: Mapping[str, Any], spp: int, repeats: int, seed: int) -> tuple[dict[str, Array], dict[str, Array]]:
    """The pictures of Mitsuba scenes, each the mean of all rounds, and the processor's seconds (rounds,).

    Scenes take turns, so that what else the machine does is shared by all.
    """
    mi = kernel.mitsuba()
    images: dict[str, list[Array]] = {name: [] for name in loaded}
    times: dict[str, list[float]] = {name: [] for name in loaded}
    for i in range(repeats + 1):
        for name, scene in loaded.items():
            start = time.process_time()
            images[name].append(np.array(mi.render(scene, spp=spp, seed=seed + i)))
            times[name].append(time.process_time() - start)
    # The first one compiles
    seconds = {name: np.array(each[1:]) for name, each in times.items()}
    return {name: np.mean(each, axis=0) for name, each in images.items()}, seconds


def ratio(seconds: Array, others: Array) -> tuple[float, float]:
    """The median over rounds of one time over another, and its standard error by the quartiles.

    The error is that of a normal sample's median, whose quartiles are 1.349 standard deviations apart.
    """
    lower, median, upper = np.quantile(seconds / others, (0.25, 0.5, 0.75))
    return float(median), float(np.sqrt(np.pi / 2 / seconds.size) * (upper - lower) / 1.349)


def sampled(made: Any, cosine: float, paths: int, seed: int) -> ProbeSamples:
    """Lobe of a BSDF for light from one direction in the plane of the tangent."""
    wi = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    u = np.random.default_rng(seed).random((paths, 3))
    return Probe(made).sample(np.tile(wi, (paths, 1)), u)


def coarse(pixels: ArrayLike) -> Array:
    """Pictures (..., n, n, 3) as of `COARSE` pixels along a side, or of n, with the filter of Mitsuba's films."""
    image = np.asarray(pixels)
    width = max(image.shape[-2] // COARSE, 1)
    count = image.shape[-2] // width
    smooth = gaussian_filter(image, width / 2, axes=(-3, -2))[..., : count * width, : count * width, :]
    blocks = smooth.reshape(*image.shape[:-3], count, width, count, width, image.shape[-1])
    return np.asarray(blocks.mean(axis=(-4, -2)))


def rmse(passes: Array, others: Array) -> tuple[float, float]:
    """Root mean square difference of two pictures over `coarse` pixels and colours, and its standard error.

    Both are given in passes. Noise is independent between passes, so that it cancels from the mean of the products of
    different passes' differences. The standard error is the jackknife's, over passes.
    """
    differences = coarse(passes - others).reshape(len(passes), -1)
    products = differences @ differences.T / differences.shape[1]
    np.fill_diagonal(products, 0)

    def root(total: Any, count: int) -> Any:
        return np.sqrt(np.maximum(total, 0) / (count * (count - 1)))

    count, total = len(passes), products.sum()
    without = root(total - 2 * products.sum(axis=0), count - 1)
    return float(root(total, count)), float(np.sqrt(count - 1) * without.std())


def errors(images: Mapping[str, Array], truth: Array) -> dict[str, dict[str, float]]:
    """The `rmse` of pictures by name against the truth, freed of noise, and its standard error, `rmse_error`."""
    found = {name: rmse(passes, truth) for name, passes in images.items()}
    return {
        "rmse": {name: value for name, (value, _) in found.items()},
        "rmse_error": {name: error for name, (_, error) in found.items()},
    }


# Drawing


def canvas(width: float, height: float) -> Any:
    """An empty matplotlib figure of so many inches. Raises MissingTool without the extra `plots`."""
    with needs("plots"):
        from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def page(width: float = 8.0, height: float = 6.0) -> Callable[[Paint], Draw]:
    """Decorator that makes the `draw` of a figure's module out of what paints numbers on a page of so many inches."""

    def drawn(paint: Paint) -> Draw:
        @wraps(paint)
        def draw(numbers: dict[str, Any], path: str | Path) -> None:
            figure = canvas(width, height)
            paint(figure, numbers)
            save(figure, path)

        return draw

    return drawn


def shades(count: int, name: str = "plasma") -> Array:
    """Colours (count, 4), from a colour map of matplotlib, of items that have an order."""
    from matplotlib import colormaps

    return np.asarray(colormaps[name](np.linspace(0, 0.9, count)))


def error_label(numbers: Mapping[str, Any], name: str) -> str:
    """The result of `errors` for a name."""
    return f"RMSE {numbers['rmse'][name]:.4f} ± {numbers['rmse_error'][name]:.4f}"


def shown(pictures: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Pictures by name as they are drawn: without their noise, where Open Image Denoise is installed."""
    calm = denoised if can_denoise() else np.asarray
    return {name: calm(picture) for name, picture in pictures.items()}


def show(axes: Any, image: ArrayLike, title: str) -> None:
    """A picture, tone-mapped, with a title."""
    axes.imshow(scenes.tone_map(image), gid=PICTURE)
    axes.set_title(title, fontsize="medium")
    axes.set_axis_off()


def show_difference(axes: Any, image: ArrayLike, truth: ArrayLike, bound: float, title: str) -> Any:
    """Draw where a picture is too bright (red) or too dark (blue); returns the mappable of a colour bar."""
    axes.set_title(title, fontsize="medium")
    axes.set_axis_off()
    difference = np.subtract(image, truth).mean(axis=-1)
    return axes.imshow(difference, cmap="RdBu_r", vmin=-bound, vmax=bound)


def save(figure: Any, path: str | Path) -> None:
    """Write a matplotlib figure whole or not at all. Raises InvalidInput where that cannot be done."""
    target = check_figure(path)
    sharp = _sharp(figure)
    options: dict[str, Any] = {"dpi": max(DPI, sharp)}
    if target.suffix.lower() == ".webp":
        dpi = options["dpi"] if sharp else min(DPI, *(PAGE / figure.get_size_inches()))
        options = {"dpi": dpi, "pil_kwargs": {"quality": QUALITY}}
    with files.whole(target) as unfinished:
        figure.savefig(unfinished, **options)


def _sharp(figure: Any) -> float:
    """Dots per inch by which every pixel of the pictures of a figure is drawn; 0 without pictures."""
    each = [(axes, image) for axes in figure.axes for image in axes.images if image.get_gid() == PICTURE]
    if not each:
        return 0.0
    figure.draw_without_rendering()  # which lays it out
    figure.set_layout_engine("none")  # once, since text is measured for seconds
    inches = figure.dpi_scale_trans.inverted()
    return max(image.get_size()[0] / axes.get_window_extent().transformed(inches).height for axes, image in each)
