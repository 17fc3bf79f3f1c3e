"""The public functions of `velatura`: load a material, compute its lobes, render it, check it against the laws."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from velatura.errors import InvalidInput
from velatura.model.base import SWITCHES, Model
from velatura.model.lobe_statistics import StackLobes
from velatura.model.registry import DEFAULT, MODELS, named
from velatura.model.registry import lobes as material_lobes
from velatura.stack import MaterialLike, dumps, load
from velatura.stack.schema import unknown

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from velatura.checks import Report
    from velatura.kernel import BSDF

__all__ = ["bsdf", "check", "lobes", "register", "render"]

#: What `bsdf` makes that is no statistical model: plugins, by the name that they go by among the models.
PLUGINS = {
    "reference": {"type": "layered_reference"},
    "exact": {"type": "layered", "form": "exact"},
    "weidlich_wilkie": {"type": "weidlich_wilkie"},
}

TURN = 37.0  # degrees, by which `check` turns brushed materials


def register() -> None:
    """Register the plugins with Mitsuba, in the current variant and in all that are set later."""
    import velatura.plugins
    import velatura.reference  # noqa: F401  (both declare theirs)
    from velatura import kernel

    kernel.register()


def lobes(
    stack: MaterialLike, cos_theta: ArrayLike, phi: ArrayLike = 0.0, model: str | Model = DEFAULT, **switches: str
) -> StackLobes | Any:
    """Energy, covariance and roughness of every lobe of a material (Belcour 2018, section 5), in NumPy.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name).
        cos_theta: cosines of the directions of incidence, in (0, 1]: a number, or a list of N.
        phi: their azimuths from the tangent, radians: one for all, or N.
        model: a named model or its name, its choices changed by `switches` (`reflectance="fresnel"`, `tir="off"`, ...).

    Returns:
        For each interface k from the top, of what is reflected, in double precision, by C = 3 colours and N directions:

        - `energy[k]`: (C, N), fraction of the incident energy;
        - `covariance[k]`: (3, N), xx, xy and yy in the space of the model's roughness map, in the shading frame;
        - `alpha[k]`: (2, N), GGX roughness along two axes;
        - `rotation[k]`: (N,), the angle from the tangent to the first of them, radians anticlockwise seen from outside;
        - `own_alpha[k]`, `own_rotation[k]`: likewise, in the medium that the lobe is drawn in. For `velatura` that is
          the one above the interface, and light that media scatter does not count; all other models draw lobes outside.

        `transmitted` holds the same of what leaves below, by half-vectors with the direction that a smooth stack would
        refract light to; None where nothing leaves. With `channels="separate"` all but energies have a leading axis of
        colours. A diffuse base is no lobe. All other light is in

        - `remainder`: (C, N), reflected in no lobe: by the diffuse base; for `velatura` also what media scatter, and
          what interfaces do other than a facet of each;
        - `passed`: (C, N), leaves below;
        - `absorbed`: (C, N), what is left, which for models that lose light holds that, too.

        Of a mixture, lists run over the lobes of all parts, one after the other, with energies times shares; other
        light is summed up, `transmitted` is a list, and `parts` are the lobes of each stack (`MixtureLobes`).

    Raises:
        InvalidInput: not a valid material, a cosine outside its range, lists of different lengths, an unknown model or
            switch, or a texture, since lobes are those of one point.
    """
    return material_lobes(load(stack), cos_theta, phi, model, **switches)


def bsdf(stack: MaterialLike, model: str | Model = DEFAULT, **switches: Any) -> BSDF:
    """A `mi.BSDF` of a material, in the variant that is set (else llvm_ad_rgb).

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name).
        model: a named model, its choices changed by `switches`; "exact", which samples the default model and
            evaluates the random walk; or "reference", the walk, and "weidlich_wilkie", the baseline, which are plugins
            of their own, and whose options (`microsurface=True`) stand for switches.

    Raises:
        InvalidInput: not a valid material, an unknown model or switch.
        MissingTool: LLVM is missing or too old; the message names the package to install.
    """
    from velatura import kernel

    described = load(stack)
    if isinstance(model, str) and model in PLUGINS:
        options = {**PLUGINS[model], **switches}
    elif isinstance(model, str) and model not in (known := [each.name for each in MODELS]):
        raise InvalidInput(unknown("model", model, [*known, *PLUGINS]))
    else:
        exact = {"form": "exact"} if switches.get("form") == "exact" else {}  # of the plugin, not of the model
        chosen = named(model, **{key: value for key, value in switches.items() if key not in exact})
        options = {"type": "layered", "model": chosen.name, **{switch: getattr(chosen, switch) for switch in SWITCHES}}
        options |= exact
    kernel.mitsuba()
    register()
    made: BSDF = kernel.load_dict({**options, "material": dumps(described, "json")})
    return made


def render(
    stack: MaterialLike,
    scene: str = "ball",
    env: str | None = None,
    spp: int = 64,
    size: int | str | Sequence[int] | None = None,
    model: str | Model = DEFAULT,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    **switches: str,
) -> NDArray[np.float32]:
    """A picture of a material (a stack, a mixture, a file, or a preset's name): linear RGB of shape (height, width, 3).

    Args:
        scene: "ball", "sphere", "teapot", "urn", "plane", "wedges", "lid", or a Mitsuba scene file whose BSDF
            "material" is to be replaced.
        env: "studio", "sky", "furnace", a photograph ("lobby"), or an .exr or .hdr file.
        spp: samples per pixel.
        size: pixels of a side, (width, height), or text ("640x360"); by default those of the scene file, or else 512.
        progress: called with (samples per pixel done, spp) now and then.

    Raises:
        InvalidInput, MissingTool: as `bsdf`; also an unknown scene or environment, or an impossible size.
    """
    from velatura import scenes

    return scenes.render(
        bsdf(stack, model, **switches), scene=scene, env=env, spp=spp, size=size, seed=seed, progress=progress
    )


def check(
    material: BSDF | MaterialLike,
    model: str | Model = DEFAULT,
    *,
    exceptions: Collection[str] = (),
    lossless: bool = False,
    expected: BSDF | MaterialLike | None = None,
    plots: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **switches: str,
) -> Report:
    """Check a BSDF against the laws: energy, reciprocity, sampling by its density, and the others of `checks.LAWS`.

    Args:
        material: any `mi.BSDF`, ours or not; or a material (a stack, a mixture, a file, or a preset's name) of which
            `model` makes one, with the model's own exceptions, and lossless where none of its layers absorbs.
        exceptions: names of further laws that give numbers, but no failure.
        lossless: nothing absorbs, so that loss breaks a law as well.
        expected: the BSDF or the material that this one should equal, if it is the limit of something.
        plots: a folder; every law that is broken leaves `LAW.png` there.
        progress: called with (steps done, all steps) now and then.

    Raises:
        InvalidInput, MissingTool: as `bsdf`; also an exception that is no law, a scalar variant, a folder that cannot
            be written.
    """
    from velatura import checks

    def made(thing: Any) -> Any:
        return bsdf(thing, model, **switches) if isinstance(thing, MaterialLike) else thing

    subject, turned = "BSDF", None
    if isinstance(material, MaterialLike):
        material = load(material)
        subject = f"{material.name or 'material'} ({model if isinstance(model, str) else model.name})"
        lossless = lossless or all(layer.lossless for _, stack in material.leaves() for layer in stack.layers)
        other = material.turned(TURN)
        if other and other != material.turned(0.0):
            turned = made(other), TURN
    return checks.check(
        made(material),
        exceptions=exceptions,
        lossless=lossless,
        expected=made(expected),
        turned=turned,
        plots=plots,
        subject=subject,
        progress=progress,
    )
