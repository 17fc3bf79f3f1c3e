"""The target lobes of Bati et al. 2021, figures 10 (c) and 14 to 24, by figure, as in a target file."""

from __future__ import annotations

from typing import Any


def _lobe(
    energy: float | list[float], variance: float, interfaces: int = 1, base: str = "dielectric"
) -> dict[str, Any]:
    return {"energy": energy, "variance": variance, "interfaces": interfaces, "base": base}


_BLUE, _RED = _lobe([0.025, 0.045, 0.05], 0.028, 2), _lobe([0.052, 0.025, 0.025], 0.014, 2)
_COAT, _YELLOWISH, _BLUEISH = _lobe(0.03, 0), _lobe([0.1, 0.1, 0.06], 0.05, 2), _lobe([0.05, 0.05, 0.09], 0.01)
_METAL = [0.35, 0.25, 0.3]

FIGURES: dict[str, list[dict[str, Any]]] = {
    "10 c": [_lobe(0.15, 0.02, 2)],
    "14 a": [_lobe([0.9, 0.7, 0.5], 0.03, 1, "conductor")],
    "14 b": [_lobe([0.1, 0.2, 0.1], 0.03, 2)],
    "15 a": [_lobe(0.15, 0, 2)],
    "15 b": [_lobe([0.09, 0.09, 0.15], 0, 2)],
    "15 c": [_lobe([0.09, 0.09, 0.15], 0.03, 2)],
    "16": [_lobe(0.45, 0.03, 2, "conductor")],
    "17 blue over red": [_BLUE, _RED],
    "17 red over blue": [_RED, _BLUE],
    "18": [_lobe([0.03, 0.06, 0.09], 0.05, 2)],
    "18 a, less saturated": [_lobe([0.06, 0.06, 0.06], 0.05, 2)],
    "18 a, more saturated": [_lobe([0.01, 0.06, 0.11], 0.05, 2)],
    "18 b, smooth": [_lobe([0.03, 0.06, 0.09], 0, 2)],
    "18 b, rough": [_lobe([0.03, 0.06, 0.09], 0.15, 2)],
    "19 a": [_lobe(0.1, 0), _lobe(_METAL, 0.01, 1, "conductor")],
    "19 b": [_lobe(0.1, 0), _lobe(_METAL, 0.04, 1, "conductor")],
    "19 c": [_lobe(0.1, 0), _lobe(_METAL, 0.1, 1, "conductor")],
    "20 left": [_lobe([0.09, 0.14, 0.09], 0.005, 2), _lobe(0.09, 0.1)],
    "20 right": [_lobe(0.09, 0.005, 2), _lobe([0.09, 0.14, 0.09], 0.1)],
    "21 left": [_lobe(0.04, 0.07), _lobe([0.6, 0.25, 0.25], 0.03, 1, "conductor")],
    "21 right": [_lobe(0.04, 0.03), _lobe([0.6, 0.25, 0.25], 0.07, 1, "conductor")],
    "22 top": [_COAT, _YELLOWISH],
    "22 middle": [_COAT, _BLUEISH],
    "22 bottom": [_COAT, _BLUEISH, _YELLOWISH],
    "23": [_lobe([0.09, 0.09, 0.15], 0, 2)],
    "24": [_lobe([0.03, 0.06, 0.09], 0.05, 2)],
}
