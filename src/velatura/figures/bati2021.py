"""Bati et al. 2021: the figures that are pictures of inverted stacks, and their lobes over the angle, alone."""

from __future__ import annotations

from velatura.figures import bati2021_14, bati2021_16
from velatura.figures.looks import MODEL, Looks, Panel, inverted
from velatura.inverse import invert_stack, smooth_pair
from velatura.stack import RGB, Diffuse, Interface, Stack

GALLERY = {"18": "a", "18 b, rough": "a, rough", "19 a": "d", "19 c": "d, more haze"}
ENERGY, VARIANCE = 0.15, 0.02  # of figure 10
INDICES = {"clear": (1.2, None), "absorbing": (1.2, 4.0)}  # eta 1 and 2; None: that which needs no absorption
ALBEDOS: dict[str, float | RGB] = {"black": 0.0, "grey": 0.5, "orange": (0.5, 0.3, 0.1)}


def gallery() -> dict[str, Stack]:
    """Stacks of figure 1 by name."""
    found = {GALLERY[name]: stack for name, stack in inverted(tuple(GALLERY)).items()}
    metals, coats = bati2021_16.stacks(), bati2021_14.stacks()
    found |= {"b": metals["reference"], "b, pink edge": metals["c"]}
    found |= {"c": coats["14 b, bare"], "c, coated": coats["14 b, kept"]}
    return dict(sorted(found.items()))


def alike() -> dict[str, Stack]:
    """Stacks of figure 10 by name, in pairs."""
    points = smooth_pair.points(1.0, ENERGY)
    (one, _), (slab, _) = points["matched below"], points["slab"]
    found = {
        "a one interface": Stack([Interface(eta=one[1])]),
        "a slab": Stack([Interface(eta=slab[0]), Interface(eta=slab[1])]),
    }
    for part, variance in (("b", 0.0), ("c", VARIANCE)):
        for name, indices in INDICES.items():
            lobe = {"energy": ENERGY, "variance": variance, "interfaces": 2, "fixed": {"eta": list(indices)}}
            found[f"{part} {name}"] = invert_stack([lobe], MODEL).stack
    return found


def on_bases() -> dict[str, Stack]:
    """Stacks of figure 24 by the colour of the base."""
    (pair,) = inverted(("24",)).values()
    return {name: Stack([*pair.layers, Diffuse(albedo=albedo)]) for name, albedo in ALBEDOS.items()}


FIGURES = {
    # A gallery of materials found from given lobes: (a) colour and sharpness of a pair of dielectrics; (b) the edge of
    # a coated conductor; (c) a coat on a pair that keeps its appearance; (d) extent and colour of haze. The object, its
    # light, and the choice of materials are ours.
    "bati2021-01": Looks(
        gallery,
        [
            Panel("(a) sharpness", ("a", "a, rough"), ("initial", "rough")),
            Panel("(b) edge", ("b", "b, pink edge"), ("grey edge", "pink edge")),
            Panel("(c) coat", ("c", "c, coated"), ("bare", "coated")),
            Panel("(d) haze", ("d", "d, more haze"), ("subtle", "strong")),
        ],
        {"scene": "ball"},
    ),
    # Two stacks each that reflect 0.15 head-on, and differ at grazing angles: (a) one smooth interface, and a slab,
    # whose lower interface is in air; (b) a smooth pair without and with absorption; (c) the same of variance 0.02.
    # (d) Below, the energies and variances of the interfaces. The indices of (b) and (c) are chosen here.
    "bati2021-10": Looks(
        alike,
        [
            Panel("(a) clear", ("a one interface", "a slab"), ("one interface", "slab")),
            Panel("(b) smooth pairs", ("b clear", "b absorbing"), tuple(INDICES)),
            Panel("(c) rough pairs", ("c clear", "c absorbing"), tuple(INDICES)),
        ],
        detail=True,
    ),
    # One lobe of a pair of dielectrics, (a) less and more saturated, (b) smooth and rough
    "bati2021-18": Looks.of(
        {
            "18 a, less saturated": "(a) less saturated",
            "18": "initial",
            "18 a, more saturated": "(a) more saturated",
            "18 b, smooth": "(b) smooth",
            "18 b, rough": "(b) rough",
        }
    ),
    # Haze, as the variance of a conductor under a smooth coat grows from (a) to (c). With plain Fresnel the conductor
    # keeps its indices, as the paper says; with directional albedos they change a little.
    "bati2021-19": Looks.of(
        {"19 a": "(a) subtle haze", "19 b": "(b) initial haze", "19 c": "(c) strong haze"}, reflectance="fresnel"
    ),
    # The colour of haze: of two lobes the upper one is green, or the lower one. With what each lobe contributes
    "bati2021-20": Looks.apart({"20 left": "green highlight", "20 right": "green haze"}),
    # The profile of haze: the upper lobe is the blurred one (left), or the lower one (right). With what each lobe
    # contributes. With plain Fresnel: by directional albedos there is no stack for the left one, as 3e-5 of variance
    # are missing.
    "bati2021-21": Looks.apart(
        {"21 left": "upper lobe blurred", "21 right": "lower lobe blurred"}, reflectance="fresnel"
    ),
    # A smooth coat over a yellowish lobe (top), over a blueish one (middle), over both
    "bati2021-22": Looks.of(
        {
            "22 top": "coat over yellowish",
            "22 middle": "coat over blueish",
            "22 bottom": "coat over blueish over yellowish",
        }
    ),
    # A pair of dielectrics on a diffuse base: black, grey, orange
    "bati2021-24": Looks(on_bases, [Panel(f"({part}) {name} base", (name,)) for part, name in zip("abc", ALBEDOS)]),
}
