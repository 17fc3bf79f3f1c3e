"""The numbers of the model `velatura`, fitted to random walks through random stacks (`benchmarks/calibrate.py`)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Calibration:
    """The constants that first-order optics leaves open. All are numbers without unit.

    Args:
        steepness_in, steepness_across: how much the roughness adds to the cosine at which light meets facets, in the
            plane of incidence and across it: cos^2 + steepness sin^2 alpha^2.
        bounced, trapped: weight of the width that light gains on the way back and forth, returned by Fresnel or by
            total internal reflection; below 1, since a median heeds the few wide paths less than a mean does.
        cone, cone_in, cone_across: width at which a lobe fills the cone that leaves, alpha at normal incidence, and how
            much wider it is at grazing angles in the plane and across it.
        entering: the same for light that enters a medium of lower index, in units of that index.
        shadowed: how much an interface above cuts off what leaves at steep angles, per alpha^2.
        selected: how much wider across the plane a lobe is that total internal reflection picks out.
        seen: share of the blur of the way out that decides about total internal reflection on it.
        again: chance of trapped light to leave, next time, over that of fresh light.
        rare: how surely trapped light is reflected by an interface to a medium of lower index.
        slant, path: longer ways through media: of trapped light, in units of depth, and of light in a rough lobe.
        lost_down, lost_up: exponents of the albedo of single reflections, for light that is lost on the way through a
            rough interface.
    """

    steepness_in: float
    steepness_across: float
    bounced: float
    trapped: float
    cone: float
    cone_in: float
    cone_across: float
    entering: float
    shadowed: float
    selected: float
    seen: float
    again: float
    rare: float
    slant: float
    path: float
    lost_down: float
    lost_up: float


#: By the reflectance of an interface: single scattering between its facets, or any number of bounces.
CALIBRATIONS: dict[str, Calibration] = {
    "fgd": Calibration(
        steepness_in=3.425,
        steepness_across=1.362,
        bounced=0.9499,
        trapped=0.0969,
        cone=0.5762,
        cone_in=5.37,
        cone_across=0.399,
        entering=5,
        shadowed=2.46,
        selected=4.249,
        seen=1.671,
        again=0.1375,
        rare=0.8545,
        slant=0.3291,
        path=0.0496,
        lost_down=1.179,
        lost_up=0.0,
    ),
    "fgd-multi": Calibration(
        steepness_in=2.604,
        steepness_across=0.9791,
        bounced=0.1096,
        trapped=0.3155,
        cone=0.6126,
        cone_in=2.663,
        cone_across=0.3633,
        entering=0.6447,
        shadowed=0.0,
        selected=4.563,
        seen=2.886,
        again=0.4211,
        rare=0.9858,
        slant=2.812,
        path=0.5195,
        lost_down=0.0,
        lost_up=0.0,
    ),
}
