"""GLSL ES 3.00."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from itertools import groupby
from math import inf
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from velatura.shader.atlas import WIDTH, Layout, height
from velatura.shader.bake import Bake, Group
from velatura.shader.cost import Cost
from velatura.shader.films import WIDTH as LINE_OF_FILMS
from velatura.shader.material import PARAMETERS, Brushed, Entry, Filled, Mapped
from velatura.shader.printer import ATOM, Field, Output, Printer, Struct
from velatura.shader.statements import assignments, statements
from velatura.shader.symbol import LAYOUT, REMAINDER, SHOWN, Kind, Operand, Symbol

if TYPE_CHECKING:  # it loads SciPy
    from velatura.shader.solved import Tabulated

LINE = 120  # characters of declarations

_TYPES: dict[str, str] = {"number": "float", "colour": "vec3", "condition": "bool", "conditions": "bvec3"}
_COMPARE = {"less": "lessThan", "greater": "greaterThan", "at_most": "lessThanEqual", "at_least": "greaterThanEqual"}
_FUNCTIONS = {
    "exp": "exp",
    "log": "log",
    "sin": "vt_sin",
    "cos": "vt_cos",
    "sqrt": "vt_sqrt",
    "absolute": "abs",
    "mean": "vt_mean",
    "power": "pow",
    "arctan2": "atan",
    "minimum": "min",
    "maximum": "max",
    "clip": "clamp",
}
_OPERATORS = {  # with how strongly they bind
    "add": ("+", 5),
    "subtract": ("-", 5),
    "multiply": ("*", 6),
    "divide": ("/", 6),
    "less": ("<", 3),
    "greater": (">", 3),
    "at_most": ("<=", 3),
    "at_least": (">=", 3),
    "both": ("&&", 2),
}
# Words of the language, and functions that statements call
_WORDS = """
    abs acos active all any asin asm atan attribute break case cast class clamp coherent common const continue cos
    cross default degrees discard distance do dot else enum exp extern external false far filter fixed flat float
    floor for fract goto greaterThan greaterThanEqual half highp if in inline inout input int interface invariant
    layout length lessThan lessThanEqual log long lowp main max mediump min mix mod namespace near noinline noise
    normalize not out output partition patch place pow precision public radians reflect refract resource return row
    sample sampler short sign sin sizeof smooth sqrt static step struct superp switch tan template texel texels
    texture this true typedef uniform union unsigned using varying void volatile while
