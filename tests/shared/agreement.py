"""A shader against NumPy: the same random stacks and directions through both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import viewport
from chromium import Browser
from machines import Changing, Machine

from velatura import tables
from velatura.editor import messages
from velatura.films.of_material import films_of
from velatura.model import rotation_frame
from velatura.model.context import at_a_point
from velatura.model.papers import bsdf
from velatura.model.solved import solve
from velatura.model.solved.solve import Solver
from velatura.optics import ggx
from velatura.shader import Recording, Shader, constant, material, record, shader, variance
from velatura.shader.lookups.bake import LobeLookUp
from velatura.shader.lookups.columns import SolvedLookUp
from velatura.shader.lookups.films import beside
from velatura.shader.printers.c_like import CLike
from velatura.shader.printers.glsl import GLSL
from velatura.stack import Film, Interface, Kind, Material, Mix, Stack

Pattern: TypeAlias = tuple[tuple[Kind, ...], str]

D: Kind = "dielectric"
C: Kind = "conductor"
M: Kind = "mirror"
S: Kind = "medium"  # it scatters
L: Kind = "diffuse"  # Lambert's law

#: Kinds of layers from the top.
SEQUENCES: tuple[tuple[Kind, ...], ...] = (
    (C,),
    (M,),
    (D,),
    (D, C),
    (D, M),
    (D, L),
    (D, D),
    (D, S, C),
    (D, S, D),
    (D, S, L),
    (S, C),
    (D, D, C),
    (D, D, D),
    (D, S, D, C),
    (D, S, D, S, C),
    (D, D, S, L),
    (D, D, D, C),
    (L,),
    (S, L),
    (S, D),
)
#: How the roughnesses of the interfaces lie: the same along both axes, along the frame's axes, turned.
SHAPES = ("round", "straight", "turned")
PATTERNS = tuple(product(SEQUENCES, SHAPES))

# Variances grow without bound towards a roughness of 1. Beyond .95 along one axis they leave the other axis of a turned
# interface fewer digits than 1e-4 asks of single precision.
ROOT_ALPHA_MAX = 0.97


@dataclass(frozen=True)
class Case:
    """N random stacks or mixtures of one pattern, with directions: single-precision values by name of the input."""

    stack: Any
    values: dict[str, np.ndarray]
    directions: dict[str, np.ndarray]


@dataclass(frozen=True)
class Results:
    """Energies (lobes, 3, N), alphas (lobes, 2, N), value (3, N), density (N,), and sampled directions (3, N)."""

    energy: np.ndarray
    alpha: np.ndarray
    value: np.ndarray
    density: np.ndarray
    drawn: np.ndarray


def random_case(pattern: Pattern, count: int, rng: np.random.Generator) -> Case:
    """Stacks of a pattern, lit from above, or from either side where they transmit; wo on either side."""
    kinds, shape = pattern
    values: dict[str, np.ndarray] = {"exterior": np.ones(count)}
    for i, kind in enumerate(kinds):
        values |= {f"layer{i}_{key}": value for key, value in _random_layer(kind, shape, count, rng).items()}
    stack = Stack.from_flat(kinds, {name: _first(value) for name, value in values.items()} | _mirrors(kinds))
    below = kinds[-1] == D
    directions = {"wi": _direction(count, rng, below), "wo": _direction(count, rng, below), "u": rng.random((3, count))}
    return Case(
        stack,
        {name: value.astype(np.float32).astype(float) for name, value in values.items()},
        {name: value.astype(np.float32).astype(float) for name, value in directions.items()},
    )


def coated(case: Case) -> Case:
    """The case with films on all interfaces that may have any; what these are worked out from is that of the first."""
    layers: list[Any] = []
    for k, layer in enumerate(case.stack.layers):
        if isinstance(layer, Interface) and layer.kind != "mirror":
            absorbs = 0.2 if layer.opaque or k == 0 else 0.0
            films = [Film(eta=2.1, k=absorbs, thickness_nm=60 + 110 * k), Film(eta=(1.36, 1.38, 1.4), thickness_nm=90)]
            layer = layer.model_copy(update={"films": tuple(films)})
        layers.append(layer)
    stack = Stack(layers, exterior=case.stack.exterior, thin=case.stack.thin)
    alike = beside(stack)
    values = {
        name: np.repeat(x[..., :1], x.shape[-1], axis=-1) if name in alike else x for name, x in case.values.items()
    }
    return replace(case, stack=stack, values=values)


@dataclass(frozen=True)
class MixedCase:
    """A case of mixtures, and those of their stacks, each with the prefix of its values."""

    whole: Case
    parts: Sequence[tuple[str, Case]]

    def in_numpy(self, model: str) -> Results:
        """Weighted sums of values and densities, and samples of the part that the first number chooses; roughnesses
        are those of all parts."""
        u = self.whole.directions["u"]
        begin, found = np.zeros_like(u[0]), list[Results]()
        value, density, drawn = np.zeros_like(u), np.zeros_like(u[0]), np.zeros_like(u)
        for share, (_, case) in zip(self.whole.stack.shares(self.whole.values), self.parts):
            own = np.stack([np.clip((u[0] - begin) / share, 0, 1), *u[1:]])
            case = replace(case, directions={**case.directions, "u": own})
            found.append(in_numpy(case, record(case.stack, model)))
            value, density = value + share * found[-1].value, density + share * found[-1].density
            drawn = np.where(u[0] >= begin, found[-1].drawn, drawn)
            begin = begin + share
        return Results(np.empty((0, 3, u.shape[1])), np.concatenate([x.alpha for x in found]), value, density, drawn)


def mixed_case(patterns: Sequence[Pattern], count: int, rng: np.random.Generator, films: bool = False) -> MixedCase:
    """Mixtures of three patterns of stacks, of which the last two are a mixture within."""
    cases = [random_case(pattern, count, rng) for pattern in patterns]
    cases = [coated(case) for case in cases] if films else cases
    a, b, c = (case.stack for case in cases)
    weights = {name: rng.uniform(0.1, 0.7, count).astype(np.float32).astype(float) for name in WEIGHTS}
    first, second = (float(weights[name][0]) for name in WEIGHTS)
    mix = Mix([(first, a), (None, Mix([(second, b), (None, c)]))])
    directions = max((case.directions for case in cases), key=lambda each: (each["wi"][2] < 0).any())
    parts = [(prefix, replace(case, directions=directions)) for prefix, case in zip(PARTS, cases)]
    values = {prefix + name: x for prefix, case in parts for name, x in case.values.items()}
    return MixedCase(Case(mix, {**weights, **values}, directions), parts)


WEIGHTS, PARTS = ("part0_weight", "part1_part0_weight"), ("part0_", "part1_part0_", "part1_part1_")


def in_numpy(case: Case, recording: Recording) -> Results:
    """The values of the model; where it solves materials, those of the first stack for all directions."""
    stack = case.stack
    wi, wo, u = (tuple(case.directions[name]) for name in ("wi", "wo", "u"))
    if isinstance(recording.baked, SolvedLookUp):
        return _solved(stack, recording.baked.solver, wi, wo, u)
    alone = Material.of(stack)
    material = Material.from_flat(stack, {**alone.flat(), **case.values}).coated(films_of(alone))
    body = bsdf.body(material, recording.model, variance(stack), at_a_point())
    seen = bsdf.scattered(body, wi)
    lobes = [*seen.reflected, *([seen.transmitted] if seen.transmitted else [])]
    value, density = body.eval_pdf(wi, wo)
    drawn, _ = body.sample(wi, *u)
    count = len(density)
    return Results(
        np.array([np.broadcast_to(lobe.energy, (3, count)) for lobe in lobes]),
        np.array([[np.broadcast_to(a, count) for a in lobe.roughness[:2]] for lobe in lobes]),
        np.broadcast_to(value, (3, count)),
        density,
        np.array(np.broadcast_arrays(*drawn)),
    )


def _solved(stack: Stack, used: Solver, wi: Any, wo: Any, u: Any) -> Results:
    """Results on the grid of a solver."""
    material = solve.plain(Material.of(stack).solid())
    frame = rotation_frame.frame(material)
    upright, solver = frame.back(material), replace(used, variance=frame.kind(variance(stack)))
    layouts = solver.layouts([upright])
    solved = solver.body(upright, solver.solve(upright, layouts), layouts)
    seen, _ = solved.seen(ggx.rotate(wi, np.radians(frame.degrees(material))))
    body = frame.turned(solved, material)
    value, density = body.eval_pdf(wi, wo)
    drawn, _ = body.sample(wi, *u)
    count, columns, interfaces = len(density), seen.columns, range(len(stack.interfaces))
    numbers = [shape.interface for shape in seen.shapes]
    energies = [sum(e for e, number in zip(columns.energies, numbers) if number == k) for k in interfaces]
    energies += [columns.rest, *([columns.passed] if columns.passes else [])]
    return Results(
        np.array([np.broadcast_to(energy, (3, count)) for energy in energies]),
        np.array([[np.broadcast_to(a, count) for a in lobe.roughness[:2]] for lobe in seen.lobes]),
        np.broadcast_to(value, (3, count)),
        density,
        np.array(np.broadcast_arrays(*drawn)),
    )


@dataclass(frozen=True)
class Program:
    """Statements that call a shader for a row of `given` inputs, and the four numbers of each answer."""

    given: np.ndarray
    function: str
    lines: Sequence[str]
    answers: Sequence[str]
    energies: int

    def results(self, answers: np.ndarray) -> Results:
        """Results of answers (N, answers, 4)."""
        found, n = np.moveaxis(answers.astype(float), 0, -1), self.energies
        return Results(found[:n, :3], found[n:-2, :2], found[-2, :3], found[-2, 3], found[-1, :3])


def program(case: Case, recording: Recording | None, made: Shader, printer: CLike = GLSL) -> Program:
    """The calls of a shader in its language, of a mixture without lobes; they read the texture `vt_given`."""
    names, parts = (list(recording.lobes), len(recording.energies)) if recording else ([], 0)
    energies = [f"l.{name}" for name in names if name.endswith(".energy")]
    energies = energies or [f"vt_energies(m, wi).parts[{k}]" for k in range(parts)]
    lobes = [f"l.{name.removesuffix('.alpha_u')}" for name in names if name.endswith(".alpha_u")]
    vec4 = printer.type("vec4")
    answers = [f"{vec4}({energy}, wi.x)" for energy in energies]  # wgpu fails for a constant beside a constant colour
    answers += [f"{vec4}({lobe}.alpha_u, {lobe}.alpha_v, 0.0, 0.0)" for lobe in lobes]
    answers += ["vt_eval_pdf(m, l, wi, wo)", f"{vec4}(vt_sample(m, l, wi, u), 0.0)"]
    given, lines = _reading(case, made, printer)
    begin = printer.declared("VtMaterial", "m")
    called = printer.declared("VtLobes", "l", "vt_lobes(m, wi)")
    return Program(given, printer.spelled(_READ), [begin, *lines, called], answers, len(energies))


_READ = """
float vt_read(int i, int row) {
    ivec2 at = ivec2(i >> 2, row);
    vec4 texel = texelFetch(vt_given, at, 0);
    return texel[i & 3];
}
"""


def recording_of(made: Shader) -> Recording:
    """The recording that the shader of a stack alone was printed from."""
    (part,) = made.parts
    return part.recording


def textures(made: Shader) -> dict[str, np.ndarray]:
    """Textures that a shader reads, by name."""
    read = {"vt_tables": made.tables if made.looked_up else None, "vt_baked": made.columns, "vt_films": made.films}
    return {name: data for name, data in read.items() if data is not None}


def in_browser(case: Case, recording: Recording | None, made: Shader, browser: Browser) -> tuple[Results, float, float]:
    """Results of the shader, and milliseconds to compile and to draw; a row of pixels for each stack."""
    called = program(case, recording, made)
    cases = "\n".join(f"        case {j}: result = {answer}; break;" for j, answer in enumerate(called.answers))
    lines = "\n".join(f"    {line}" for line in called.lines)
    main = f"""
