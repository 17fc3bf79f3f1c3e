"""Yamaguchi et al. 2019: the figures that are pictures of brushed layers by the model, beside the truth."""

from __future__ import annotations

from typing import Any

from velatura.figures.cells import Cells, Columns
from velatura.stack import Brushing, Interface, Medium, Stack

CHOICES = {"reflectance": "fresnel", "tir": "off"}
COLUMNS: Columns = {"yamaguchi2019": ("yamaguchi2019", CHOICES)}
RADIAL, CONCENTRIC = Brushing(brushing="radial"), Brushing(brushing="concentric")
SPREAD = (0.03, 0.3)
GAPS = (90, 60, 30)  # degrees


def stack(coat: float | tuple[float, float], turn: Any, metal: float | tuple[float, float], below: Any) -> Stack:
    """Two layers, with the roughness of each and the field or angle that turns it."""
    eta, k = 1.0, (1.0, 0.0, 0.0)
    return Stack([Interface(eta=1.49, alpha=coat, rotation=turn), Interface(eta=eta, k=k, alpha=metal, rotation=below)])


_GOLD = Interface(eta=(0.143, 0.373, 1.444), k=(3.983, 2.387, 1.602), alpha=SPREAD, rotation=-45.0)
_MEDIUM = Medium(depth=0.5, sigma_a=(0.01, 1.0, 0.01), sigma_s=(0.01, 1.0, 0.01), g=0.9)
PLAIN = stack(0.1, 0.0, 0.1, 0.0)
CROSSED = stack(SPREAD, 90.0, SPREAD, 0.0)
_COAT, _METAL = CROSSED.interfaces

#: The materials of every figure.
STACKS = {
    # Two layers, each brushed in its own way, over the whole of a surface. A dielectric of index 1.49 over
    # (1 + i, 1, 1) for (a) to (d), as printed, and over the metal of its (e). Which layers are brushed, in which fields
    # and how roughly is not legible in the paper, and chosen here: (a) neither, (b) the metal, (c) the coat, (d) both,
    # across each other, (e) both, along diagonals that cross. The surface is a low dome.
    "yamaguchi2019-04": {
        "(a)": PLAIN,
        "(b)": stack(0.05, 0.0, SPREAD, CONCENTRIC),
        "(c)": stack(SPREAD, RADIAL, 0.05, 0.0),
        "(d)": stack(SPREAD, RADIAL, SPREAD, CONCENTRIC),
        "(e)": Stack([Interface(eta=1.49, alpha=SPREAD, rotation=45.0), _GOLD]),
    },
    # Three layered materials against the truth, with the RMSE of each: (a), (b) and (d) of figure 4, as chosen there,
    # on a sphere, the fields being straight: the metal is brushed along circles of latitude, the coat of (d) across
    # them, as in figure 7 at 90 degrees
    "yamaguchi2019-06": {"(a)": PLAIN, "(b)": stack(0.05, 0.0, SPREAD, 0.0), "(d)": CROSSED},
    # Two brushed layers whose directions are 90, 60 or 30 degrees apart. Indices and roughnesses are those chosen for
    # figure 4 (d), on a sphere in the studio. The metal is brushed along circles of latitude.
    "yamaguchi2019-07": {f"{gap:g}°": stack(SPREAD, float(gap), SPREAD, 0.0) for gap in GAPS},
    # Three layers, and a medium between two, over a metal. (a) is (d) of figure 4, on a sphere as in figures 6 and 7.
    # (b) has a smooth dielectric of index 1.2 above, (c) a medium between the layers with g = 0.9 and the printed
    # coefficients. Chosen are the roughnesses, brushed in straight lines, and the depth of the medium, 0.5. The medium
    # is as published: it blurs all light, scattered or not.
    "yamaguchi2019-08": {
        "(a)": CROSSED,
        "(b)": Stack([Interface(eta=1.2), _COAT, _METAL]),
        "(c)": Stack([_COAT, _MEDIUM, _METAL]),
    },
}

FIGURES = {
    name: Cells(stacks, COLUMNS, "lid" if name == "yamaguchi2019-04" else "sphere") for name, stacks in STACKS.items()
}