"""


class Glsl(Printer):
    """GLSL ES 3.00, which WebGL 2 reads."""

    words = frozenset(_WORDS.split())
    functions = _FUNCTIONS
    operators = _OPERATORS

    # Values

    def literal(self, x: Operand) -> str:
        if isinstance(x, tuple):
            return self.colour([self.literal(channel) for channel in x])
        if isinstance(x, bool):
            return "true" if x else "false"
        assert not isinstance(x, Symbol)
        text = str(np.float32(x))
        return text if "." in text or "e" in text else f"{text}.0"

    def colour(self, channels: Sequence[str]) -> str:
        return f"vec3({', '.join(channels)})"

    def component(self, x: str, channel: int, kind: Kind) -> str:
        texel, channel = divmod(channel, 4)
        return f"{x}{f'[{texel}]' if kind == 'texels' else ''}.{'rgba'[channel]}"

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"vt_both(bvec3({a}), bvec3({b}))" if op == "both" else f"{_COMPARE[op]}({a}, {b})"

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"vt_choice({condition}, {a}, {b})", ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"mix({b}, {a}, {conditions})"

    def value(self, table: str, args: Sequence[str], wide: bool) -> str:
        return f"vt_{table}({', '.join(args)})"

    def film(self, table: str, args: Sequence[str]) -> str:
        return f"vt_{table}({', '.join(args)})"

    # Statements

    def title(self, text: str) -> str:
        return f"// {text}"

    def named(self, name: str, kind: Kind, text: str) -> str:
        return f"{_TYPES[kind]} {name} = {text};"

    def texels(self, name: str, table: str, count: int, args: Sequence[str]) -> list[str]:
        return [f"vec4[{count}] {name} = vt_{table}({', '.join(args)});"]

    def baked(self, name: str, group: Group, place: Sequence[str]) -> list[str]:
        first = f"{group.begin} + i" if group.begin else "i"
        read = f"vt_baked_texel({first}, {self.colour(place)})"
        return [f"vec4 {name}[{group.texels}];", f"for (int i = 0; i < {group.texels}; i++) {name}[i] = {read};"]

    def nodes(self, name: str, nodes: Sequence[float]) -> list[str]:
        listed = f"float[{len(nodes)}]({', '.join(map(self.literal, nodes))})"
        return [f"const float {name}[{len(nodes)}] = {listed};"]

    def results(self, name: str, kind: Kind, count: int) -> list[str]:
        return [f"{_TYPES[kind]} {name}[{count}];"]

    def state(self, name: str, following: str, kind: Kind, begin: Sequence[str]) -> list[str]:
        array = f"{_TYPES[kind]}[{len(begin)}]"
        return [f"{_TYPES[kind]} {name}[{len(begin)}] = {array}({', '.join(begin)}), {following}[{len(begin)}];"]

    def loop(self, index: str, times: int, lines: Sequence[str]) -> list[str]:
        return _block(f"for (int {index} = 0; {index} < {times}; {index}++)", lines)

    def store(self, array: str, place: str, text: str) -> str:
        return f"{array}[{place}] = {text};"

    def put(self, place: str, text: str) -> str:
        return f"{place} = {text};"

    def advance(self, name: str, following: str) -> str:
        return f"{name} = {following};"

    # Programs

    def header(self, name: str, model: str, fixed: bool, costs: Mapping[str, Cost]) -> str:
        filled = "" if fixed else "        // or from uniforms, or your own textures"
        spent = [f"//     {function}: {cost}" for function, cost in costs.items()]
        return _HEADER.format(name=name, model=model, filled=filled, costs="\n".join(spent))

    def structs(self, structs: Sequence[Struct]) -> str:
        return "".join(
            "\n".join([f"struct {struct.name} {{ // {struct.comment}", *_members(struct.fields), "};", ""])
            for struct in structs
        )

    def parameters(self, shown: int, remainder: int, layout: int) -> str:
        arrays = ("float", SHOWN, shown), ("vec3", REMAINDER, remainder), ("float", LAYOUT, layout)
        declared = (f"uniform {kind} {name}[{length}];\n" for kind, name, length in arrays if length)
        return f"uniform VtMaterial {PARAMETERS};\n\n{''.join(declared)}"

    def material(self, filled: Filled) -> str:
        samplers = [
            f"uniform sampler2D {name}; // {image.texture}{', to be decoded from sRGB' * (image.encoding == 'srgb')}\n"
            for name, image in filled.samplers.items()
        ]
        begin = f"VtMaterial m = {PARAMETERS};" if filled.parameters else "VtMaterial m;"
        lines = [f"m.{entry.place} = {self._entry(entry)};" for entry in filled.entries]
        return "".join([*samplers, _function("VtMaterial vt_material(vec2 uv)", [begin, *lines, "return m;"])])

    def _entry(self, entry: Entry) -> str:
        value, literal = entry.value, self.literal
        if isinstance(value, Brushed):
            centre = f"uv.y - {literal(value.v)}, uv.x - {literal(value.u)}"
            return f"degrees(atan({centre})) + {literal(value.offset)}"
        if not isinstance(value, Mapped):
            return literal(value) if isinstance(value, tuple) or not entry.wide else self.colour([literal(value)])
        texel = f"texture({value.sampler}, uv).{value.channel} * {literal(value.scale)} + {literal(value.offset)}"
        low, high = literal(max(value.low, -1e6)), literal(value.high)
        bounded = f"max({texel}, {low})" if value.high == inf else f"clamp({texel}, {low}, {high})"
        return self.colour([bounded]) if entry.wide and value.channel != "rgb" else bounded

    def tables(self, layouts: Sequence[Layout]) -> str:
        return "\n".join([_TABLES.format(WIDTH, height(layouts)), _TEXELS + "".join(map(_table, layouts))])

    def lookup(self, bake: Bake | Tabulated) -> str:
        return _BAKED[len(bake.nodes)].format(*bake.nodes, sides=bake.sides, height=bake.height)

    def films(self, layouts: Sequence[Layout]) -> str:
        height = -(-layouts[-1].end // LINE_OF_FILMS)
        return _FILMS.format(LINE_OF_FILMS, height) + "".join(map(_film, layouts))

    def helpers(self, called: Set[tuple[str, Kind]]) -> str:
        parts = []
        for comment, helpers in _HELPERS.items():
            texts = [text for ops, text in helpers.items() if any(op in called for op in ops)]
            parts += ["".join([f"// {comment}\n" if comment else "", *texts])] if texts else []
        return "\n".join(parts)

    def lobes(self, outputs: Mapping[str, Output]) -> str:
        lines = assignments({f"l.{name}": output for name, output in outputs.items()}, self)
        return _function("VtLobes vt_lobes(VtMaterial m, vec3 wi)", ["VtLobes l;", *lines, "return l;"])

    def energies(self, found: Sequence[Output]) -> str:
        lines, texts = statements(found, self)
        array = f"vec3[{len(found)}]"
        return _function(
            f"{array} vt_energies(VtMaterial m, vec3 wi)", [*lines, f"return {array}({', '.join(texts)});"]
        )

    def eval_pdf(self, value: Output, density: Output) -> str:
        lines, texts = statements([value, density], self)
        head = "vec4 vt_eval_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo)"
        return "\n".join([_function(head, [*lines, f"return vec4({', '.join(texts)});"]), _WRAPPERS])

    def sample(self, drawn: Sequence[Output]) -> str:
        lines, texts = statements(drawn, self)
        head = "vec3 vt_sample(VtMaterial m, VtLobes l, vec3 wi, vec3 u)"
        return _function(head, [*lines, f"return {self.colour(texts)};"])


#: The language that shaders are printed in by default.
GLSL = Glsl()


def _block(head: str, lines: Sequence[str]) -> list[str]:
    return [f"{head} {{", *(f"    {line}".rstrip() for line in lines), "}"]


def _function(head: str, lines: Sequence[str]) -> str:
    return "\n".join([*_block(head, lines), ""])


def _members(fields: Sequence[Field]) -> list[str]:
    """Declarations of a struct's fields; those of one type that follow one another share lines."""
    lines = []
    for kind, each in groupby(fields, lambda field: _TYPES.get(field.type, field.type)):
        names = ", ".join(f"{name}[{length}]" if length else name for name, _, length in each)
        lines += wrap(f"{kind} {names};", LINE, initial_indent="    ", subsequent_indent="        ")
    return lines


