"""`velatura lobes`: the lobes of a material at given directions, as a table or as JSON."""

from __future__ import annotations

import json
import math
from typing import Annotated

import typer

from velatura.cli import options


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
        print(json.dumps({"model": name, **found.to_dict()}, allow_nan=False))
    else:
        options.console().print(*found.as_tables(f"{described.name or material} ({name})"))