uniform highp sampler2D vt_given;
out vec4 result;
{called.function}
void main() {{
    int row = int(gl_FragCoord.y);
{lines}
    switch (int(gl_FragCoord.x)) {{
{cases}
    }}
}}
"""
    read = {"vt_given": called.given, **textures(made)}
    drawn = browser.draw(f"#version 300 es\n{made.text}{main}", read, len(called.answers), len(called.given))
    return called.results(drawn.pixels), drawn.linking, drawn.drawing


def on_machine(case: Case, recording: Recording | None, made: Shader, machine: Machine) -> Results:
    """Results of the shader in the language of a machine."""
    called = program(case, recording, made, machine.printer)
    (answers,) = together([called], made.text, machine, textures(made))
    return called.results(answers)


def together(
    programs: Sequence[Program], text: str, machine: Machine, read: Mapping[str, np.ndarray], **options: Any
) -> list[np.ndarray]:
    """The answers of programs that take the same inputs, all in one."""
    given, size = programs[0].given, sum(len(each.answers) for each in programs)
    lines = [f"if (row < {len(given)}) {{", machine.printer.declared("int", "first", f"{size} * row")]
    ends: list[int] = []
    for each in programs:
        first = ends[-1] if ends else 0
        stored = [f"results[first + {first + k}] = {answer};" for k, answer in enumerate(each.answers)]
        lines += ["{", *each.lines, *stored, "}"]
        ends.append(first + len(each.answers))
    parts = [text, machine.declarations(len(given) * size), programs[0].function, machine.main([*lines, "}"]), ""]
    found = machine.run("\n".join(parts), len(given), size, {"vt_given": given, **read}, **options)
    return np.split(found, ends[:-1], axis=1)


def of_material(called: Program, machine: Machine, uv: str) -> Program:
    """The calls of a program, of what `vt_material` gives at texture coordinates."""
    *filled, last = [line for line in called.lines if "VtMaterial" not in line]
    return replace(called, lines=[*filled, machine.printer.declared("VtMaterial", "m", f"vt_material({uv})"), last])


@dataclass(frozen=True)
class Changeable:
    """A shader whose values change, of a kind of stack and a model that solves materials, on a machine."""

    made: Shader
    recording: Recording
    machine: Machine

    @classmethod
    def of(cls, stack: Stack, machine: Machine) -> Changeable:
        made = shader(stack, values="uniforms", printer=machine.printer)
        return cls(made, recording_of(made), machine)

    def given(self, case: Case) -> Results:
        """The results where the program is given the values and the solution of a case's stack."""
        assert isinstance(self.made.baked, SolvedLookUp)
        found = self.made.baked.solve(case.stack)
        arrays = {"vt_shown": np.ones(len(self.made.shown)), "vt_remainder": np.array(found.remainder)}
        if len(found.layout):
            arrays["vt_layout"] = np.array(found.layout)
        values = {
            material.place(at): np.broadcast_to(constant(at, x), 3 if at.colour else 1).tolist()
            for at, x in case.stack.values()
        }
        changing = Changing(material.structs(case.stack, list(self.recording.read)), values, arrays)
        fixed = replace(self.made, uniforms={})
        called = of_material(program(case, self.recording, fixed, self.machine.printer), self.machine, "wi.xy")
        read = {**textures(self.made), "vt_baked": found.texels}
        (answers,) = together([called], self.made.text, self.machine, read, changing=changing)
        return called.results(answers)


