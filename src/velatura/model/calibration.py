"""The numbers of the model `velatura`, fitted to random walks through random stacks (`benchmarks/calibrate.py`)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Calibration:
    """What first-order optics leaves open. All are numbers without unit.

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
        steepness_in=4.5,
        steepness_across=1.83,
        bounced=0.9,
        trapped=0.14,
        cone=0.557,
        cone_in=14.0,
        cone_across=0.48,
        entering=0.26,
        shadowed=1.45,
        selected=1.48,
        seen=2.7,
        again=0.48,
        rare=0.86,
        slant=12.0,
        path=0.5,
        lost_down=0.17,
        lost_up=0.8,
    ),
    "fgd-multi": Calibration(
        steepness_in=3.17,
        steepness_across=1.22,
        bounced=0.7,
        trapped=0.26,
        cone=0.62,
        cone_in=4.8,
        cone_across=0.36,
        entering=5.0,
        shadowed=0.0,
        selected=1.89,
        seen=2.74,
        again=0.48,
        rare=0.86,
        slant=14.7,
        path=0.5,
        lost_down=0.0,
        lost_up=0.0,
    ),
}
