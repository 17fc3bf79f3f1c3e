"""Materials of other programs as stacks: which files of a folder are read, what is left of them, and whether laws hold.

Without a folder: how far stacks are from the formulas of the programs that their parameters come from, lobe by lobe.
Those of OpenPBR and glTF are ours, which agree with generated code (`benchmarks/materialx.py`); those of Standard
Surface are the code that MaterialX generates, its departures undone, in Chromium; those of `principled` are Mitsuba's.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from rows import parser

import velatura as vt
from velatura import imports, kernel
from velatura.optics import ggx
from velatura.programs.closures import ViewAndLight
from velatura.programs.gltf import read as gltf
from velatura.programs.openpbr import read as openpbr
from velatura.programs.principled import read as principled
from velatura.programs.standard_surface import read as standard_surface
from velatura.renderer.low_discrepancy import square

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

Values = Mapping[str, Any]
BLACK = (0.0, 0.0, 0.0)
COPPER, EDGE, PAINT = (0.926, 0.721, 0.504), (0.996, 0.957, 0.823), (0.6, 0.2, 0.1)
COSINES = (1.0, 0.5)
LEAST = 1e-3  # alpha of lobes that are evaluated
LOBES = ("coat", "base", "diffuse", "darkening")
Lobes = dict[str, tuple[float, float | None]]


@dataclass(frozen=True)
class Source:
    """Where parameters come from: their reader, and the formulas that they have there.

    light: f |cos theta_o| (3, N) for each of several materials and directions wi, wo. alphas: roughness of the base,
    and of the coat. samples: directions of each of three densities. coat, metal: names of weights. without: changes
    that leave no diffuse base, and only the coat.
    """

    reader: ModuleType
    light: Callable[[Sequence[Values], Any, Any], Sequence[Any]]
    alphas: Callable[[Values], tuple[float, float]]
    samples: int
    coat: str
    metal: str
    without: tuple[Values, Values]
    materials: Mapping[str, Values]


def main() -> None:
    program = parser(__doc__, no_check=(False, "read them only"))
    program.add_argument("folder", type=Path, nargs="?", help="of files to import, with those in folders below it")
    arguments = program.parse_args()
    if arguments.folder:
        files(arguments.folder, not arguments.no_check)
    else:
        differences()
    print(f"\n{time.process_time():.0f} s of processor time")


# Files ---------------------------------------------------------------------------------------------------------------


def files(folder: Path, checked: bool) -> None:
    counts = {"read": 0, "refused": 0, "broken": 0}
    print("| file | material | layers | left | laws |\n|---|---|---|---|---|")
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in imports.FORMATS:
            for row in rows(path, counts, checked):
                print(f"| {path.name} | {' | '.join(row)} |", flush=True)
    print("\n" + ", ".join(f"{count} {kind}" for kind, count in counts.items()))


def rows(path: Path, counts: dict[str, int], checked: bool) -> list[tuple[str, str, str, str]]:
    try:
        readers: Mapping[str, Callable[..., Any]]
        readers, _ = import_module(imports.FORMATS[path.suffix.lower()]).materials(path)
    except vt.InvalidInput as error:
        counts["refused"] += 1
        return [("", f"refused: {error}", "", "")]
    found = []
    for name in readers:
        try:
            made = imports.read(path, name)
        except vt.InvalidInput as error:
            counts["refused"] += 1
            found.append((name, f"refused: {error}", "", ""))
            continue
        counts["read"] += 1
        laws = ""
        if checked:
            report = vt.check(made.stack)
            laws = "kept" if report.passed else ", ".join(report.broken)
            counts["broken"] += not report.passed
        stacks = [", ".join(each.kinds) + (", thin" if each.thin else "") for _, each in made.stack.leaves()]
        found.append((name, "; ".join(stacks), ", ".join(each.parameter for each in made.left), laws))
    return found


# Sources -------------------------------------------------------------------------------------------------------------


def by_formulas(module: str) -> Callable[[Sequence[Values], Any, Any], Sequence[Any]]:
    value = import_module(f"velatura.programs.{module}.formulas").value
    return lambda materials, wi, wo: [value(each, ViewAndLight(wi, wo)) for each in materials]


def by_generated_code(materials: Sequence[Values], wi: Any, wo: Any) -> Sequence[Any]:
    import chromium
    from generated_surfaces import CHANNELS, HALVES, MASKING, Surface, values

    named = {str(number): each for number, each in enumerate(materials)}
    with chromium.browser() as browser:
        surface = Surface("standard_surface", standard_surface, {}, (MASKING, HALVES, CHANNELS), named)
        return list(values(browser, surface, wi, wo, surface.choices))


def by_plugin(materials: Sequence[Values], wi: Any, wo: Any) -> Sequence[Any]:
    mi = kernel.mitsuba()
    import drjit as dr

    def value(given: Values) -> Any:
        described = {
            name: {"type": "rgb", "value": list(x)} if isinstance(x, tuple) else x for name, x in given.items()
        }
        bsdf, surface = kernel.load_dict({"type": "principled", **described}), dr.zeros(mi.SurfaceInteraction3f)
        surface.wi = mi.Vector3f(wi)
        return np.array(bsdf.eval(mi.BSDFContext(), surface, mi.Vector3f(wo)))

    return [value(each) for each in materials]


def of_openpbr(given: Values) -> tuple[float, float]:
    """The roughness with what the coat adds (OpenPBR 1.1, "Roughening")."""
    base, coat = given.get("specular_roughness", 0.3), given.get("coat_roughness", 0.0)
    weight = given.get("coat_weight", 0.0)
    rough = (1 - weight) * base + weight * min(base**4 + 2 * coat**4, 1) ** 0.25
    return rough**2, coat**2


def coats(
    metal: Values, paint: Values, coat: Values, rough: Values, half: Values, film: Values | None = None
) -> dict[str, Values]:
    """The materials that all sources have."""
    found = {
        "copper": metal,
        "copper, smooth coat": {**metal, **coat},
        "copper, rough coat": {**metal, **coat, **rough},
        "paint": paint,
        "paint, coat": {**paint, **coat},
        "paint, rough coat": {**paint, **coat, **rough},
        "paint, half a coat": {**paint, **coat, **half},
    }
    if film:
        found |= {"copper, film of 300 nm": {**metal, **film}, "paint, film of 300 nm": {**paint, **film}}
    return found


OPENPBR_COPPER = {"base_metalness": 1.0, "base_color": COPPER, "specular_color": EDGE}
OPENPBR_PAINT = {"base_color": PAINT, "specular_roughness": 0.4}
OPENPBR_COAT, OPENPBR_FILM = {"coat_weight": 1.0}, {"thin_film_weight": 1.0, "thin_film_thickness": 0.3}
GLTF_FILM = {"iridescenceFactor": 1.0, "iridescenceThicknessMaximum": 300.0}
SOURCES: dict[str, Source] = {
    "OpenPBR": Source(
        openpbr,
        by_formulas("openpbr"),
        of_openpbr,
        2**15,
        "coat_weight",
        "base_metalness",
        ({"base_weight": 0.0}, {"base_weight": 0.0, "specular_weight": 0.0, "thin_film_weight": 0.0}),
        {
            **coats(
                OPENPBR_COPPER, OPENPBR_PAINT, OPENPBR_COAT, {"coat_roughness": 0.5}, {"coat_weight": 0.5}, OPENPBR_FILM
            ),
            "copper, film, smooth coat": {**OPENPBR_COPPER, **OPENPBR_FILM, **OPENPBR_COAT},
            "paint, coat of equal index": {**OPENPBR_PAINT, **OPENPBR_COAT, "coat_ior": 1.5},
            "paint, coat, no darkening": {**OPENPBR_PAINT, **OPENPBR_COAT, "coat_darkening": 0.0},
            "paint, tinted rough coat": {
                **OPENPBR_PAINT,
                **OPENPBR_COAT,
                "coat_color": (0.9, 0.7, 0.4),
                "coat_roughness": 0.4,
            },
        },
    ),
    "Standard Surface": Source(
        standard_surface,
        by_generated_code,
        lambda given: (given.get("specular_roughness", 0.2) ** 2, given.get("coat_roughness", 0.1) ** 2),
        2**11,
        "coat",
        "metalness",
        ({"base": 0.0}, {"base": 0.0, "specular": 0.0, "metalness": 0.0, "thin_film_thickness": 0.0}),
        {
            **coats(
                {"metalness": 1.0, "base_color": COPPER, "specular_color": EDGE, "specular_roughness": 0.3},
                {"base_color": PAINT, "specular_roughness": 0.4},
                {"coat": 1.0},
                {"coat_roughness": 0.5},
                {"coat": 0.5},
                {"thin_film_thickness": 300.0, "thin_film_IOR": 1.4},
            ),
            "paint, tinted rough coat": {
                "base_color": PAINT,
                "specular_roughness": 0.4,
                "coat": 1.0,
                "coat_color": (0.9, 0.7, 0.4),
                "coat_roughness": 0.4,
            },
        },
    ),
    "glTF": Source(
        gltf,
        by_formulas("gltf"),
        lambda given: (given["roughnessFactor"] ** 2, given.get("clearcoatRoughnessFactor", 0.0) ** 2),
        2**15,
        "clearcoatFactor",
        "metallicFactor",
        (
            {"baseColorFactor": BLACK},
            {"baseColorFactor": BLACK, "metallicFactor": 0.0, "specularFactor": 0.0, "iridescenceFactor": 0.0},
        ),
        coats(
            {"metallicFactor": 1.0, "baseColorFactor": COPPER, "roughnessFactor": 0.3},
            {"metallicFactor": 0.0, "baseColorFactor": PAINT, "roughnessFactor": 0.4},
            {"clearcoatFactor": 1.0},
            {"clearcoatRoughnessFactor": 0.5},
            {"clearcoatFactor": 0.5},
            GLTF_FILM,
        ),
    ),
    "Mitsuba's principled": Source(
        principled,
        by_plugin,
        lambda given: (given["roughness"] ** 2, 0.1 + given.get("clearcoat_gloss", 0.0) * (0.001 - 0.1)),
        2**15,
        "clearcoat",
        "metallic",
        ({"base_color": BLACK}, {"base_color": BLACK, "metallic": 0.0, "eta": 1.0}),
        coats(
            {"metallic": 1.0, "base_color": COPPER, "roughness": 0.3},
            {"metallic": 0.0, "base_color": PAINT, "roughness": 0.4},
            {"clearcoat": 1.0, "clearcoat_gloss": 1.0},
            {"clearcoat_gloss": 0.0},
            {"clearcoat": 0.5},
        ),
    ),
}


# Differences ---------------------------------------------------------------------------------------------------------


def differences() -> None:
    heads = [f"{what}, {cosine:g}" for what in ("energy", "alpha") for cosine in COSINES]
    for title, source in SOURCES.items():
        print(f"\n| {title} | lobe | {' | '.join(heads)} |\n|---|---|{'---|' * len(heads)}")
        for name, given in source.materials.items():
            theirs, ours = ([of(source, given, cosine) for cosine in COSINES] for of in (of_formulas, of_stack))
            for lobe in (name for name in LOBES if any(name in each for each in (*ours, *theirs))):
                cells = [
                    cell([each.get(lobe, (0.0, None))[kind] for each in pair])
                    for kind in (0, 1)
                    for pair in zip(theirs, ours)
                ]
                print(f"| {name} | {lobe} | {' | '.join(cells)} |", flush=True)


def cell(pair: Sequence[float | None]) -> str:
    """Both numbers, with what there is of them."""
    texts = ["" if x is None else f"{x:.3f}".removeprefix("0") for x in pair]
    return ", ".join(texts) if any(texts) else ""


def darkened(of: Callable[[Source, Values, float], Lobes], source: Source, given: Values, cosine: float) -> float:
    """The energy of what lies below the coat over that without darkening, of OpenPBR."""
    plain = {**given, "coat_darkening": 0.0}
    below, bright = (
        sum(energy for name, (energy, _) in of(source, each, cosine).items() if name in ("base", "diffuse"))
        for each in (given, plain)
    )
    return below / bright


def with_darkening(
    of: Callable[[Source, Values, float], Lobes],
) -> Callable[[Source, Values, float], Lobes]:
    """Lobes, and what is darkened where the source knows that."""

    def lobes(source: Source, given: Values, cosine: float) -> Lobes:
        found = of(source, given, cosine)
        if source.reader is not openpbr or not given.get(source.coat) or given.get("coat_darkening") == 0:
            return found
        return {**found, "darkening": (darkened(of, source, given, cosine), None)}

    return lobes


@with_darkening
def of_stack(source: Source, given: Values, cosine: float) -> Lobes:
    """Energies, in the mean of colours, of the lobes of an imported material, and their mean roughness by energy."""
    energies, alphas = dict.fromkeys(LOBES, 0.0), dict.fromkeys(LOBES, 0.0)
    material = source.reader.read(given).stack
    for share, stack in material.weighted("the benchmark has no images"):
        found = vt.lobes(stack, cosine)
        coated = bool(given.get(source.coat)) and not stack.name.startswith("uncoated")
        for name, energy, alpha in zip(LOBES[not coated :], found.energy, found.alpha):
            energies[name] += share * float(np.mean(energy))
            alphas[name] += share * float(np.mean(energy)) * float(np.mean(alpha))
        if stack.base:
            energies["diffuse"] += share * float(np.mean(found.remainder))
    return {
        name: (energy, None if name == "diffuse" else alphas[name] / energy)
        for name, energy in energies.items()
        if energy
    }


@with_darkening
def of_formulas(source: Source, given: Values, cosine: float) -> Lobes:
    """The same of the source's formulas: parts of the value follow from weights that are set to 0."""
    rough, coat_rough = source.alphas(given)
    wi, wo, density = directions(cosine, (rough, coat_rough), source.samples)
    without_diffuse, only_coat = source.without
    materials = [given, {**given, **without_diffuse}, {**given, **only_coat}]
    light = [float(np.mean(value / density)) for value in source.light(materials, wi, wo)]
    metal, coated = given.get(source.metal) == 1, bool(given.get(source.coat))
    over, coat = light[0] if metal else light[1], light[2] if coated else 0.0
    lobes: Lobes = {"coat": (coat, coat_rough)} if coated else {}
    lobes["base"] = (over - coat, rough)
    return lobes if metal else {**lobes, "diffuse": (light[0] - over, None)}


def directions(cosine: float, alphas: Sequence[float], samples: int) -> tuple[Any, Any, Any]:
    """A view, directions drawn from three densities alike often, and the mean of those densities."""
    view = (np.sqrt(1 - cosine**2), 0.0, cosine)
    u, v = square(samples)
    wi = tuple(np.full(3 * len(u), x) for x in view)
    widths = [max(alpha, LEAST) for alpha in alphas]
    drawn = [
        np.stack(np.broadcast_arrays(*ggx.reflect(view, ggx.sample_visible(view, alpha, alpha, u, v))))
        for alpha in widths
    ]
    radius, angle = np.sqrt(u), 2 * np.pi * v
    drawn.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - u)]))
    wo = np.concatenate(drawn, axis=1)
    h = ggx.normalize(tuple(np.stack(wi) + wo))
    density = np.maximum(wo[2], 0) / np.pi
    for alpha in widths:
        density = density + ggx.ndf(h, alpha, alpha) * ggx.masking(wi, alpha, alpha) / (4 * cosine)
    return np.stack(wi), wo, np.maximum(density / 3, 1e-12) * np.where(wo[2] > 0, 1, np.inf)


if __name__ == "__main__":
    main()
