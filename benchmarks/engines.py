"""Cost of shaders in an engine: instructions and bytes per pixel, counted in SPIR-V, for presets and models.

Instructions are those of SPIR-V that compute, on vectors counted once, as glslangValidator writes them, in all rounds
of loops and on both sides of branches; bytes are those of fetched texels. Of a pixel with one light: `vt_lobes` and
`vt_eval_pdf`, once each. Prints the table of docs/how-to/engines.md; with `--quad` that of docs/reference/figures.md,
for a pixel of a full-screen quad, over what one GGX lobe with Schlick's Fresnel takes.

    python benchmarks/engines.py [--presets coated-gold,varnished-paint,frosted-glass] [--quad]
"""

from __future__ import annotations

import sys
from pathlib import Path

from rows import parsed

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

import machines
from machines import MACHINES
from spirv import counted, counts

import velatura
from velatura.figures import belcour2018, weier2020, yamaguchi2019
from velatura.model import MODELS, Model, named
from velatura.shader import shader
from velatura.shader.printers.glsl import Vulkan

PRESETS = "coated-gold,varnished-paint,frosted-glass"
TEXEL = 16  # bytes, of RGBA32F

#: The value, with its cosine, and the density of one isotropic GGX lobe, by visible normals and Schlick's Fresnel.
GGX = """#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0) buffer Given { vec4 given[]; };
vec4 ggx(vec3 wi, vec3 wo, vec3 f0, float alpha) {
    vec3 h = normalize(wi + wo);
    float a2 = alpha * alpha, t = h.z * h.z * (a2 - 1.0) + 1.0;
    float d = a2 / (3.14159265 * t * t);
    float i = sqrt(a2 + (1.0 - a2) * wi.z * wi.z), o = sqrt(a2 + (1.0 - a2) * wo.z * wo.z);
    vec3 f = f0 + (1.0 - f0) * pow(1.0 - dot(wi, h), 5.0);
    return vec4(f * (0.5 * d * wo.z / (wo.z * i + wi.z * o)), 0.5 * d / (wi.z + i));
}
void main() { given[4] = ggx(given[0].xyz, given[1].xyz, given[2].xyz, given[3].x); }
"""
LIGHTS = 128  # as many as Weier & Belcour 2020, section 4.2, take samples of a pixel
OURS = {"velatura": ("velatura", {})}
METALS = weier2020.METALS
#: Stacks of the papers' figures, by title, and the models that they are counted in, by title too.
QUADS = {
    "Belcour 17": (belcour2018.COATED_METAL, {**belcour2018.VARIANTS, **OURS}),
    "Weier 10, metal .1, .1": (METALS["metal 0.1, 0.1"], {**weier2020.COLUMNS, **OURS}),
    "Weier 10, metal .1, .3": (METALS["metal 0.1, 0.3"], {**weier2020.COLUMNS, **yamaguchi2019.COLUMNS, **OURS}),
}


def quads() -> None:
    """Print the table of figures."""
    one, _ = counted(machines.spirv(GGX, "-V"), "ggx")
    print(f"| material | model | instructions | over GGX ({one}) | the same, {LIGHTS} lights | bytes fetched |")
    print("|---|---|---|---|---|---|")
    for title, (stack, columns) in QUADS.items():
        for column, (name, choices) in columns.items():
            found = counts(shader(stack, named(name, **choices), printer=Vulkan()).text)
            (lobes, _), (lit, _) = each = found["vt_lobes"], found["vt_eval_pdf"]
            single, many = (f"{(lobes + count * lit) / (count * one):.1f}" for count in (1, LIGHTS))
            fetched = TEXEL * sum(texels for _, texels in each)
            print(f"| {title} | {column} | {lobes + lit} | {single} | {many} | {fetched} |", flush=True)


def row(preset: str, model: Model, baking: bool) -> str:
    made = shader(velatura.preset(preset), model, printer=Vulkan(), baking=baking)
    found = counts(made.text)
    instructions, fetched = (found["vt_lobes"][k] + found["vt_eval_pdf"][k] for k in range(2))
    read = made.columns if made.columns is not None else made.tables if made.looked_up else None
    size = 0 if read is None else read.nbytes / 1000
    baked = ", baked" if baking else ""
    lines = made.text.count("\n")
    drawn = found["vt_sample"][0]
    return f"| {preset} | `{model.name}`{baked} | {lines} | {instructions} | {drawn} | {TEXEL * fetched} | {size:.0f} |"


def main() -> None:
    arguments = parsed(__doc__, presets=PRESETS, quad=(False, "the table of figures: ratios to one GGX lobe"))
    if why := MACHINES["vulkan"].missing():
        print(f"skipped: {why}")
        return
    if arguments.quad:
        quads()
        return
    print("| preset | model | lines | instructions | of a sample | bytes fetched | kB of textures |")
    print("|---|---|---|---|---|---|---|")
    for preset in arguments.presets.split(","):
        for model in MODELS:
            for baking in (False, True) if model.closed_form else (False,):
                print(row(preset, model, baking), flush=True)


if __name__ == "__main__":
    main()