@dataclass(frozen=True)
class Differences:
    """The largest: absolute for energies, alphas and directions, relative for values and densities."""

    energy: float
    alpha: float
    value: float
    density: float
    drawn: float


def differences(truth: Results, found: Results) -> Differences:
    """Values and densities count where all roughnesses are at least .05; below what shows they count as nothing."""
    rough = (truth.alpha.reshape(-1, len(truth.density)) >= 0.05).all(axis=0)

    def relative(a: np.ndarray, b: np.ndarray) -> float:
        return float((np.abs(a - b) / np.maximum(np.abs(a), 1e-5))[..., rough].max(initial=0.0))

    def absolute(a: np.ndarray, b: np.ndarray) -> float:
        return float(np.abs(a - b).max(initial=0.0)) if a.size else 0.0  # of a material without lobes

    return Differences(
        absolute(truth.energy, found.energy),
        absolute(truth.alpha, found.alpha),
        relative(truth.value, found.value),
        relative(truth.density, found.density),
        float(np.quantile(np.abs(truth.drawn - found.drawn)[:, rough], 0.99)) if rough.any() else 0.0,
    )


def compare(
    pattern: Pattern,
    model: str,
    count: int,
    seed: int,
    by: Browser | Machine,
    films: bool = False,
    **switches: Any,
) -> Differences:
    """Random stacks of a pattern through both, with `films` or without."""
    case = random_case(pattern, count, np.random.default_rng(seed))
    case = coated(case) if films else case
    printer = by.printer if isinstance(by, Machine) else GLSL
    made = shader(case.stack, model, printer=printer, **switches)
    recording = recording_of(made)
    found = (
        on_machine(case, recording, made, by) if isinstance(by, Machine) else in_browser(case, recording, made, by)[0]
    )
    return differences(in_numpy(case, recording), found)