def _table(layout: Layout) -> str:
    """A function of the coordinates; it loops over texels, which compiles faster than reading them one by one."""
    name, start, nodes, channels = layout
    axes = "xyz"[: len(nodes)]
    size, at = f"ivec{len(nodes)}({', '.join(map(str, nodes))})", f"vec{len(nodes)}({', '.join(axes)})"
    arguments = ", ".join(f"float {axis}" for axis in axes)
    described = f"\n// {' x '.join(map(str, nodes))} nodes, {channels} channel{'s' * (channels > 1)}\n"
    if channels == 1:
        each = f"vt_{name}({', '.join(f'{axis}[c]' for axis in axes)})"
        lines = ["vec3 colour;", f"for (int c = 0; c < 3; c++) colour[c] = {each};", "return colour;"]
        single = _function(f"float vt_{name}({arguments})", [f"return vt_volume({start}, {size}, {at});"])
        return described + single + _function(f"vec3 vt_{name}({arguments.replace('float', 'vec3')})", lines)
    count = layout.texels
    read = f"vt_{'plane' if len(nodes) == 2 else 'space'}({start}, {size}, {count}, i, {at})"
    lines = [f"vec4 texels[{count}];", f"for (int i = 0; i < {count}; i++) texels[i] = {read};", "return texels;"]
    return described + _function(f"vec4[{count}] vt_{name}({arguments})", lines)


def _film(layout: Layout) -> str:
    name, start, nodes, _ = layout
    if len(nodes) == 1:
        return f"vec3 vt_{name}(float x) {{ return vt_film_line({start}, {nodes[0]}, x); }}\n"
    return f"vec3 vt_{name}(float x, float y) {{ return vt_film_plane({start}, ivec2{nodes}, vec2(x, y)); }}\n"


