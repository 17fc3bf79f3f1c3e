"""Weier & Belcour 2020: the figures that are pictures of layers by the model, beside the truth."""

from __future__ import annotations

from pathlib import Path

from velatura.figures import canvas, maps
from velatura.figures.cells import TEASER, Cells, Columns
from velatura.stack import Interface, Stack

CHOICES = {"reflectance": "fresnel", "tir": "off"}
COLUMNS: Columns = {"weier2020": ("weier2020", CHOICES)}
ALPHAS = ((0.01, 0.01), (0.01, 0.1), (0.1, 0.1), (0.1, 0.3), (0.3, 0.3), (0.05, 0.5))


def stack(coat: tuple[float, float], metal: tuple[float, float]) -> Stack:
    """A dielectric over a metal, of these roughnesses."""
    return Stack([Interface(eta=1.5, alpha=coat), Interface(eta=0.001, k=1.0, alpha=metal)])


METALS = {f"metal {u:g}, {v:g}": stack((0.05, 0.05), (u, v)) for u, v in ALPHAS}


def by_map(*names: str) -> Columns:
    """Columns of the model, which differ in the map alone."""
    return {name: ("weier2020", CHOICES | {"map": name}) for name in names}


def brushed_in_waves(folder: Path) -> dict[str, Stack]:
    """The material of figure 12, its textures in a folder."""
    prints = canvas.texture(folder / "prints.exr", 0.03 + 0.27 * maps.fingerprints())
    across = canvas.texture(folder / "across.exr", 0.1 + 0.3 * maps.wear())
    strokes = canvas.texture(folder / "strokes.exr", maps.strokes())
    metal = Interface(conductor="Al", alpha=(0.05, across), rotation=strokes)
    return {"brushed in waves": Stack([Interface(eta=1.5, alpha=prints), metal])}


FIGURES = {
    # The teaser, anisotropic interfaces on an object with fine detail. Its scene and materials are not printed: here a
    # carved urn stands for it, brushed around its axis: a smooth coat over brushed copper, a brushed coat over silver
    "weier2020-01": Cells(
        {
            "brushed copper": Stack([Interface(eta=1.5, alpha=0.02), Interface(conductor="Cu", alpha=(0.05, 0.3))]),
            "brushed coat": Stack([Interface(eta=1.5, alpha=(0.02, 0.2)), Interface(conductor="Ag", alpha=0.05)]),
        },
        COLUMNS,
        "urn",
        exposure=0.7,
        quality=TEASER,
    ),
    # Their roughness map against that of Belcour 2018, on a rough coat over a metal. Index 1.5 over one of 0 + i, both
    # of alpha 0.1, as printed; an index of 0 is 0.001 here. The scene is not printed: a sphere in the studio.
    "weier2020-08": Cells({"alpha 0.1": stack((0.1, 0.1), (0.1, 0.1))}, by_map("belcour", "weier"), exposure=0.4),
    # The map that treats each axis by itself, and the fit over both axes at once. The material is not printed: here it
    # is that of figure 10 with a metal of roughness 0.05 along the sphere's circles of latitude and 0.4 across them.
    "weier2020-09": Cells(
        {"metal 0.05, 0.4": stack((0.05, 0.05), (0.05, 0.4))}, by_map("weier-2d", "weier"), exposure=0.4
    ),
    # A smooth coat over metals of many roughnesses, isotropic and brushed. The coat has index 1.5 and alpha 0.05, the
    # metal 0 + i, as printed. The roughnesses of the metal are not legible in the paper and chosen here, as are the
    # sphere, brushed around its axis, and the studio.
    "weier2020-10": Cells(METALS, COLUMNS, exposure=0.4),
    # Coats of many roughnesses, isotropic and anisotropic, over a smooth metal. Indices are those of figure 10, the
    # metal's alpha is 0.05, as printed; the coats' roughnesses are chosen here.
    "weier2020-11": Cells(
        {f"coat {u:g}, {v:g}": stack((u, v), (0.05, 0.05)) for u, v in ALPHAS}, COLUMNS, exposure=0.4
    ),
    # A textured asset, which the paper renders in a real-time engine. It is not printed: here it is a carved urn, its
    # coat with fingerprints (index 1.5, alpha from 0.03 to 0.3) over aluminium that is brushed in waves (alpha 0.05
    # along the strokes, and 0.1 to 0.4 across them, as it is worn). It is rendered offline; `benchmarks/engines.py`
    # counts what the model costs in real time.
    "weier2020-12": Cells(brushed_in_waves, COLUMNS, "urn", exposure=0.7, quality=TEASER),
    # Failure at grazing angles, a brushed metal below a coat: roughnesses (0.05, 0.05) over (0.1, 0), as printed; the
    # indices are those of figure 10, the sphere is chosen here
    "weier2020-13": Cells({"brushed": stack((0.05, 0.05), (0.1, 0.0))}, COLUMNS, exposure=0.4),
}
