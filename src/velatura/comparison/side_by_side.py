"""Comparison of models with the truth on one material."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from typing import Any

from velatura.bakes import TARGETS, Bake, bake
from velatura.comparison import baked, plugins
from velatura.comparison.evaluated_lobes import account, along
from velatura.comparison.pictures import pictures as spheres
from velatura.comparison.plugins import Plugin
from velatura.comparison.result import UNPOLARISED, Account, Comparison
from velatura.comparison.truth import truth as walked
from velatura.errors import InvalidInput, whole_number
from velatura.model import MODELS, Model, named
from velatura.stack import Described, MaterialLike, load

COSINES = (1.0, 0.7, 0.35)
PATHS = 3 * 10**6

Progress = Callable[[int, int], None]


def compare(
    stack: MaterialLike,
    models: Sequence[Model | Plugin] | None = None,
    cos_theta: Sequence[float] = COSINES,
    paths: int = PATHS,
    seed: int = 0,
    microsurface: bool | None = None,
    pictures: bool = False,
    progress: Progress | None = None,
    polarised: bool = False,
    **switches: str,
) -> Comparison:
    """Energies, roughnesses and distributions of a material by several models, against random walks through it.

    Light comes in the plane of the tangent.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name).
        models: names of models, or models; None means all that have the `switches`, which change the choices of each.
            Also plugins, of which only `evaluated`, the distribution and pictures are known: "weidlich_wilkie" and
            "reference", which are given the material; others of Mitsuba's, by name with its defaults ("principled"), as
            an XML file, or as the dict of `mi.load_dict` ("id" is then its name here).
        cos_theta: cosines of the directions of incidence, in (0, 1].
        paths: of the truth, for each direction; at least 2.
        seed: of the truth's random numbers.
        microsurface: whether, in the truth, light scatters many times between the facets of an interface; None means
            that it does if the reflectance of a model counts that.
        pictures: whether to render spheres as well.
        progress: called with (steps done, all steps) now and then.
        polarised: whether the truth follows polarisation. The truth that leaves it out is then one of the models,
            "unpolarised", and its errors are what leaving it out costs. Not with `pictures`, which leave it out.

    Raises:
        InvalidInput: not a valid material, an unknown model or switch, a value outside its range, a texture.
        MissingTool: LLVM is missing or too old.
    """
    # Refuse what cannot work before anything slow begins
    described: Described = load(stack)
    asked = _every(switches) if models is None else [_model(m, switches) for m in models]
    if microsurface is None:
        microsurface = any(isinstance(m, Model) and m.microsurface for m in asked)
    paths = whole_number("paths", paths, 2)
    if polarised and pictures:
        raise InvalidInput("pictures: not with polarised, since they are rendered without polarisation")
    names = _names(asked, polarised)
    if switches and not any(isinstance(m, Model) for m in asked):
        raise InvalidInput(f"{', '.join(switches)}: for named models only, and there is none among these")
    if pictures:
        baked.check_pictures(names)
    chosen = {name: _made(m, described, microsurface) for name, m in zip(names, asked)}

    # Let the models speak, then the truth, and set them side by side
    modelled = {name: _account(m, described, cos_theta) for name, m in chosen.items()}
    walks = 3 * len(cos_theta) * len(list(described.leaves())) * (1 + polarised)
    advance = _counter(progress, walks + (len(chosen) + 2) * pictures)
    truth, error, noise = walked(described, cos_theta, paths, seed, microsurface, polarised, advance)
    if polarised:
        modelled[UNPOLARISED], *_ = walked(described, cos_theta, paths, seed, microsurface, False, advance)
    rendered = {name: baked.bsdf(m) if isinstance(m, Bake) else m for name, m in chosen.items()} if pictures else {}
    return Comparison(
        name=described.name,
        lobe_names=_lobe_names(described),
        cos_theta=tuple(float(c) for c in cos_theta),
        paths=paths,
        microsurface=microsurface,
        polarised=polarised,
        truth=truth,
        standard_error=error,
        noise=noise,
        models={name: _beside(model, truth) for name, model in modelled.items()},
        pictures=spheres(described, rendered, seed, microsurface, advance) if pictures else None,
    )


def _names(asked: Sequence[Model | Plugin], polarised: bool) -> list[str]:
    """The name of each model. Raises InvalidInput unless they are distinct, and there is one."""
    names = [m.name if isinstance(m, Model) else plugins.name_of(m) for m in asked]
    if not names:
        raise InvalidInput("models: name at least one")
    if polarised and UNPOLARISED in names:
        raise InvalidInput(f"models: with polarised, {UNPOLARISED} is the name of the truth without polarisation")
    if len(set(names)) < len(names):
        raise InvalidInput(f"models: {max(names, key=names.count)} is given twice")
    return names


def _made(model: Model | Plugin, material: Described, microsurface: bool) -> Any:
    """The model, a bake, or the BSDF of a plugin."""
    if isinstance(model, Model):
        return model
    if isinstance(model, str) and model in TARGETS:
        return bake(material, model)
    return plugins.made(model, material, microsurface)


def _account(made: Any, material: Described, cos_theta: Sequence[float]) -> Account:
    if not isinstance(made, Model):
        return (baked if isinstance(made, Bake) else plugins).account(made, material, cos_theta)
    shares, stacks = zip(*material.weighted("lobes are those of one point; replace it by a number"))
    return Account.mixed(shares, [account(stack, cos_theta, made) for stack in stacks])


def _model(model: Model | Plugin, switches: dict[str, str]) -> Model | Plugin:
    """A named model with these switches; a plugin unchanged."""
    if isinstance(model, Model) or (isinstance(model, str) and model in [m.name for m in MODELS]):
        return named(model, **switches)
    return model


def _every(switches: dict[str, str]) -> list[Model]:
    """All named models that have these switches."""
    found, refusals = [], []
    for model in MODELS:
        try:
            found.append(named(model, **switches))
        except InvalidInput as refusal:
            refusals.append(refusal)
    if not found:
        raise refusals[0]
    return found


def _beside(model: Account, truth: Account) -> Account:
    """The model's account with its roughness along the axes of the true lobes."""
    turned = [along(lobe, true) for lobe, true in zip(model.lobes, truth.lobes)]
    split = len(model.reflected)
    return replace(model, reflected=tuple(turned[:split]), transmitted=tuple(turned[split:]))


def _lobe_names(material: Described) -> tuple[str, ...]:
    reflected, transmitted = [], []
    for path, stack in material.leaves():
        part = "".join(f"part{number} " for number in path)
        reflected += [f"{part}R{k}" for k in range(1, len(stack.interfaces) + 1)]
        reflected += [f"{part}D"] if stack.base else []
        transmitted += [f"{part}T"] if stack.transmits else []
    return (*reflected, *transmitted)


def _counter(progress: Progress | None, total: int) -> Callable[[], None]:
    """Returns a function that reports one more step to `progress` at each call."""
    steps = count(1)

    def advance() -> None:
        if progress:
            progress(next(steps), total)

    return advance
