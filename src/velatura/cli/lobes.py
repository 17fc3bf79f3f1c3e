"""`velatura lobes`: the lobes of a material at given directions, as a table or as JSON."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from velatura.model.lobe_statistics import LobeStatistics

# A lobe's quantities in the order of the JSON, and whether their components (rgb, uv, ...) stand before the directions.
FIELDS = {
    "energy": True,
    "alpha": True,
    "rotation": False,
    "covariance": True,
    "own_alpha": True,
    "own_rotation": False,
}
OTHER_LIGHT = ("remainder", "passed", "absorbed")
SHOWN = 0.00005  # least energy that the table does not round to 0


def lobes(
    material: options.Material,
    cos: Annotated[str, typer.Option(metavar="C,C,...", help="Cosines of the incident directions, in (0, 1].")] = "1",
    phi: Annotated[
        float, typer.Option(min=-360.0, max=360.0, metavar="DEGREES", help="Azimuth of the incident directions.")
    ] = 0.0,
    model: options.Model = None,
    settings: options.Settings = None,
    as_json: options.Json = False,
) -> None:
    """Print the lobes of a material: energy, roughness, rotation."""
    cosines = options.cosines(cos)
    described, switches = options.read(material, settings)
    import velatura

    name = options.model_name(model)
    found = velatura.lobes(described, cos_theta=cosines, phi=math.radians(phi), model=name, **switches)

    if as_json:
        reflected = [_plain({field: getattr(found, field)[k] for field in FIELDS}) for k in range(len(found.energy))]
        below = [_plain(_fields(part.transmitted)) for part in found.parts if part.transmitted]
        transmitted = below if isinstance(found.transmitted, list) else next(iter(below), None)
        report = {"model": name, "cos": cosines, "reflected": reflected, "transmitted": transmitted}
        print(json.dumps(report | {name: getattr(found, name).T.tolist() for name in OTHER_LIGHT}, allow_nan=False))
    else:
        named: dict[str, dict[str, Any]] = {}
        for (path, _), part in zip(described.leaves(), found.parts):
            within = "".join(f"part{number} " for number in path)
            for k in range(len(part.energy)):
                named[f"{within}R{k + 1}"] = {field: getattr(part, field)[k] for field in FIELDS}
            if part.transmitted:
                named[f"{within}T"] = _fields(part.transmitted)
        others = {
            other: getattr(found, other) for other in OTHER_LIGHT if not (found.transmitted and other == "passed")
        }
        options.console().print(_table(f"{described.name or material} ({name})", cosines, named, others))


def _fields(lobe: LobeStatistics) -> dict[str, Any]:
    return {field: getattr(lobe, field) for field in FIELDS}


def _plain(lobe: dict[str, Any]) -> dict[str, Any]:
    """Nested lists with the directions outside the components: an array (..., 2, N) becomes lists (..., N, 2)."""
    return {field: (values.swapaxes(-1, -2) if FIELDS[field] else values).tolist() for field, values in lobe.items()}


def _table(title: str, cosines: list[float], lobes: dict[str, dict[str, Any]], others: dict[str, Any]) -> Table:
    """A row per direction and lobe: R1 is the first interface from the top, T what leaves below, in a mixture after
    their part; then all other light by name."""
    table = options.table(title, ["cos", "lobe"], ["energy", "alpha", "rotation"])
    for i, cosine in enumerate(cosines):
        for name, lobe in lobes.items():
            energy, alpha, rotation = (lobe[field][..., i] for field in ("energy", "alpha", "rotation"))
            degrees = _cell(rotation * 180 / math.pi, ".1f")
            table.add_row(f"{cosine:g}", name, _cell(energy), _cell(alpha), f"{degrees}°")
        for name, energy in others.items():
            if energy[..., i].max() >= SHOWN:
                table.add_row(f"{cosine:g}", name, _cell(energy[..., i]))
        table.add_section()
    return table


def _cell(values: Any, form: str = ".4f") -> str:
    """Numbers in a line; with one set of them per channel, a line each."""
    if values.ndim > 1:
        return "\n".join(_cell(row, form) for row in values)
    return " ".join(format(value, form) for value in values.ravel())
