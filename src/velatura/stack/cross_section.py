"""A material as a table and as a drawing of its layers, from the top, in the colours that they have in white light."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

from velatura.errors import short
from velatura.results import Table, printed
from velatura.stack.layers import Interface, Layer, Medium, entry_name
from velatura.stack.schema import Record, plain
from velatura.stack.spectra import MIRROR, Measured, rgb
from velatura.stack.values import RGB, Varying

if TYPE_CHECKING:
    from velatura.stack.mix import Mix
    from velatura.stack.stack import Stack

WIDE = 110  # characters of the values of a layer
WIDTH, HEIGHT, TEXT = 150, 34, 430  # of a band and of the words beside it, in pixels
CLEAR: RGB = (0.93, 0.96, 0.98)  # of what neither absorbs nor scatters
VARYING: RGB = (0.6, 0.6, 0.6)  # of what a texture gives
UNEVEN = 9.0  # pixels of a surface of alpha 1 to either side
USUAL = 0.3  # alpha that a texture gives
WAVES = ((3, 0.5, 0.3), (7, 0.3, 1.7), (13, 0.2, 4.1))  # in the width, share, phase


@dataclass(frozen=True)
class Band:
    """The space between two surfaces: its words, its colour in sRGB, and alpha of the surface above it (None: none)."""

    words: str
    colour: RGB
    alpha: float | None
    surface: str = ""


def tables(material: Stack | Mix) -> list[Table]:
    """A table of the layers of each stack of a material."""
    return [_table(_title(material, path, stack), stack) for path, stack in material.leaves()]


def text(material: Stack | Mix) -> str:
    """The tables, as text."""
    return printed(tables(material))


def svg(material: Stack | Mix) -> str:
    """The layers of each stack of a material, one below the other, as an SVG picture for a page of HTML."""
    parts, top = [], 0.0
    for path, stack in material.leaves():
        parts.append(_text(0, top + 14, _title(material, path, stack), "bold"))
        top += 22
        drawn, height = _drawn(bands(stack), top)
        parts.append(drawn)
        top += height + 10
    size = f'width="{WIDTH + TEXT}" height="{top:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img">{"".join(parts)}</svg>'


def bands(stack: Stack) -> list[Band]:
    """The spaces above, between and below the surfaces of a stack, from the top."""
    found = [Band(f"index {stack.exterior:g}", (1.0, 1.0, 1.0), None)]
    above: RGB = (stack.exterior,) * 3
    surface: tuple[float, str] | None = None  # alpha and words of one whose medium is still to come
    for layer in stack.layers:
        words = f"{entry_name(layer)}: {_values(layer)}" if _values(layer) else entry_name(layer)
        if isinstance(layer, Interface):
            if surface:
                found.append(Band("", CLEAR, *surface))
            eta, k = _colour(layer, "eta"), _colour(layer, "k")
            surface = max(_number(layer, key) for key in ("alpha_u", "alpha_v")), words
            if layer.opaque:
                metal = (0.97, 0.97, 0.97) if layer.conductor == MIRROR else _reflected(above, eta, k)
                found.append(Band("", metal, *surface))
                surface = None
            above = eta
        else:
            colour = _through(layer) if isinstance(layer, Medium) else srgb(_colour(layer, "albedo"))
            alpha, met = surface or (0.0 if layer.opaque else None, "")
            found.append(Band(words, colour, alpha, met))
            surface = None
    if surface:
        outside = stack.thin or above == (stack.exterior,) * 3
        found.append(Band("", (1.0, 1.0, 1.0) if outside else CLEAR, *surface))
    return found


def outline(alpha: float, width: float, points: int = 61) -> list[tuple[float, float]]:
    """Places and heights of an uneven surface, both in units of the width."""
    xs = [n / (points - 1) for n in range(points)]
    waves = [sum(share * math.sin(2 * math.pi * n * x + phase) for n, share, phase in WAVES) for x in xs]
    return [(x * width, alpha * wave) for x, wave in zip(xs, waves)]


def srgb(linear: RGB) -> RGB:
    """A colour for the screen."""
    bounded = (min(max(x, 0.0), 1.0) for x in linear)
    red, green, blue = (12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055 for x in bounded)
    return red, green, blue


def _title(material: Stack | Mix, path: tuple[int, ...], stack: Stack) -> str:
    if not path:
        return stack.name or "Material"
    share = dict(zip((path for path, _ in material.leaves()), _shares(material)))[path]
    return f"{' '.join(f'part{number}' for number in path)}, {share}: {stack.name or 'stack'}"


def _shares(material: Stack | Mix) -> Iterator[str]:
    weights = {address.name: value for address, value in material.values() if address.key == "weight"}
    if any(isinstance(weight, Varying) for weight in weights.values()):
        return ("by a texture" for _ in material.leaves())
    return (f"{share:.0%}" for share in material.shares(weights))


def _table(title: str, stack: Stack) -> Table:
    rows = [(str(place), layer.kind, _values(layer)) for place, layer in enumerate(stack.layers)]
    above = [] if stack.exterior == 1.0 else [("", "exterior", f"eta {stack.exterior:g}")]
    return Table(f"{title} (thin)" if stack.thin else title, ("layer", "kind", "values"), [*above, *rows])


def _values(layer: Record) -> str:
    """The values of a layer that are not those by default, in a line."""
    return short(", ".join(f"{key} {_written(value)}" for key, value in layer.to_dict().items()), WIDE)


def _written(value: Any) -> str:
    """A value in short: of a texture, a spectrum or a substance its file or name alone."""
    value = plain(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, dict) and len(value) == 1:
        return _written(*value.values())
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_written(x)}" for key, x in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_written, value)) + "]"
    return str(value)


def _number(layer: Interface, key: str) -> float:
    """A value of a layer, or a usual one where a texture gives it."""
    value = layer.flat()[key]
    return float(value) if isinstance(value, int | float) else USUAL


def _colour(layer: Layer, key: str) -> RGB:
    """A value of a layer as a colour; a grey where a texture gives it."""
    value = layer.flat().get(key, 0.0)
    if isinstance(value, Varying):
        return VARYING
    found = rgb(value) if isinstance(value, Measured) else value
    red, green, blue = found if isinstance(found, tuple) else (float(found),) * 3
    return red, green, blue


def _reflected(above: RGB, eta: RGB, k: RGB) -> RGB:
    """The reflectance of a metal along the normal."""
    pairs = zip(above, eta, k)
    red, green, blue = (((n - m) ** 2 + x**2) / ((n + m) ** 2 + x**2) for n, m, x in pairs)
    return srgb((red, green, blue))


def _through(medium: Medium) -> RGB:
    """A medium over white: what passes it twice, and what it scatters if it were deep."""
    depth = medium.flat()["depth"]
    thickness = depth if isinstance(depth, int | float) else 1.0
    colours = []
    for a, s in zip(_colour(medium, "sigma_a"), _colour(medium, "sigma_s")):
        left = math.sqrt(a / (a + s)) if a + s > 0 else 0.0
        veil = 1 - math.exp(-s * thickness)
        colours.append((1 - veil) * math.exp(-2 * a * thickness) + veil * (1 - left) / (1 + left))
    red, green, blue = (x * y for x, y in zip(srgb((colours[0], colours[1], colours[2])), CLEAR))
    return red, green, blue


def _drawn(found: list[Band], top: float) -> tuple[str, float]:
    """Bands from a height on as SVG, and how high they are."""
    parts = []
    bottom = top + HEIGHT * len(found)
    for n, band in enumerate(found):
        start = top + n * HEIGHT
        points = [(x, start - UNEVEN * y) for x, y in outline(band.alpha or 0.0, WIDTH)]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in [*points, (WIDTH, bottom), (0, bottom)])
        colour = "#" + "".join(f"{round(255 * x):02x}" for x in band.colour)
        parts.append(f'<polygon points="{path}" fill="{colour}"/>')
        if band.alpha is not None:
            line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
            parts.append(f'<polyline points="{line}" fill="none" stroke="#333"/>')
            parts.append(_text(WIDTH + 12, start + 4, band.surface))
        parts.append(_text(WIDTH + 12, start + HEIGHT / 2 + 5, band.words))
    return "".join(parts), HEIGHT * len(found)


def _text(x: float, y: float, words: str, weight: str = "normal") -> str:
    style = f'font-family="sans-serif" font-size="12" font-weight="{weight}" fill="currentColor"'
    return f'<text x="{x:g}" y="{y:g}" {style}>{escape(words)}</text>'