def read_back(stack: Stack, made: Shader, wi: np.ndarray, browser: Browser) -> np.ndarray:
    """Lobes that a shader with parameters has drawn, as it reads them: for each name in `shown`, energies and, but for
    a base, alphas and rotation, shape (lobes, 6, N)."""
    values = placed(stack, made)
    uniforms = {f"vt_parameters.{place}": value for place, value in values.items()}
    uniforms["vt_shown[0]"] = [1.0] * len(made.shown)
    answers = []
    for name in made.shown:
        alphas = "vec4(0.0)" if name == "base" else f"vec4(l.{name}.alpha_u, l.{name}.alpha_v, l.{name}.rotation, 0.0)"
        answers += [f"vec4(l.{'base_energy' if name == 'base' else f'{name}.energy'}, 0.0)", alphas]
    cases = "\n".join(f"        case {j}: result = {answer}; break;" for j, answer in enumerate(answers))
    main = f"""
uniform highp sampler2D inputs;
out vec4 result;

void main() {{
    vec3 wi = texelFetch(inputs, ivec2(0, int(gl_FragCoord.y)), 0).xyz;
    VtLobes l = vt_lobes(vt_material(vec2(0.0)), wi);
    switch (int(gl_FragCoord.x)) {{
{cases}
    }}
}}
"""
    textures = {"inputs": np.pad(wi.T, ((0, 0), (0, 1)))[:, None], "vt_baked": in_javascript(made, values, browser)}
    drawn = browser.draw(f"#version 300 es\n{made.text}{main}", textures, len(answers), wi.shape[1], uniforms)
    pairs = np.moveaxis(drawn.pixels.astype(float), 0, -1).reshape(len(made.shown), 2, 4, -1)
    return np.concatenate([pairs[:, 0, :3], pairs[:, 1, :3]], axis=1)


