"""Render time of the plugin `layered` as ratios to Mitsuba's `principled`, interleaved in one run.

The material ball fills over 60 % of a 512x512 picture under an environment map, 64 spp, path with max_depth 4; model
defaults with tables and total internal reflection on. Beside it: `eval_pdf` alone, and textured parameters.

With `--solids`: solids of rough glass (index 1.5) instead, beside `roughdielectric`: the light of a sphere in a white
furnace, path depth 40, and the noise of a block in the studio at equal samples, as a ratio. Where facets are met often,
beside a `roughdielectric` that is divided by its albedo, which keeps light as well. So of spheres of opaque presets,
beside `belcour2018`; the light of pictures is another ratio.

With `--mixtures`: gold under a coat, paint under a coat, and mixtures of the two, by a mask of 0 and 1 and of half and
half everywhere; processor time beside the dearer of the parts.

    python benchmarks/render.py [--rounds 9] [--spp 64] [--variant llvm_ad_rgb] [--model NAME] [--solids] [--mixtures]
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rows import parsed, row

import velatura as vt
from velatura import kernel
from velatura.model import DEFAULT
from velatura.scenes import scene_dict

ZOOM = 1.25
ROUGH = (0.05, 0.2, 0.4)
OPAQUE = ("coated-gold", "varnished-paint", "scattering-medium-over-gold", "furnace-rough", "crossed-brushing")


def stacks() -> dict[str, vt.Stack]:
    """The stacks that are measured: two interfaces and five, isotropic, all that the model has switched on."""
    metal = vt.Interface(conductor="Au", alpha=0.2)
    coats = [vt.Interface(eta=n, alpha=a) for n, a in ((1.5, 0.05), (1.7, 0.1), (1.4, 0.05), (1.6, 0.1))]
    return {"two interfaces": vt.Stack([coats[0], metal]), "five interfaces": vt.Stack([*coats, metal])}


def textured(mi, stack: vt.Stack, model: str):
    """The stack with the roughness and the index of its coat from a texture."""
    rng = np.random.default_rng(0)

    def image(low: float, high: float) -> dict:
        texels = rng.uniform(low, high, (256, 256, 1)).astype(np.float32)
        return {"type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True}

    material = vt.stack.dumps(stack, "json")
    maps = {"layer0_alpha": image(0.02, 0.1), "layer0_eta": image(1.4, 1.6)}
    return mi.load_dict({"type": "layered", "material": material, "model": model, **maps})


def bsdfs(mi, model: str) -> dict:
    """BSDFs by name, the yardstick first."""
    found = {"principled": mi.load_dict({"type": "principled", "roughness": 0.2, "metallic": 0.8, "clearcoat": 0.5})}
    found |= {name: vt.bsdf(stack, model=model) for name, stack in stacks().items()}
    found["two, textured"] = textured(mi, stacks()["two interfaces"], model)
    return found


def mixtures(mi, model: str) -> dict:
    """Two parts, and mixtures of them, by name; a mask has patches of 16 x 16 texels."""
    paint = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Medium(sigma_a=(0.02, 0.06, 0.3)), vt.Diffuse(albedo=0.5)])
    parts = {"gold": stacks()["two interfaces"], "paint": paint}
    material = vt.stack.dumps(vt.Mix([(0.5, parts["gold"]), (None, paint)]), "json")
    patches = np.kron(np.random.default_rng(0).integers(0, 2, (16, 16)), np.ones((16, 16)))
    mask = {"type": "bitmap", "bitmap": mi.Bitmap(patches[..., None].astype(np.float32)), "raw": True}
    plugin = {"type": "layered", "material": material, "model": model}
    return {name: vt.bsdf(stack, model=model) for name, stack in parts.items()} | {
        "mask of 0 and 1": mi.load_dict({**plugin, "part0_weight": {**mask, "filter_type": "nearest"}}),
        "half and half": mi.load_dict(plugin),
    }


def picture(mi, bsdf, size: int, spp: int):
    """A function that renders the ball once, for a seed."""
    import drjit as dr

    description = scene_dict("ball", "studio", bsdf, (size, size), ZOOM)
    scene = mi.load_dict({**description, "integrator": {"type": "path", "max_depth": 4}})

    def job(seed: int) -> None:
        dr.eval(mi.render(scene, spp=spp, seed=seed))
        dr.sync_thread()

    return job


def timed(jobs: dict, rounds: int, clock: Callable[[], float] = time.perf_counter) -> dict[Any, list[float]]:
    """Seconds that each job takes, interleaved, once per round."""
    times: dict[Any, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job(0)  # compile
    for number in range(rounds):
        for name, job in jobs.items():
            start = clock()
            job(number + 1)
            times[name].append(clock() - start)
    return times


def furnace(mi, bsdf, spp: int = 1024) -> tuple[float, float]:
    """Light of a sphere under white light from everywhere, and its standard error."""
    to_world = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 24, "height": 24, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 40, "rr_depth": 40},
            "light": {"type": "constant", "radiance": 1.0},
            "sphere": {"type": "sphere", "bsdf": bsdf},
            "sensor": {"type": "perspective", "fov": 14, "to_world": to_world, "film": film},
        }
    )
    means = [float(np.mean(np.array(mi.render(scene, spp=spp // 8, seed=seed)))) for seed in range(8)]
    return float(np.mean(means)), float(np.std(means) / np.sqrt(8))


def noise(mi, bsdf, shape: str, spp: int = 16, rounds: int = 16) -> tuple[float, float]:
    """Standard deviation of pixels over rounds, root mean square, of a shape in the studio, and their mean."""
    description = scene_dict("sphere", "studio", bsdf, (96, 96), ZOOM)
    if shape == "cube":
        turn = mi.ScalarTransform4f().translate([0, 0.9, 0]).rotate([0, 1, 0], 30).scale(0.7)
        description["object"] = {"type": "cube", "to_world": turn, "bsdf": bsdf}
    scene = mi.load_dict({**description, "integrator": {"type": "path", "max_depth": 16, "rr_depth": 16}})
    pictures = [np.minimum(np.array(mi.render(scene, spp=spp, seed=seed)), 20) for seed in range(rounds)]
    return float(np.sqrt(np.mean(np.var(pictures, axis=0, ddof=1)))), float(np.mean(pictures))


def noisier(mi, bsdf, other, shape: str) -> str:
    """Ratios of noise and of light."""
    (more, light), (less, light_of_other) = noise(mi, bsdf, shape), noise(mi, other, shape)
    return f"{more / less:.2f} (light {light / light_of_other:.2f})"


def lossless(mi, glass, nodes: int = 256, samples: int = 4096):
    """A BSDF of two sides over its albedo, which is sampled at so many cosines."""
    import drjit as dr

    z = np.repeat(np.linspace(-1, 1, nodes), samples)
    si, rng = dr.zeros(mi.SurfaceInteraction3f, len(z)), mi.PCG32(len(z))
    si.wi = mi.Vector3f(mi.Float(np.sqrt(1 - z * z)), 0, mi.Float(z))
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    bs, weight = glass.sample(mi.BSDFContext(), si, *numbers)
    weight = np.nan_to_num(np.array(weight.x * dr.select(bs.wo.z * si.wi.z < 0, bs.eta * bs.eta, 1)))
    table = mi.Texture1f(
        mi.TensorXf(1 / weight.reshape(nodes, samples).mean(axis=1)[:, None]), wrap_mode=dr.WrapMode.Clamp
    )

    class Lossless(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)
            self.m_components = [glass.flags(k) for k in range(glass.component_count())]
            self.m_flags = glass.flags()

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs, weight = glass.sample(ctx, si, sample1, sample2, active)
            return bs, weight * self._scale(si)

        def eval(self, ctx, si, wo, active=True):
            return glass.eval(ctx, si, wo, active) * self._scale(si)

        def pdf(self, ctx, si, wo, active=True):
            return glass.pdf(ctx, si, wo, active)

        def eval_pdf(self, ctx, si, wo, active=True):
            value, pdf = glass.eval_pdf(ctx, si, wo, active)
            return value * self._scale(si), pdf

        def _scale(self, si):
            return table.eval((si.wi.z * (nodes - 1) / nodes + 1) / 2)[0]

    return Lossless(mi.Properties("lossless"))


def solids(mi, model: str) -> None:
    for alpha in ROUGH:
        glass = mi.load_dict({"type": "roughdielectric", "distribution": "ggx", "int_ior": 1.5, "alpha": alpha})
        stack, kept = vt.Stack([vt.Interface(eta=1.5, alpha=alpha)]), lossless(mi, glass)
        once, often = (vt.bsdf(stack, model=model, reflectance=name) for name in ("fgd", "fgd-multi"))
        whites = [furnace(mi, each) for each in (often, once, glass, kept)]
        names = "fgd-multi", "fgd", "roughdielectric", "over its albedo"
        error = max(e for _, e in whites)
        lights = ", ".join(f"{name} {x:.4f}" for name, (x, _) in zip(names, whites))
        print(f"glass, alpha {alpha}: furnace {lights} (+- {error:.4f})", flush=True)
        for form in ("forward", "symmetric"):
            once, often = (vt.bsdf(stack, model=model, form=form, reflectance=name) for name in ("fgd", "fgd-multi"))
            ratios = noisier(mi, once, glass, "cube"), noisier(mi, often, kept, "cube")
            print(f"    {form}: noise of a block fgd {ratios[0]}, fgd-multi {ratios[1]}", flush=True)
    for name in OPAQUE:
        other = vt.bsdf(name, model="belcour2018")
        for form in ("forward", "symmetric"):
            print(
                f"{name}, {form}: noise {noisier(mi, vt.bsdf(name, model=model, form=form), other, 'sphere')}",
                flush=True,
            )


def main() -> None:
    arguments = parsed(
        __doc__,
        rounds=9,
        spp=64,
        size=512,
        count=(1 << 22, "evaluations"),
        variant="llvm_ad_rgb",
        model=DEFAULT,
        solids=(False, "solids of rough glass, and noise"),
        mixtures=(False, "mixtures beside their parts"),
    )
    mi = kernel.mitsuba(arguments.variant)
    import drjit as dr

    vt.register()
    if arguments.solids:
        solids(mi, arguments.model)
        return
    materials = (mixtures if arguments.mixtures else bsdfs)(mi, arguments.model)

    def evaluation(bsdf, count: int = arguments.count):
        rng = mi.PCG32(count)

        def job(seed: int) -> None:
            si = dr.zeros(mi.SurfaceInteraction3f, count)
            si.wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
            si.uv = mi.Point2f(rng.next_float32(), rng.next_float32())
            wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32()))
            dr.eval(bsdf.eval_pdf(mi.BSDFContext(), si, wo), rng)  # the latter, so that every round has the same kernel
            dr.sync_thread()

        return job

    def render(bsdf):
        return picture(mi, bsdf, arguments.size, arguments.spp)

    for title, make in (("render", render), ("eval_pdf", evaluation)):
        if arguments.mixtures:
            times = timed({name: make(bsdf) for name, bsdf in materials.items()}, arguments.rounds, time.process_time)
            dearer = times["gold" if sum(times["gold"]) > sum(times["paint"]) else "paint"]
            for name, seconds in times.items():
                row(title, f"mixture, {name}", [t / d for t, d in zip(seconds, dearer)], "x the dearer part")
            continue
        times = timed({name: make(bsdf) for name, bsdf in materials.items()}, arguments.rounds)
        for name, seconds in times.items():
            row(title, name, [t / first for t, first in zip(seconds, times["principled"])], "x principled")


if __name__ == "__main__":
    main()
