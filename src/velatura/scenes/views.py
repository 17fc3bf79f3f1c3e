"""View transforms: linear light as a screen shows it.

Each takes red, green and blue of linear light, of Rec. 709 primaries, and returns the values from 0 to 1 that an sRGB
screen is given. They are written on `velatura.ops`, since the page of the editor prints them as its shader.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

from velatura import ops
from velatura.ops import Value

Colour: TypeAlias = tuple[Value, Value, Value]
Rows: TypeAlias = Sequence[Sequence[float]]

KNEE = 0.7  # from which on highlights are compressed


def srgb(light: Colour) -> Colour:
    """The light as it is, cut off at white."""
    return _each(srgb_curve, light)


def srgb_curve(x: Value) -> Value:
    """A display value of a linear one, which is kept within 0 and 1 (IEC 61966-2-1)."""
    x = ops.clip(x, 0.0, 1.0)
    return ops.select(x > 0.0031308, 1.055 * ops.power(ops.maximum(x, 0.0031308), 1 / 2.4) - 0.055, 12.92 * x)


def soft(light: Colour) -> Colour:
    """The light as it is up to `KNEE`; above, it approaches white without ever reaching it."""
    room = 1 - KNEE

    def bent(x: Value) -> Value:
        above = ops.maximum(x - KNEE, 0.0)
        return ops.minimum(x, KNEE) + room * (1 - ops.exp(-above / room))

    return srgb(_each(bent, light))


def agx(light: Colour) -> Colour:
    """AgX, as Filament and three.js (r187, `AgXToneMapping`) have it after Blender's: primaries of Rec. 2020, inset,
    and the default contrast of Wrensch, "Minimal AgX implementation" (2023), as a polynomial."""
    # Log2 of inset primaries, from 10 stops below mid-grey to 6.5 above it
    low, high = math.log2(0.18) - 10, math.log2(0.18) + 6.5
    inset = _times(_AGX_INSET, _times(_TO_2020, light))
    stops = _each(lambda x: ops.log(ops.maximum(x, 1e-10)) / math.log(2), inset)
    place = _each(lambda x: ops.clip((x - low) / (high - low), 0.0, 1.0), stops)

    # Contrast, and back; display values have an exponent of 2.2
    outset = _times(_AGX_OUTSET, _each(_agx_contrast, place))
    return srgb(_times(_FROM_2020, _each(lambda x: ops.power(ops.maximum(x, 0.0), 2.2), outset)))


def _agx_contrast(x: Value) -> Value:
    y: Value = 0.0
    for factor in (15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232):
        y = y * x + factor
    return y


def aces(light: Colour) -> Colour:
    """ACES 1.0 for video, by the formulas of OpenColorIO 2.6 (`transforms/builtins/ACES.cpp` and
    `ops/fixedfunction/FixedFunctionOpCPU.cpp`), whose names are those of the parts: SDR-VIDEO_1.0, then sRGB."""
    scene = _each(_positive, _red_modified(_glowing(_times(_TO_AP0, light))))
    working = _times(_ACES_SATURATION, _each(_positive, _times(_AP0_TO_AP1, scene)))

    # Both tone curves, in log10 of luminance; the screen is cinema's, of .02 to 48 nits
    shown = _each(lambda x: _ACES_ODT.at(_ACES_RRT.at(ops.log(ops.maximum(x, 1e-10)) / math.log(10))), working)
    screen = _each(lambda y: (ops.power(10.0, y) - 0.02) / (48 - 0.02), shown)

    # A dim surround in place of a dark one
    luminance = sum(share * x for share, x in zip((0.27222872, 0.67408177, 0.05368952), screen))
    lift = ops.power(ops.maximum(luminance, 1e-10), 0.9811 - 1)
    return srgb(_times(_AP1_TO_709, _each(lambda x: lift * x, screen)))


def _glowing(light: Colour) -> Colour:
    """Dark saturated colours brightened: ACES_GLOW_10."""
    r, g, b = light
    chroma = ops.sqrt(b * (b - g) + g * (g - r) + r * (r - b))
    luminance = (b + g + r + 1.75 * chroma) / 3
    x = 5 * (_saturation(light) - 0.4)
    rest = _positive(1 - 0.5 * ops.absolute(x))
    gain = 0.05 * 0.5 * (1 + ops.select(x < 0.0, -1.0, 1.0) * (1 - rest * rest))
    middle = 0.08
    fading = ops.clip(ops.divide(middle, luminance) - 0.5, 0.0, 1.0)
    return _each(lambda x: x * (1 + gain * fading), light)


def _red_modified(light: Colour) -> Colour:
    """Saturated reds darkened, within 67.5 degrees of hue: ACES_RED_MOD_10."""
    r, g, b = light
    # A grey has no hue
    hue = ops.arctan2(math.sqrt(3) * ops.absolute(g - b), 2 * r - (g + b) + 1e-30)
    away = hue * 4 / math.radians(135)
    near, nearer = _positive(2 - away), _positive(1 - away)
    weight = 0.25 * near * near * near - nearer * nearer * nearer
    return r + weight * _saturation(light) * (0.03 - r) * (1 - 0.82), g, b


def _saturation(light: Colour) -> Value:
    r, g, b = light
    most, least = ops.maximum(r, ops.maximum(g, b)), ops.minimum(r, ops.minimum(g, b))
    return (ops.maximum(most, 1e-10) - ops.maximum(least, 1e-10)) / ops.maximum(most, 1e-2)


class Spline(NamedTuple):
    """A quadratic spline that is level before its first knot and straight after its last; `bends` are the second
    derivatives, halved, from each knot on."""

    start: float
    knots: Sequence[float]
    bends: Sequence[float]

    def at(self, x: Value) -> Value:
        """Its value: each knot adds the change of bend there, times the squared distance beyond it."""
        y: Value = self.start
        before = 0.0
        for knot, bend in zip(self.knots, self.bends):
            beyond = ops.maximum(x - knot, 0.0)
            y, before = y + (bend - before) * beyond * beyond, bend
        return y


def _positive(x: Value) -> Value:
    return ops.maximum(x, 0.0)


def _each(function: Callable[[Value], Value], light: Colour) -> Colour:
    r, g, b = light
    return function(r), function(g), function(b)


def _times(rows: Rows, light: Colour) -> Colour:
    r, g, b = (sum(factor * x for factor, x in zip(row, light)) for row in rows)
    return r, g, b


# Rec. 709 and Rec. 2020, and the primaries of AgX; four digits as three.js has them
_TO_2020 = ((0.6274, 0.3293, 0.0433), (0.0691, 0.9195, 0.0113), (0.0164, 0.0880, 0.8956))
_FROM_2020 = ((1.6605, -0.5876, -0.0728), (-0.1246, 1.1329, -0.0083), (-0.0182, -0.1006, 1.1187))
_AGX_INSET = (
    (0.856627153, 0.0951212405, 0.0482516061),
    (0.137318973, 0.761241991, 0.101439036),
    (0.111898213, 0.0767994186, 0.811302368),
)
_AGX_OUTSET = (
    (1.12710058, -0.110606643, -0.0164939387),
    (-0.141329763, 1.15782370, -0.0164939387),
    (-0.141329763, -0.110606643, 1.25193641),
)

# Rec. 709 to ACES2065-1 by Bradford's adaptation, that to ACEScg, its saturation of .96, and ACEScg, of a saturation of
# .93, to Rec. 709
_TO_AP0 = (
    (0.439632982, 0.382988698, 0.177378320),
    (0.0897764430, 0.813439429, 0.0967841283),
    (0.0175411704, 0.111546553, 0.870912276),
)
_AP0_TO_AP1 = (
    (1.45143932, -0.236510747, -0.214928569),
    (-0.0765537734, 1.17622970, -0.0996759264),
    (0.00831614843, -0.00603244979, 0.997716301),
)
_ACES_SATURATION = (
    (0.970889149, 0.0269632706, 0.00214758070),
    (0.0108891487, 0.986963271, 0.00214758070),
    (0.0108891487, 0.0269632706, 0.962147581),
)
_AP1_TO_709 = (
    (1.60475343, -0.531080949, -0.0736724847),
    (-0.102082458, 1.10813413, -0.00605167051),
    (-0.00326711165, -0.0727554241, 1.07602254),
)

# The tone curves of ACES 1.0, of the rendering and of the screen
_ACES_RRT = Spline(
    -4.0,
    (-5.26017743, -3.75502745, -2.24987747, -0.744727492, 1.06145251, 1.96573484, 2.86763239, 3.77526045, 4.67381239),
    (
        *(0.185970441, 0.403778881, -0.0748505071, -0.185833707, -0.192129433),
        *(-0.19314684, -0.0501050949, -0.0511224195, 0.0),
    ),
)
_ACES_ODT = Spline(
    -1.69897,
    (
        *(-2.54062366, -2.08035731, -1.62009084, -1.15982437, -0.69955802, -0.239291579, 0.220974833, 0.681241214),
        *(1.01284635, 1.34445143, 1.6760565, 2.00766158, 2.33926654, 2.67087173, 3.00247669),
    ),
    (
        *(0.521772683, 0.0654487088, 0.272604734, 0.123911291, 0.0858645961, -0.0171162505, 0.0338416733),
        *(-0.194834962, -0.201688975, -0.476983279, -0.276004612, -0.139139131, -0.0922630876, -0.0665909499, 0.0),
    ),
)

#: View transforms by name.
VIEWS: dict[str, Callable[[Colour], Colour]] = {"soft": soft, "srgb": srgb, "agx": agx, "aces": aces}
DEFAULT_VIEW = "soft"