def placed(stack: Stack, made: Shader) -> dict[str, list[float]]:
    """The values of a stack by their place in the struct of its shader, as many as a uniform holds."""
    return {
        made.uniforms[address.name]: np.broadcast_to(constant(address, value), 3 if address.colour else 1).tolist()
        for address, value in stack.values()
        if address.name in made.uniforms
    }


def in_javascript(made: Shader, values: Mapping[str, list[float]], browser: Browser, quick: bool = False) -> np.ndarray:
    """The texture of lobes that the page works out, shape (height, width, 4), for values by place in the struct."""
    assert isinstance(made.baked, LobeLookUp)
    baked, known = made.baked.to_dict(), dict(tables.load().items())
    job = {
        "baked": baked,
        "tables": {name: messages.array(known[name].data) for name in baked["tables"]},
        "values": {place: value[0] if len(value) == 1 else value for place, value in values.items()},
        "quick": quick,
    }
    browser.page.evaluate(viewport.script("export * from './render/bake.js'; export * from './arrays.js';") + ";1")
    found = browser.page.evaluate(_BAKE, job)
    return np.array(found["texels"], np.float32).reshape(found["height"], found["width"], 4)


_BAKE = """
({ baked, tables, values, quick }) => {
  const decoded = Object.entries(tables).map(([name, table]) => [name, page.decode(table)]);
  const made = new page.Bake(baked, Object.fromEntries(decoded));
  return { texels: [...made.draw(values, quick)], height: made.height, width: made.width };
}
"""


