"""What `import velatura` offers: load a material, look at its lobes, render it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from velatura.model.models import DEFAULT, SWITCHES, Model, named
from velatura.model.statistics import statistics as lobes
from velatura.stack import Stack, dumps, load

__all__ = ["bsdf", "lobes", "register", "render"]


def register() -> None:
    """Make the plugins known to Mitsuba, in the variant that is set and in all that are set later."""
    import velatura.plugins  # noqa: F401  (declares them)
    from velatura import kernel

    kernel.register()


def bsdf(stack: Stack | str, model: str | Model = DEFAULT, **switches: str) -> Any:
    """A `mi.BSDF` of a material (a stack, a file, or a preset's name), in the variant that is set (else llvm_ad_rgb).

    Raises:
        InvalidInput: not a valid material, an unknown model or switch.
        MissingTool: LLVM is missing or too old; the message says what to install.
    """
    from velatura import kernel

    mi = kernel.mitsuba()
    register()
    chosen = named(model, **switches)
    described = stack if isinstance(stack, Stack) else load(stack)
    options = {switch: getattr(chosen, switch) for switch in SWITCHES}
    return mi.load_dict({"type": "layered", "material": dumps(described, "json"), "model": chosen.name, **options})


def render(
    stack: Stack | str,
    scene: str = "ball",
    env: str | None = None,
    spp: int = 64,
    size: tuple[int, int] | None = None,
    model: str | Model = DEFAULT,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    **switches: str,
) -> Any:
    """A picture of a material: linear RGB of shape (height, width, 3).

    Args:
        scene: "ball", "sphere", "wedges", or a Mitsuba scene file whose BSDF "material" is to be replaced.
        env: "studio", "sky", "furnace", or an .exr or .hdr file.
        spp: samples per pixel.
        progress: called with (samples per pixel done, spp) now and then.

    Raises:
        InvalidInput, MissingTool: as `bsdf`; also an unknown scene or environment.
    """
    from velatura import scenes

    return scenes.render(
        bsdf(stack, model, **switches), scene=scene, env=env, spp=spp, size=size, seed=seed, progress=progress
    )