_HEADER = """\
// {name} as the model {model} has it; GLSL ES 3.00, written by Velatura.
//
//     VtMaterial m = vt_material(uv);{filled}
//     VtLobes l = vt_lobes(m, wi);           // once for a direction of view
//     vec4 f = vt_eval_pdf(m, l, wi, wo);    // f(wi, wo) |cos theta_o|, and the density of vt_sample
//     vec3 wo = vt_sample(m, l, wi, u);      // from three uniform numbers; f may be 0 there
//
// Directions have length 1 and point away from the surface, in its frame: x along the tangent, z the normal.
// `velatura export -o` writes the textures that are read beside this text, row by row.
//
// What a call costs, colours being three numbers and elementary functions four operations:
{costs}

precision highp float;
precision highp int;
"""

_WRAPPERS = """\
// f(wi, wo) |cos theta_o|, and the density of vt_sample per solid angle
vec3 vt_eval(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) { return vt_eval_pdf(m, l, wi, wo).rgb; }
float vt_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) { return vt_eval_pdf(m, l, wi, wo).a; }
"""

_TABLES = """\
// Averages of Fresnel over rough interfaces: RGBA32F, {} x {} texels, never filtered.
uniform highp sampler2D vt_tables;
"""

_TEXELS = f"""\
vec4 vt_texel(int i) {{
    return texelFetch(vt_tables, ivec2(i & {WIDTH - 1}, i >> {WIDTH.bit_length() - 1}), 0);
}}

float vt_float(int i) {{
    vec4 texel = vt_texel(i >> 2);
    return texel[i & 3];
}}

// One texel of the nodes of a plane, interpolated in single precision, which filters of textures do not have
vec4 vt_plane(int start, ivec2 nodes, int texels, int texel, vec2 at) {{
    vec2 position = clamp(at, 0.0, 1.0) * vec2(nodes - 1);
    ivec2 cell = min(ivec2(position), nodes - 2);
    vec2 upper = position - vec2(cell);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; k++) {{
        ivec2 corner = ivec2(k >> 1, k & 1), node = cell + corner;
        vec2 weight = mix(1.0 - upper, upper, vec2(corner));
        sum += weight.x * weight.y * vt_texel(start + (node.x * nodes.y + node.y) * texels + texel);
    }}
    return sum;
}}

// The same in space
vec4 vt_space(int start, ivec3 nodes, int texels, int texel, vec3 at) {{
    vec3 position = clamp(at, 0.0, 1.0) * vec3(nodes - 1);
    ivec3 cell = min(ivec3(position), nodes - 2);
    vec3 upper = position - vec3(cell);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 8; k++) {{
        ivec3 corner = ivec3(k >> 2, (k >> 1) & 1, k & 1), node = cell + corner;
        vec3 weight = mix(1.0 - upper, upper, vec3(corner));
        int i = ((node.x * nodes.y + node.y) * nodes.z + node.z) * texels + texel;
        sum += weight.x * weight.y * weight.z * vt_texel(start + i);
    }}
    return sum;
}}

// The same for one number a node, four of them in a texel
float vt_volume(int start, ivec3 nodes, vec3 at) {{
    vec3 position = clamp(at, 0.0, 1.0) * vec3(nodes - 1);
    ivec3 cell = min(ivec3(position), nodes - 2);
    vec3 upper = position - vec3(cell);
    float sum = 0.0;
    for (int k = 0; k < 8; k++) {{
        ivec3 corner = ivec3(k >> 2, (k >> 1) & 1, k & 1), node = cell + corner;
        vec3 weight = mix(1.0 - upper, upper, vec3(corner));
        int i = (node.x * nodes.y + node.y) * nodes.z + node.z;
        sum += weight.x * weight.y * weight.z * vt_float(4 * start + i);
    }}
    return sum;
}}
"""