def _random_layer(kind: str, shape: str, count: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    def colour(low: float, high: float) -> np.ndarray:
        return rng.uniform(low, high, (3, count))

    if kind == S:
        return {
            "depth": rng.uniform(0, 1, count),
            "sigma_a": colour(0, 1),
            "sigma_s": colour(0, 1),
            "g": rng.uniform(-0.9, 0.95, count),
        }
    if kind == L:
        return {"albedo": colour(0, 1)}
    alpha_u = rng.uniform(0.01, ROOT_ALPHA_MAX, count) ** 2
    alpha_v = alpha_u if shape == "round" else rng.uniform(0.01, ROOT_ALPHA_MAX, count) ** 2
    rotation = rng.uniform(-180, 180, count) if shape == "turned" else np.zeros(count)
    surface = {"alpha_u": alpha_u, "alpha_v": alpha_v, "rotation": rotation}
    if kind == M:
        return surface
    if kind == C:
        return {"eta": colour(0.1, 3), "k": colour(0, 5), **surface}
    return {"eta": rng.uniform(1.05, 2.5, count) + rng.uniform(-0.04, 0.04, (3, count)), **surface}


def _direction(count: int, rng: np.random.Generator, below: bool) -> np.ndarray:
    z, phi = rng.uniform(0.02, 1, count), rng.uniform(0, 2 * np.pi, count)
    side = np.where(rng.random(count) < 0.5, -1, 1) if below else 1
    sine = np.sqrt(1 - z * z)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), side * z])


def _first(value: np.ndarray) -> Any:
    return tuple(value[:, 0].tolist()) if value.ndim == 2 else float(value[0])


def _mirrors(kinds: tuple[str, ...]) -> dict[str, str]:
    return {f"layer{i}_conductor": "mirror" for i, kind in enumerate(kinds) if kind == M}


def _reading(case: Case, made: Shader, printer: CLike) -> tuple[np.ndarray, list[str]]:
    """A texture with all inputs of a stack in a row, and the statements that read them."""
    columns: list[np.ndarray] = []
    lines = []
    places = {f"m.{place}": case.values[name] for name, place in made.uniforms.items()}
    for place, value in {**places, **case.directions}.items():
        channels = [f"vt_read({len(columns) + k}, row)" for k in range(len(np.atleast_2d(value)))]
        columns += list(np.atleast_2d(value))
        text = channels[0] if len(channels) == 1 else printer.colour(channels)
        lines.append(printer.put(place, text) if place in places else printer.named(place, "colour", text))
    texels = np.stack([*columns, *[np.zeros_like(columns[0])] * (-len(columns) % 4)], axis=-1)
    return texels.reshape(len(columns[0]), -1, 4), lines
