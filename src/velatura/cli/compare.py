"""`velatura compare`: models against the truth, as numbers and as one figure."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import options, progress

if TYPE_CHECKING:
    from rich.table import Table

    from velatura.comparison import Comparison
    from velatura.reference import WalkedLobe


def compare(
    material: options.Material,
    models: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME,...",
            help=f"{options.MODELS}; default: all of these. Also weidlich_wilkie, reference, a bake (openpbr, gltf, "
            "blender-principled, mitsuba-principled), a BSDF plugin of Mitsuba's with its defaults (principled), or an "
            "XML file of one (mine.xml).",
        ),
    ] = None,
    cos: Annotated[
        str, typer.Option(metavar="C,C,...", help="Cosines of the incident directions, in (0, 1].")
    ] = "1,0.7,0.35",
    settings: options.Settings = None,
    paths: Annotated[
        int, typer.Option(min=2, max=2 * 10**7, metavar="N", help="Random walks of the truth for each direction.")
    ] = 3_000_000,
    seed: Annotated[int, typer.Option(min=0, max=2**31 - 1, metavar="N", help="Seed of the random numbers.")] = 0,
    microsurface: Annotated[
        bool | None,
        typer.Option(
            "--microsurface/--no-microsurface",
            help="In the truth, let light scatter many times between microfacets; default: if a model does.",
        ),
    ] = None,
    polarised: Annotated[
        bool,
        typer.Option(
            "--polarised",
            help="Follow polarisation in the truth, and report what leaving it out costs; not with --pictures.",
        ),
    ] = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="F", help="A figure of the results (PNG, WebP, PDF or SVG).")
    ] = None,
    pictures: Annotated[
        bool, typer.Option("--pictures", help="Also render spheres, for their errors and the figure.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Compare models with the truth: lobes, albedo, distribution."""
    # Refuse what cannot work before anything slow begins
    cosines = options.cosines(cos)
    stack, switches = options.read(material, settings)
    from velatura import comparison

    if plot:
        comparison.check_figure(plot)

    with progress.bar(f"Comparing {stack.name or material}") as advance:
        found = comparison.compare(
            stack,
            models.split(",") if models is not None else None,
            cosines,
            paths,
            seed,
            microsurface,
            pictures=pictures,
            polarised=polarised,
            progress=advance,
            **switches,
        )
    if plot:
        comparison.save_figure(found, plot)

    if as_json:
        print(json.dumps({**found.to_dict(), "material": stack.name or material}, allow_nan=False))
        return
    console = options.console()
    console.print(_lobes(stack.name or material, found))
    console.print(_whole(found))
    console.print(_summary(found))


def _lobes(title: str, found: Comparison) -> Table:
    """A row per direction, lobe and model."""
    turned = any((lobe.rotation != 0).any() for lobe in found.truth.reflected)
    table = _table(title, "cos", "lobe", "", "energy", "alpha", *(["rotation"] if turned else []))
    for i, cosine in enumerate(found.cos_theta):
        for k, name in enumerate(found.lobe_names):
            true, error = found.truth.lobes[k], found.standard_error[k]
            alpha = f"{_cell(true.alpha, i, 4)}{_plus_minus(error.alpha, i)}"
            row = (f"{cosine:g}", name, "truth", f"{_cell(true.energy, i)}{_plus_minus(error.energy, i)}", alpha)
            table.add_row(*row, *_rotation(true, i, turned))
            for model, account in found.models.items():
                lobe = account.lobes[k]
                row = ("", "", model, _cell(lobe.energy, i), _cell(lobe.alpha, i, 4))
                table.add_row(*row, *_rotation(lobe, i, turned))
        table.add_section()
    return table


def _whole(found: Comparison) -> Table:
    """A row per direction and model, for all that is reflected."""
    table = _table("All that is reflected", "cos", "", "albedo", "as evaluated", "total variation")
    for i, cosine in enumerate(found.cos_theta):
        albedo = f"{_cell(found.truth.albedo, i)}{_plus_minus(found.albedo_error, i)}"
        table.add_row(f"{cosine:g}", "truth", albedo, "", f"noise {found.noise[i]:.4f}")
        for model, account in found.models.items():
            variation = _number(found.total_variation[model][i])
            table.add_row("", model, _cell(account.albedo, i), _cell(account.evaluated, i), variation)
        table.add_section()
    return table


def _summary(found: Comparison) -> Table:
    """A row per model."""
    shown = found.pictures
    columns = ("model", "mean |log(alpha/true)|", "mean total variation")
    table = _table("", *columns, *([f"picture RMSE (noise {shown.noise:.4f})"] if shown else []))
    for model in found.models:
        numbers = [found.roughness_error[model], float(found.total_variation[model].mean())]
        if shown:
            numbers.append(shown.rmse(model))
        table.add_row(model, *(_number(x) for x in numbers))
    return table


def _table(title: str, *columns: str) -> Table:
    words = [column for column in columns if column in ("cos", "lobe", "", "model")]
    return options.table(title, words, columns[len(words) :])


def _cell(values: Any, i: int, digits: int = 3) -> str:
    """The components of a quantity in direction i; one of them where they are all the same."""
    numbers = [_number(x, digits) for x in values[:, i]]
    return numbers[0] if len(set(numbers)) == 1 else " ".join(numbers)


def _plus_minus(errors: Any, i: int) -> str:
    """The largest standard error."""
    error = errors[:, i].max()
    return "" if math.isnan(error) else f" ± {error:.1g}"


def _rotation(lobe: WalkedLobe, i: int, shown: bool) -> list[str]:
    rotation = math.degrees(lobe.rotation[i])
    return [] if not shown else ["-"] if math.isnan(rotation) else [f"{rotation:.0f}°"]


def _number(x: float, digits: int = 4) -> str:
    return "-" if math.isnan(x) else f"{x:.{digits}f}"
