"""The same pictures by Mitsuba, of a BSDF that is the sum of closures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from velatura import kernel
from velatura.films.of_material import films_of
from velatura.model import Model
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.shader import closures
from velatura.shader.closures import Closure
from velatura.shader.recorder import recording
from velatura.stack import Brushing, Material, Stack, Texture
from velatura.stack import number as plain

Found = Callable[[Any], list[Closure]]  # for a surface interaction

_found: dict[str, Found] = {}


def pictures(found: Found, job: dict[str, Any]) -> np.ndarray:
    """Pictures (lights, seeds, height, width, 3)."""
    mi = kernel.mitsuba()
    mi.register_bsdf("closures", lambda properties: _bsdf_class(mi)(properties))
    _found["closures"] = found
    camera = mi.ScalarTransform4f().look_at(job["camera"], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": job["size"], "height": job["size"], "rfilter": {"type": "box"}}
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3},
        "sensor": {
            "type": "perspective",
            "fov": job["fov"],
            "to_world": camera,
            "film": film,
        },
        "plane": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(job["half"]),
            "bsdf": {"type": "closures"},
        },
    }
    every = []
    for light in job["lights"]:
        white: dict[str, Any] = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
        sun = {
            "type": "directional",
            "direction": [-x for x in light or ()],
            "irradiance": {"type": "rgb", "value": 1.0},
        }
        lit = mi.load_dict({**scene, "light": sun if light else white})
        every.append([np.array(mi.render(lit, spp=job["spp"], seed=seed + 100)) for seed in job["seeds"]])
    return np.array(every)[..., :3]


def of_table(baked: closures.TabulatedClosures) -> Found:
    """The closures of a solved material."""
    mi = kernel.mitsuba()
    flat = mi.Float(baked.rows[0].ravel().astype(np.float32))
    curves = directional_grid.interleaved(flat, baked.shape, mi.Float)

    def read(w: Direction) -> closures.ColumnReader:
        return closures.ColumnReader.of(curves(w), mi.Color3f)

    return lambda si: baked.at(tuple(si.wi), read, baked.etas[0])


def of_layers(stack: Stack, model: Model) -> Found:
    """The closures of a model in closed form, worked out at every point."""
    mi = kernel.mitsuba()
    coatings = films_of(Material.of(stack, lambda at, x: 0.0 if isinstance(x, Texture) else plain(at, x)))
    # Images stand upright where v goes up, as in Blender; Mitsuba's rectangle has their first row at v = 0
    upright = mi.ScalarTransform3f().scale([1, -1])
    images = {
        at.name: mi.load_dict(
            {
                "type": "bitmap",
                "filename": str(x.texture),
                "raw": x.encoding == "linear",
                "to_uv": upright,
            }
        )
        for at, x in stack.values()
        if isinstance(x, Texture)
    }

    def found(si: Any) -> list[Closure]:
        def value(at: Any, described: Any) -> Any:
            assert not isinstance(described, Brushing)
            if isinstance(described, Texture):
                texel = images[at.name].eval(si) if at.colour else images[at.name].eval_1(si)
                return texel * described.scale + described.offset
            number = np.ravel(plain(at, described))
            return mi.Color3f(*np.broadcast_to(number, 3).tolist()) if at.colour else mi.Float(float(number[0]))

        material = Material.of(stack, value).coated(coatings)
        body = bsdf.body(material, model, recording.variance(stack), at_a_point())
        return closures.of_body(body, tuple(si.wi), straight=stack.thin)

    return found


def _bsdf_class(mi: Any) -> type:
    import drjit as dr

    class Closures(mi.BSDF):
        """A sum of closures, of light from above."""

        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            self.found = _found["closures"]
            flags = mi.BSDFFlags
            both = flags.FrontSide | flags.BackSide | flags.NonSymmetric | flags.Anisotropic
            self.has_components([flags.GlossyReflection | both, flags.GlossyTransmission | both])

        def has_components(self, components: Sequence[Any]) -> None:
            self.m_components = components
            self.m_flags = components[0] | components[1]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            found, shares = self._shares(si)
            chosen, begin = mi.Vector3f(0), mi.Float(0)
            for closure, share in zip(found, shares):
                wo = mi.Vector3f(*closures.sample(closure, tuple(si.wi), sample2.x, sample2.y))
                chosen = dr.select((sample1 >= begin) & (sample1 < begin + share), wo, chosen)
                begin = begin + share
            bs = mi.BSDFSample3f()
            bs.wo, bs.eta, bs.sampled_type, bs.sampled_component = chosen, 1.0, +mi.BSDFFlags.GlossyReflection, 0
            value, bs.pdf = self.eval_pdf(ctx, si, chosen, active)
            return bs, dr.select(active & (bs.pdf > 0), value / bs.pdf, 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            found, shares = self._shares(si)
            value, density = mi.Color3f(0), mi.Float(0)
            for closure, share in zip(found, shares):
                one, pdf = closures.eval_pdf(closure, tuple(si.wi), tuple(wo))
                value, density = value + closure.weight * one, density + share * pdf
            lit = active & (si.wi.z > 0)
            return dr.select(lit, value, 0), dr.select(lit, density, 0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def _shares(self, si: Any) -> tuple[list[Closure], list[Any]]:
            found = self.found(si)
            weights = [dr.mean(closure.weight) + 0.05 for closure in found]
            total = sum(weights[1:], weights[0])
            return found, [weight / total for weight in weights]

    return Closures
