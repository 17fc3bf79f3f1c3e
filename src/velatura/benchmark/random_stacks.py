"""Random layers and stacks of every sort, drawn from a generator of NumPy.

Indices lie in 1.1 to 2.2 and alpha in 0 to .55, where one in seven interfaces is smooth, unless a function says else.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from velatura.stack import RGB, Diffuse, Film, Interface, Layer, Medium, Stack

# Layers of every sort ------------------------------------------------------------------------------------------------


def roughness(rng: np.random.Generator, low: float = 0.0) -> float:
    """Smooth, evenly distributed, or evenly in its logarithm."""
    u, even, power = rng.uniform(), rng.uniform(low, 0.55), 10 ** rng.uniform(-2.3, -0.26)
    return 0.0 if u < 0.15 and not low else float(even if u < 0.7 else power)


def surface(rng: np.random.Generator, turned: str | None = None, **index: Any) -> Interface:
    """An interface; seven in ten of a brushed or turned stack have two roughnesses."""
    if turned is None:
        return Interface(alpha=roughness(rng), **index)
    alpha: Any = (roughness(rng, 0.01), roughness(rng, 0.01))
    rotation = float(rng.uniform(0, 180)) if turned == "turned" else float(rng.choice([0, 90]))
    return Interface(alpha=alpha if rng.uniform() < 0.7 else alpha[0], rotation=rotation, **index)


def coat(rng: np.random.Generator, turned: str | None = None) -> Interface:
    """A dielectric."""
    return surface(rng, turned, eta=float(rng.uniform(1.1, 2.2)))


def base(rng: np.random.Generator, turned: str | None = None) -> Interface:
    """A metal of any colour, more rarely a mirror or glass."""
    u = rng.uniform()
    if u < 0.7:
        eta, k = _metal(rng, 1.5, 5.0)
        return surface(rng, turned, eta=eta, k=k)
    return surface(rng, turned, conductor="mirror") if u < 0.85 else coat(rng, turned)


def _metal(rng: np.random.Generator, low: float, high: float) -> tuple[RGB, RGB]:
    """Index and extinction of any colour, the latter between two bounds."""
    return _colour(rng.uniform(0.2, 2.0, 3)), _colour(rng.uniform(low, high, 3))


def absorbing(rng: np.random.Generator) -> Medium:
    """A coloured medium that scatters nothing."""
    return Medium(sigma_a=_colour(rng.uniform(0, 1) * rng.uniform(0, 1, 3)))


def scattering(rng: np.random.Generator) -> Medium:
    """A medium of any asymmetry, depth and single-scattering albedo, every second one coloured."""
    depth, g = float(10 ** rng.uniform(-1, np.log10(8))), float(rng.uniform(-0.3, 0.95))
    albedo = rng.uniform(0.5, 1, 3) if rng.uniform() < 0.5 else np.full(3, rng.uniform(0.5, 1))
    return Medium(depth=depth, sigma_s=_colour(albedo), sigma_a=_colour(1 - albedo), g=g)


def _colour(values: NDArray[np.floating]) -> RGB:
    r, g, b = map(float, values)
    return r, g, b


# Stacks of every kind ------------------------------------------------------------------------------------------------


def isotropic(rng: np.random.Generator, number: int) -> Stack:
    """Up to three dielectrics over a base."""
    return coated(rng, number % 4)


def turned(rng: np.random.Generator, number: int) -> Stack:
    """The same, brushed along one of two axes or turned by any angle."""
    return coated(rng, number // 2 % 4, ("brushed", "turned")[number % 2])


def coated(rng: np.random.Generator, coats: int, way: str | None = None) -> Stack:
    """Dielectrics over a base."""
    return Stack([*(coat(rng, way) for _ in range(coats)), base(rng, way)])


def tinted(rng: np.random.Generator, number: int) -> Stack:
    """One to three dielectrics over a base, above which there is a medium that absorbs, and others anywhere."""
    layers: list[Layer] = []
    for k in reversed(range(1 + number % 3)):
        layers += [coat(rng), *([absorbing(rng)] if k == 0 or rng.uniform() < 0.5 else [])]
    return Stack([*layers, base(rng)])


def cloudy(rng: np.random.Generator, number: int) -> Stack:
    """One or two dielectrics, a medium that scatters, and a base; three in ten of two have a second medium."""
    layers: list[Layer] = [coat(rng)]
    if number % 2:
        layers += [*([scattering(rng)] if rng.uniform() < 0.3 else []), coat(rng)]
    painted = rng.uniform() < 1 / 6
    return Stack([*layers, scattering(rng), diffuse(rng) if painted else base(rng)])


def diffuse(rng: np.random.Generator) -> Diffuse:
    """A coloured base."""
    return Diffuse(albedo=_colour(rng.uniform(0.1, 0.95, 3)))


def painted(rng: np.random.Generator, number: int) -> Stack:
    """One to three dielectrics over a diffuse base, a third of them with a medium that absorbs."""
    medium = [absorbing(rng)] if rng.uniform() < 1 / 3 else []
    return Stack([*(coat(rng) for _ in range(1 + number % 3)), *medium, diffuse(rng)])


def clear(rng: np.random.Generator, number: int) -> Stack:
    """Solids and panes in turn; a quarter of them turned, a fifth with a medium that absorbs."""
    thin = bool(number % 2)
    way = "turned" if number % 8 >= 6 else None
    layers: list[Layer] = [coat(rng, way) for _ in range(max(1 + number // 2 % 4, 1 + thin))]
    if rng.uniform() < 0.2 and len(layers) > 1:
        layers.insert(1, absorbing(rng))
    return Stack(layers, thin=thin)


def milky(rng: np.random.Generator, number: int) -> Stack:
    """Solids and panes in turn, of two or three interfaces with a medium that scatters between two of them."""
    layers: list[Layer] = [coat(rng) for _ in range(2 + number // 2 % 2)]
    layers.insert(int(rng.integers(1, len(layers))), scattering(rng))
    return Stack(layers, thin=bool(number % 2))


# Stacks as people make them ------------------------------------------------------------------------------------------

ALUMINIUM: dict[str, Any] = {"eta": (1.35, 0.97, 0.62), "k": (7.47, 6.4, 5.3)}


def anodised(rng: np.random.Generator, number: int) -> Stack:
    """Aluminium with a film of oxide, which interferes, and under a thick one, which is dyed, in turns."""
    alpha, oxide = float(rng.uniform(0.05, 0.4)), float(rng.uniform(1.6, 1.77))
    if number % 2:
        layers: list[Layer] = [Interface(eta=oxide, alpha=float(rng.uniform(0.02, 0.3))), absorbing(rng)]
        return Stack([*layers, Interface(alpha=alpha, **ALUMINIUM)])
    film = Film(eta=oxide, thickness_nm=float(rng.uniform(80, 800)))
    return Stack([Interface(alpha=alpha, films=(film,), **ALUMINIUM)])


def car_paint(rng: np.random.Generator, number: int) -> Stack:
    """A clear coat over a tinted medium with metal flakes, and over pigments, in turns."""
    clear = Interface(eta=float(rng.uniform(1.45, 1.55)), alpha=float(rng.uniform(0.0, 0.05)))
    if number % 2:
        return Stack([clear, scattering(rng), diffuse(rng)])
    return Stack([clear, absorbing(rng), Interface(alpha=float(rng.uniform(0.2, 0.5)), **ALUMINIUM)])


def varnished(rng: np.random.Generator, number: int) -> Stack:
    """Wood under a varnish that yellows."""
    varnish = Interface(eta=float(rng.uniform(1.45, 1.55)), alpha=float(rng.uniform(0.02, 0.3)))
    yellow = Medium(sigma_a=_colour(rng.uniform(0, 1) * np.array([0.1, 0.3, 0.9])))
    wood = _colour(rng.uniform(0.4, 1) * np.array([0.75, 0.5, 0.3]))
    return Stack([varnish, yellow, Diffuse(albedo=wood)])


def glazed(rng: np.random.Generator, number: int) -> Stack:
    """A milky glaze on a diffuse body, and on one that passes light, in turns."""
    glaze = Interface(eta=float(rng.uniform(1.5, 1.6)), alpha=float(rng.uniform(0.0, 0.25)))
    body = Interface(eta=float(rng.uniform(1.4, 1.7)), alpha=float(rng.uniform(0.1, 0.5)))
    return Stack([glaze, scattering(rng), body if number % 2 else diffuse(rng)])


def wet_asphalt(rng: np.random.Generator, number: int) -> Stack:
    """Bitumen under water."""
    water = Interface(eta=1.33, alpha=float(rng.uniform(0.0, 0.15)))
    bitumen = Interface(eta=float(rng.uniform(1.5, 1.65)), alpha=float(rng.uniform(0.2, 0.5)))
    return Stack([water, bitumen, Diffuse(albedo=float(rng.uniform(0.02, 0.1)))])


def many_coats(rng: np.random.Generator, number: int) -> Stack:
    """Four to six dielectrics over a base."""
    return coated(rng, 4 + number % 3)


def very_smooth(rng: np.random.Generator, number: int) -> Stack:
    """Two coats over a metal, solids of two interfaces, and panes in turn, of alpha .005 to .03."""
    first, second = (
        Interface(eta=float(rng.uniform(1.3, 1.7)), alpha=float(rng.uniform(0.005, 0.03))) for _ in range(2)
    )
    if number % 3 == 2:
        return Stack([first, Interface(eta=1.0, alpha=second.alpha)], thin=True)
    eta, k = _metal(rng, 1.5, 5.0)
    metal = [] if number % 3 else [Interface(eta=eta, k=k, alpha=float(rng.uniform(0.005, 0.03)))]
    return Stack([first, second, *metal])


def large_steps(rng: np.random.Generator, number: int) -> Stack:
    """A dense coat over metal, every second one below a coat of an index about 1.5."""
    dense = Interface(eta=float(rng.uniform(2.4, 3.5)), alpha=float(rng.uniform(0.02, 0.5)))
    coats = [Interface(eta=float(rng.uniform(1.4, 1.6)), alpha=float(rng.uniform(0.02, 0.5)))] if number % 2 else []
    eta, k = _metal(rng, 1.5, 5.0)
    return Stack([*coats, dense, Interface(eta=eta, k=k, alpha=float(rng.uniform(0.02, 0.5)))])


def dark(rng: np.random.Generator, number: int) -> Stack:
    """A coat over a medium that absorbs most, and below that a dark base, or another dielectric, in turns."""
    outer = Interface(eta=float(rng.uniform(1.3, 1.7)), alpha=float(rng.uniform(0.02, 0.5)))
    black = Diffuse(albedo=_colour(rng.uniform(0.02, 0.2, 3)))
    return Stack([outer, Medium(sigma_a=_colour(rng.uniform(0.3, 1.5, 3))), coat(rng) if number % 2 else black])


# Those where the model is weakest


def lacquered(rng: np.random.Generator, number: int) -> Stack:
    """Brushed metal, three to twelve times as rough across the brushing, under one lacquer, smooth in every second."""
    long, ratio = float(rng.uniform(0.15, 0.4)), float(rng.uniform(3, 12))
    lacquer = Interface(eta=float(rng.uniform(1.4, 1.6)), alpha=float(rng.uniform(0.02, 0.2)) if number % 2 else 0.0)
    return Stack([lacquer, _brushed(rng, (long, long / ratio), float(rng.uniform(0, 180)))])


def crossed(rng: np.random.Generator, number: int) -> Stack:
    """Two or three brushed layers, the lowest of metal, each at an angle to the one above."""
    layers: list[Layer] = []
    angle = float(rng.uniform(0, 180))
    for k in range(2 + number % 2):
        long, ratio = float(rng.uniform(0.15, 0.4)), float(rng.uniform(3, 10))
        last = k == 1 + number % 2
        alpha, angle = (long, long / ratio), (angle + float(rng.uniform(45, 135))) % 180
        eta = float(rng.uniform(1.3, 1.7))
        layers.append(_brushed(rng, alpha, angle) if last else Interface(eta=eta, alpha=alpha, rotation=angle))
    return Stack(layers)


def frosted(rng: np.random.Generator, number: int) -> Stack:
    """Panes of glass with two rough faces; every third absorbs."""
    faces = [Interface(eta=float(n), alpha=float(rng.uniform(0.2, 0.6))) for n in (rng.uniform(1.45, 1.6), 1.0)]
    between = [absorbing(rng)] if number % 3 == 2 else []
    return Stack([faces[0], *between, faces[1]], thin=True)


def etched(rng: np.random.Generator, number: int) -> Stack:
    """Panes of glass with a rough face and a polished one, in turn above."""
    rough, eta = float(rng.uniform(0.15, 0.6)), float(rng.uniform(1.45, 1.6))
    above, below = (rough, 0.0) if number % 2 == 0 else (0.0, rough)
    return Stack([Interface(eta=eta, alpha=above), Interface(eta=1.0, alpha=below)], thin=True)


def very_rough(rng: np.random.Generator, number: int) -> Stack:
    """Two very rough interfaces: solids and panes in turn."""
    alphas = rng.uniform(0.6, 1.0, 2)
    indices = rng.uniform(1.3, 1.7), 1.0 if number % 2 else rng.uniform(1.3, 1.7)
    return Stack([Interface(eta=float(n), alpha=float(a)) for n, a in zip(indices, alphas)], thin=bool(number % 2))


def _brushed(rng: np.random.Generator, alpha: tuple[float, float], rotation: float) -> Interface:
    eta, k = _metal(rng, 3.0, 7.0)
    return Interface(eta=eta, k=k, alpha=alpha, rotation=rotation)