_BAKED = {
    1: """\
// The lobes over direction: RGBA32F, {0} x {height} texels, never filtered
uniform highp sampler2D vt_baked;

vec4 vt_baked_texel(int texel, vec3 place) {{
    float position = clamp(place.x, 0.0, 1.0) * float({0} - 1);
    int node = min(int(position), {0} - 2), line = {sides} * texel + int(place.z);
    vec4 a = texelFetch(vt_baked, ivec2(node, line), 0), b = texelFetch(vt_baked, ivec2(node + 1, line), 0);
    return mix(a, b, position - float(node));
}}
""",
    2: """\
// The lobes over direction: RGBA32F, {0} x {height} texels, never filtered
uniform highp sampler2D vt_baked;

vec4 vt_baked_texel(int texel, vec3 place) {{
    vec2 position = clamp(place.xy, 0.0, 1.0) * vec2({0} - 1, {1} - 1);
    ivec2 node = min(ivec2(position), ivec2({0}, {1}) - 2);
    ivec2 at = node + ivec2(0, ({sides} * texel + int(place.z)) * {1});
    vec2 upper = position - vec2(node);
    vec4 a = texelFetch(vt_baked, at, 0), b = texelFetch(vt_baked, at + ivec2(1, 0), 0);
    vec4 c = texelFetch(vt_baked, at + ivec2(0, 1), 0), d = texelFetch(vt_baked, at + 1, 0);
    return mix(mix(a, b, upper.x), mix(c, d, upper.x), upper.y);
}}
""",
}

_FILMS = """\
// Thin films: reflectances over the cosine, averages over direction and roughness.
// RGBA32F, {0} x {1} texels, never filtered.
uniform highp sampler2D vt_films;

vec3 vt_film_texel(int i) {{ return texelFetch(vt_films, ivec2(i % {0}, i / {0}), 0).rgb; }}

vec3 vt_film_line(int start, int nodes, float at) {{
    float position = clamp(at, 0.0, 1.0) * float(nodes - 1);
    int node = min(int(position), nodes - 2);
    return mix(vt_film_texel(start + node), vt_film_texel(start + node + 1), position - float(node));
}}

vec3 vt_film_plane(int start, ivec2 nodes, vec2 at) {{
    float position = clamp(at.x, 0.0, 1.0) * float(nodes.x - 1);
    int node = min(int(position), nodes.x - 2);
    vec3 a = vt_film_line(start + node * nodes.y, nodes.y, at.y);
    return mix(a, vt_film_line(start + (node + 1) * nodes.y, nodes.y, at.y), position - float(node));
}}

"""

_SINE = """\
{0} vt_sin({0} x) {{
    {0} turns = round(x / 3.14159265), y = (x - turns * 3.140625) - turns * 9.67653590e-4, z = y * y;
    {0} odd = 1.0 - 2.0 * mod(turns, 2.0);
    {0} series = 1.0 / 120.0 - z * (1.0 / 5040.0 - z * (1.0 / 362880.0 - z / 39916800.0));
    return odd * (y - y * z * (1.0 / 6.0 - z * series));
}}
"""

# Functions by the operations that call them, under a comment
_HELPERS: dict[str, dict[tuple[tuple[str, Kind], ...], str]] = {
    "": {
        (("sqrt", "number"),): "float vt_sqrt(float x) { return sqrt(max(x, 0.0)); }\n",
        (("sqrt", "colour"),): "vec3 vt_sqrt(vec3 x) { return sqrt(max(x, 0.0)); }\n",
        (("mean", "number"),): "float vt_mean(vec3 x) { return (x.r + x.g + x.b) / 3.0; }\n",
        (
            ("both", "conditions"),
        ): "bvec3 vt_both(bvec3 a, bvec3 b) { return bvec3(a.x && b.x, a.y && b.y, a.z && b.z); }\n",
    },
    "Drivers may leave sine and cosine with errors of 2e-4; this series is as good as single precision": {
        (("sin", "number"), ("cos", "number")): _SINE.format("float"),
        (("sin", "colour"), ("cos", "colour")): _SINE.format("vec3"),
        (("cos", "number"),): "float vt_cos(float x) { return vt_sin(x + 1.57079633); }\n",
        (("cos", "colour"),): "vec3 vt_cos(vec3 x) { return vt_sin(x + 1.57079633); }\n",
    },
    "Without branches, of which compilers for processors make much": {
        (("select", "number"),): "float vt_choice(bool where, float a, float b) { return mix(b, a, where); }\n",
        (("select", "colour"),): "vec3 vt_choice(bool where, vec3 a, vec3 b) { return mix(b, a, bvec3(where)); }\n",
        (
            ("select", "condition"),
        ): "bool vt_choice(bool where, bool a, bool b) { return (where && a) || (!where && b); }\n",
    },
}
