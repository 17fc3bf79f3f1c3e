"""Text that shader languages of C's kind share, in the words of each.

Text that is the same in all of them is written in GLSL here; `CLike.spelled` gives it in the words of another. So that
this takes no parser, functions have names of their own for colours (`vt_sqrt3`), and return no arrays.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from itertools import groupby
from math import inf
from textwrap import wrap
from typing import ClassVar

import numpy as np

from velatura.errors import remark
from velatura.shader.lookups.atlas import WIDTH, TableLayout
from velatura.shader.lookups.films import WIDTH as LINE_OF_FILMS
from velatura.shader.lookups.lookup import Group, LookUp
from velatura.shader.material import PARAMETERS, Brushed, Entry, Filled, Mapped
from velatura.shader.printers.printer import FUNCTIONS, Field, Member, Output, Printer, Struct
from velatura.shader.printers.statements import assignments, statements
from velatura.shader.recorder.cost import Cost
from velatura.shader.recorder.symbol import Kind, Operand, Symbol
from velatura.stack import Texture

#: Places of what a program is given, counted from the first binding.
TABLES, FILMS, VALUES, SAMPLER, MAPS = range(5)

LINE = 120  # characters of declarations

_KINDS: dict[str, str] = {"number": "float", "colour": "vec3", "condition": "bool", "conditions": "bvec3"}
_OWN = ("sin", "cos", "sqrt")  # functions of our own, with one for colours each
# Words of GLSL, HLSL, Slang and WGSL, and functions that statements call
_WORDS = """
    abs abstract acos active alias all any array as asin asm associatedtype async atan atan2 attribute auto await
    become bool break buffer case cast catch cbuffer centroid clamp class clip coherent column_major common compile
    compile_fragment concept const const_assert const_cast consteval constexpr constinit constructor continue
    continuing cos crate cross debugger decltype default defer degrees delete demote_to_helper diagnostic discard
    distance do dot dword dynamic_cast each else enable enum exp expand explicit export extends extension extern
    external fallthrough false far filter final finally fixed flat float floor fma fn for frac fract friend from
    func get globallycoherent goto greaterThan greaterThanEqual groupshared half handle highp hlsl if impl
    implements import in init inline inout input instanceof int interface internal invariant is layout lazy length
    lerp lessThan lessThanEqual let line lineadj linear lod log long loop lowp macro macro_rules main match matrix
    max mediump meta min mix mod module move mut mutable namespace near new nil no_diff noexcept noinline
    nointerpolation noise none noperspective normalize not null nullptr of on operator optional out output override
    package packoffset partition pass patch pixelfragment place point pow precise precision premerge priv private
    property protected pub public radians ref reflect refract regardless register reinterpret_cast require requires
    resource restrict return row row_major sample sampler saturate select self set shared short sign signed sin
    sizeof smooth snorm sqrt static static_assert static_cast std step struct subroutine super superp switch sync
    tan target tbuffer template texel texels texture this thread_local throw throwing trait triangle triangleadj
    true try type typealias typedef typeid typename typeof uniform union unless unorm unsafe unsigned unsized use
    using var varying vector virtual void volatile wgsl where while with writeonly yield
"""


@dataclass(frozen=True)
class CLike(Printer):
    """A language of C's kind; a dialect states its differences.

    `group` and `binding` are where the first of what the program is given is bound, in languages that say so; textures
    hold halves of floats where it is `half`.

    Attributes:
        language: its name.
        first_lines: required before all else.
    """

    group: int = 0
    binding: int = 0
    half: bool = False

    language: ClassVar[str]
    first_lines: ClassVar[str] = ""
    words = frozenset(_WORDS.split())
    branches: ClassVar[bool] = True
    functions: ClassVar[Mapping[str, str]] = FUNCTIONS | {op: f"vt_{op}" for op in _OWN}

    # Stated by each dialect

    def spelled(self, text: str) -> str:
        """Text in GLSL, in this language."""
        return text

    @abstractmethod
    def listed(self, kind: str, values: Sequence[str]) -> str:
        """The values of an array."""

    @abstractmethod
    def texture(self, name: str, place: int) -> str:
        """The declaration of a texture of four floats."""

    def sampler(self) -> str:
        """The declaration of what filters textures of a material, if that is not part of each."""
        return ""

    @abstractmethod
    def filtered(self, name: str) -> str:
        """A texture of a material at `uv`: four floats."""

    @abstractmethod
    def uniforms(self, material: str, arrays: Sequence[tuple[str, str, int]]) -> str:
        """The declaration of values that change: a struct, and arrays of a type in GLSL, a name and a length."""

    def declared(self, kind: str, name: str, text: str = "") -> str:
        """A value, or a struct to be filled, gets a name; of a kind, or of a type in GLSL."""
        return f"{self.type(kind)} {name} = {text};" if text else f"{self.type(kind)} {name};"

    def array(self, kind: str, name: str, values: Sequence[str] | int, constant: bool = False) -> str:
        """An array of values, or one that is filled later."""
        if isinstance(values, int):
            return f"{self.type(kind)} {name}[{values}];"
        return f"{'const ' * constant}{self.type(kind)} {name}[{len(values)}] = {self.listed(kind, values)};"

    def struct(self, struct: Struct) -> str:
        return "\n".join([f"struct {struct.name} {{ // {struct.comment}", *self.members(struct.fields), "};", ""])

    def members(self, fields: Sequence[Field]) -> list[str]:
        """Declarations of fields; those of one type that follow one another share lines."""
        lines = []
        for kind, each in groupby(fields, lambda field: self.type(field.type)):
            names = ", ".join(f"{name}[{length}]" if length else name for name, _, length in each)
            lines += wrap(f"{kind} {names};", LINE, initial_indent="    ", subsequent_indent="        ")
        return lines

    @property
    def texels_of(self) -> str:
        """The format of textures that are never filtered."""
        return "RGBA16F" if self.half else "RGBA32F"

    def type(self, kind: str) -> str:
        return self.spelled(_KINDS.get(kind, kind))

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
        return f"{self.type('colour')}({', '.join(channels)})"

    def component(self, x: str, channel: int, kind: Kind) -> str:
        texel, channel = divmod(channel, 4)
        return f"{x}{f'[{texel}]' if kind == 'texels' else ''}.{'rgba'[channel]}"

    def call(self, op: str, args: Sequence[str], wide: bool) -> str:
        if wide and op == "clip":
            args = [args[0], *(self.colour([x]) for x in args[1:])]
        return f"{self.functions[op]}{'3' if wide and op in _OWN else ''}({', '.join(args)})"

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"vt_both({a}, {b})" if op == "both" else f"({a} {self.operators[op][0]} {b})"

    def value(self, table: str, args: Sequence[str], wide: bool) -> str:
        return f"vt_{table}{'3' if wide else ''}({', '.join(args)})"

    def film(self, table: str, args: Sequence[str]) -> str:
        return f"vt_{table}({', '.join(args)})"

    # Statements

    def named(self, name: str, kind: Kind, text: str) -> str:
        return self.declared(kind, name, text)

    def texels(self, name: str, table: str, count: int, args: Sequence[str], where: str = "") -> list[str]:
        return self._filled(name, count, f"vt_{table}({self.counter(name)}, {', '.join(args)})", where)

    def baked(self, name: str, group: Group, place: Sequence[str]) -> list[str]:
        first = f"{group.begin} + {self.counter(name)}" if group.begin else self.counter(name)
        return self._filled(name, group.texels, f"vt_baked_texel({first}, {self.colour(place)})")

    def all_of(self, conditions: Sequence[tuple[tuple[str, Kind], bool]]) -> str:
        def held(text: str, kind: Kind, holds: bool) -> str:
            whole = text if kind == "condition" else f"{'any' if holds else 'all'}({text})"
            return whole if holds else f"!{whole}"

        return " && ".join(held(*each, holds) for each, holds in conditions)

    def looked_up(self, name: str, kind: Kind, text: str, where: str) -> list[str]:
        zero = "0.0" if kind == "number" else self.colour(["0.0"])
        return [self.variable(kind, name, zero), f"if ({where}) {{ {name} = {text}; }}"]

    def variable(self, kind: str, name: str, text: str) -> str:
        """A value that may change gets a name."""
        return self.declared(kind, name, text)

    def counter(self, array: str) -> str:
        """The counter of a loop that fills an array of texels."""
        return "texel"

    def _filled(self, name: str, count: int, text: str, where: str = "") -> list[str]:
        """An array of texels, filled in a loop, which compiles faster than reading them one by one."""
        counter = self.counter(name)
        head, own = self.spelled(f"for (int {counter} = 0; {counter} < {count}; {counter}++)"), f"{name}[{counter}]"
        if not where:
            return [self.array("vec4", name, count), f"{head} {{ {own} = {text}; }}"]
        zero = f"{self.type('vec4')}(0.0, 0.0, 0.0, 0.0)"
        body = [f"{own} = {zero};", f"if ({where}) {{ {own} = {text}; }}"]
        return [self.array("vec4", name, count), *_block(head, body)]

    def nodes(self, name: str, nodes: Sequence[float]) -> list[str]:
        return [self.array("number", name, list(map(self.literal, nodes)), constant=True)]

    def results(self, name: str, kind: Kind, count: int) -> list[str]:
        return [self.array(kind, name, count)]

    def state(self, name: str, following: str, kind: Kind, begin: Sequence[str]) -> list[str]:
        return [self.array(kind, name, begin), self.array(kind, following, len(begin))]

    def loop(self, index: str, times: int, lines: Sequence[str]) -> list[str]:
        return _block(self.spelled(f"for (int {index} = 0; {index} < {times}; {index}++)"), lines)

    def advance(self, name: str, following: str) -> str:
        return f"{name} = {following};"

    # Programs

    def header(self, name: str, model: str, fixed: bool, costs: Mapping[str, Cost]) -> str:
        filled = "" if fixed else "or from uniforms, or your own textures"
        spent = [f"//     {function}: {cost}" for function, cost in costs.items()]
        text = _HEADER.format(name=name, model=model, language=self.language)
        calls = ((self.spelled(code), comment.format(filled=filled)) for code, comment in _USAGE.items())
        usage = "".join(f"//     {code:38} // {comment}".rstrip(" /") + "\n" for code, comment in calls)
        first = f"\n{self.first_lines}" if self.first_lines else ""
        return "".join([text, usage, _COSTS.format(costs="\n".join(spent)), first])

    def structs(self, structs: Sequence[Struct]) -> str:
        return "".join(map(self.struct, structs))

    def parameters(self, arrays: Sequence[tuple[str, str, int]]) -> str:
        return self.uniforms(PARAMETERS, [(_KINDS[kind], name, length) for kind, name, length in arrays])

    def material(self, filled: Filled) -> str:
        maps = [
            f"// {_described(image)}\n" + self.texture(name, MAPS + k)
            for k, (name, image) in enumerate(filled.samplers.items())
        ]
        begin = self.variable("VtMaterial", "m", self.input(PARAMETERS) if filled.parameters else "")
        lines = [f"m.{entry.place} = {self._entry(entry)};" for entry in filled.entries]
        made = self._function("VtMaterial vt_material(vec2 uv)", [begin, *lines, "return m;"])
        return "".join([*maps, self.sampler() if maps else "", made])

    def _entry(self, entry: Entry) -> str:
        value, literal = entry.value, self.literal
        if isinstance(value, Brushed):
            centre = f"uv.y - {literal(value.v)}, uv.x - {literal(value.u)}"
            return f"degrees({self.functions['arctan2']}({centre})) + {literal(value.offset)}"
        if not isinstance(value, Mapped):
            return literal(value) if isinstance(value, tuple) or not entry.wide else self.colour([literal(value)])
        texel = f"{self.filtered(value.sampler)}.{value.channel} * {literal(value.scale)} + {literal(value.offset)}"
        wide = value.channel == "rgb"
        low, high = (self.colour([x]) if wide else x for x in (literal(max(value.low, -1e6)), literal(value.high)))
        bounded = f"max({texel}, {low})" if value.high == inf else f"clamp({texel}, {low}, {high})"
        return self.colour([bounded]) if entry.wide and not wide else bounded

    def tables(self, layouts: Sequence[TableLayout]) -> str:
        declared = _TABLES.format(self.texels_of, WIDTH) + self.texture("vt_tables", TABLES)
        return f"{declared}\n{self.spelled(_TEXELS + ''.join(map(_table, layouts)))}"

    def baked_texture(self, width: int, height: int) -> str:
        kilobytes = round(width * height * (8 if self.half else 16) / 1000)
        return _LOBES.format(self.texels_of, width, height, kilobytes) + self.texture("vt_baked", TABLES)

    def lookup(self, bake: LookUp, first: int) -> str:
        line = f"y + {first}" if first else "y"
        return self.spelled(_BAKED[len(bake.nodes)].format(*bake.nodes, sides=bake.sides, line=line))

    def films(self, layouts: Sequence[TableLayout]) -> str:
        height = -(-layouts[-1].end // LINE_OF_FILMS)
        declared = _FILMS.format(self.texels_of, LINE_OF_FILMS, height) + self.texture("vt_films", FILMS)
        return f"{declared}\n{self.spelled(_OF_FILMS.format(LINE_OF_FILMS) + ''.join(map(_film, layouts)))}"

    #: Functions by the operations that call them, under a comment; in GLSL.
    helping: ClassVar[Mapping[str, Mapping[tuple[tuple[str, Kind], ...], str]]]

    def helpers(self, called: Set[tuple[str, Kind]]) -> str:
        parts = []
        for comment, helpers in {**_HELPERS, **self.helping}.items():
            texts = [self.spelled(text) for ops, text in helpers.items() if any(op in called for op in ops)]
            parts += ["".join([f"// {comment}\n" if comment else "", *texts])] if texts else []
        return "\n".join(parts)

    def lobes(self, outputs: Mapping[str, Output]) -> str:
        lines = assignments({f"l.{name}": output for name, output in outputs.items()}, self)
        begin = self.declared("VtLobes", "l")
        return self._function("VtLobes vt_lobes(VtMaterial m, vec3 wi)", [begin, *lines, "return l;"])

    def energies(self, found: Sequence[Output]) -> str:
        lines, texts = statements(found, self)
        put = [self.store("e.parts", str(k), text) for k, text in enumerate(texts)]
        head = "VtEnergies vt_energies(VtMaterial m, vec3 wi)"
        return self._function(head, [self.declared("VtEnergies", "e"), *lines, *put, "return e;"])

    def eval_pdf(self, value: Output, density: Output) -> str:
        lines, texts = statements([value, density], self)
        head = "vec4 vt_eval_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo)"
        function = self._function(head, [*lines, f"return {self.type('vec4')}({', '.join(texts)});"])
        return f"{function}\n{self.spelled(_WRAPPERS)}"

    def sample(self, drawn: Sequence[Output]) -> str:
        lines, texts = statements(drawn, self)
        head = "vec3 vt_sample(VtMaterial m, VtLobes l, vec3 wi, vec3 u)"
        return self._function(head, [*lines, f"return {self.colour(texts)};"])

    def mixture(self, members: Sequence[Member]) -> str:
        shares = assignments({f"l.{name}_share": (share, "number") for name, _, share in members}, self)
        filled = [f"l.{name} = vt_{own}lobes(m.{name}, wi);" for name, own, _ in members]
        begin = self.declared("VtLobes", "l")
        lobes = self._function("VtLobes vt_lobes(VtMaterial m, vec3 wi)", [begin, *shares, *filled, "return l;"])
        sums = "".join(_SUM_OF_PARTS.format(name, own) for name, own, _ in members)
        drawn = [_DRAWN_OF_PART.format(name, own) for name, own, _ in members]
        choices = "".join(_CHOICE_OF_PART.format(name, each) for (name, _, _), each in zip(members, drawn[:-1]))
        return f"{lobes}\n{self.spelled(_MIXTURE.format(sums=sums, choices=choices, last=drawn[-1]) + _WRAPPERS)}"

    def _function(self, head: str, lines: Sequence[str]) -> str:
        opening, *rest = _block(head, lines)
        return "\n".join([self.spelled(opening), *rest, ""])


def _block(head: str, lines: Sequence[str]) -> list[str]:
    return [f"{head} {{", *(f"    {line}".rstrip() for line in lines), "}"]


def _described(image: Texture) -> str:
    decoded = ", to be decoded from sRGB" if image.encoding == "srgb" else ""
    curve = f", and taken through the curve {', '.join(f'{value:g}' for value in image.curve)}" if image.curve else ""
    return remark(image.texture.name) + decoded + curve


def _table(layout: TableLayout) -> str:
    """A function of the coordinates, of one texel of several."""
    name, start, nodes, channels = layout
    axes = "xyz"[: len(nodes)]
    size, at = f"ivec{len(nodes)}({', '.join(map(str, nodes))})", f"vec{len(nodes)}({', '.join(axes)})"
    arguments = ", ".join(f"float {axis}" for axis in axes)
    described = f"\n// {' x '.join(map(str, nodes))} nodes, {channels} channel{'s' * (channels > 1)}\n"
    if channels == 1:
        each = f"vt_{name}({', '.join(f'{axis}[c]' for axis in axes)})"
        lines = ["vec3 colour = vec3(0.0, 0.0, 0.0);", f"for (int c = 0; c < 3; c++) {{ colour[c] = {each}; }}"]
        single = _block(f"float vt_{name}({arguments})", [f"return vt_volume({start}, {size}, {at});"])
        wide = _block(f"vec3 vt_{name}3({arguments.replace('float', 'vec3')})", [*lines, "return colour;"])
        return described + "\n".join([*single, *wide, ""])
    read = f"vt_{'plane' if len(nodes) == 2 else 'space'}({start}, {size}, {layout.texels}, texel, {at})"
    return described + "\n".join([*_block(f"vec4 vt_{name}(int texel, {arguments})", [f"return {read};"]), ""])


def _film(layout: TableLayout) -> str:
    name, start, nodes, _ = layout
    if len(nodes) == 1:
        return f"vec3 vt_{name}(float x) {{ return vt_film_line({start}, {nodes[0]}, x); }}\n"
    return f"vec3 vt_{name}(float x, float y) {{ return vt_film_plane({start}, ivec2{nodes}, vec2(x, y)); }}\n"


_HEADER = """\
// {name}, by the model {model}; {language}.
//
"""

_USAGE = {
    "VtMaterial m = vt_material(uv);": "{filled}",
    "VtLobes l = vt_lobes(m, wi);": "once for a direction of view",
    "vec4 f = vt_eval_pdf(m, l, wi, wo);": "f(wi, wo) |cos theta_o|, and the density of vt_sample",
    "vec3 wo = vt_sample(m, l, wi, u);": "from three uniform numbers; f may be 0 there",
}

_COSTS = """\
//
// Directions have length 1 and point away from the surface, in its frame: x along the tangent, z the normal.
// `velatura export -o` writes the textures that the code reads beside it, row by row.
//
// The costs of a call; a colour counts as three numbers, an elementary function as four operations:
{costs}
"""

_WRAPPERS = """\
// f(wi, wo) |cos theta_o|, and the density of vt_sample per solid angle
vec3 vt_eval(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) { return vt_eval_pdf(m, l, wi, wo).rgb; }
float vt_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) { return vt_eval_pdf(m, l, wi, wo).a; }
"""

_MIXTURE = """\
vec4 vt_eval_pdf(VtMaterial m, VtLobes l, vec3 wi, vec3 wo) {{
    vec4 f = vec4(0.0, 0.0, 0.0, 0.0);
{sums}    return f;
}}

vec3 vt_sample(VtMaterial m, VtLobes l, vec3 wi, vec3 u) {{
    float x = u.x;
{choices}    {last}
}}

"""
_SUM_OF_PARTS = "    if (l.{0}_share > 0.0) {{ f += l.{0}_share * vt_{1}eval_pdf(m.{0}, l.{0}, wi, wo); }}\n"
_CHOICE_OF_PART = "    if (x < l.{0}_share) {{ {1} }}\n    x -= l.{0}_share;\n"
_DRAWN_OF_PART = "return vt_{1}sample(m.{0}, l.{0}, wi, vec3(min(x / max(l.{0}_share, 1e-15), 0.99999994), u.y, u.z));"

_TABLES = """\
// Averages of Fresnel over rough interfaces: {}, {} texels a row, never filtered.
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
    vec2 position = clamp(at, vec2(0.0, 0.0), vec2(1.0, 1.0)) * vec2(nodes - 1);
    ivec2 cell = min(ivec2(position), nodes - 2);
    vec2 upper = position - vec2(cell);
    vec4 sum = vec4(0.0, 0.0, 0.0, 0.0);
    for (int k = 0; k < 4; k++) {{
        ivec2 corner = ivec2(k >> 1, k & 1);
        ivec2 node = cell + corner;
        vec2 weight = mix(1.0 - upper, upper, vec2(corner));
        sum += weight.x * weight.y * vt_texel(start + (node.x * nodes.y + node.y) * texels + texel);
    }}
    return sum;
}}

// The same in space
vec4 vt_space(int start, ivec3 nodes, int texels, int texel, vec3 at) {{
    vec3 position = clamp(at, vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0)) * vec3(nodes - 1);
    ivec3 cell = min(ivec3(position), nodes - 2);
    vec3 upper = position - vec3(cell);
    vec4 sum = vec4(0.0, 0.0, 0.0, 0.0);
    for (int k = 0; k < 8; k++) {{
        ivec3 corner = ivec3(k >> 2, (k >> 1) & 1, k & 1);
        ivec3 node = cell + corner;
        vec3 weight = mix(1.0 - upper, upper, vec3(corner));
        int i = ((node.x * nodes.y + node.y) * nodes.z + node.z) * texels + texel;
        sum += weight.x * weight.y * weight.z * vt_texel(start + i);
    }}
    return sum;
}}

// The same for one number a node, four of them in a texel
float vt_volume(int start, ivec3 nodes, vec3 at) {{
    vec3 position = clamp(at, vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0)) * vec3(nodes - 1);
    ivec3 cell = min(ivec3(position), nodes - 2);
    vec3 upper = position - vec3(cell);
    float sum = 0.0;
    for (int k = 0; k < 8; k++) {{
        ivec3 corner = ivec3(k >> 2, (k >> 1) & 1, k & 1);
        ivec3 node = cell + corner;
        vec3 weight = mix(1.0 - upper, upper, vec3(corner));
        int i = (node.x * nodes.y + node.y) * nodes.z + node.z;
        sum += weight.x * weight.y * weight.z * vt_float(4 * start + i);
    }}
    return sum;
}}
"""

_LOBES = """\
// The lobes over direction: {}, {} x {} texels ({} kB), never filtered
"""

_BAKED = {
    1: """\
vec4 vt_column(int node, int y) {{ return texelFetch(vt_baked, ivec2(node, {line}), 0); }}

vec4 vt_baked_texel(int texel, vec3 place) {{
    float position = clamp(place.x, 0.0, 1.0) * float({0} - 1);
    int node = min(int(position), {0} - 2);
    int y = {sides} * texel + int(place.z);
    return mix(vt_column(node, y), vt_column(node + 1, y), position - float(node));
}}
""",
    2: """\
vec4 vt_column(int node, int y) {{ return texelFetch(vt_baked, ivec2(node, {line}), 0); }}

vec4 vt_baked_texel(int texel, vec3 place) {{
    vec2 position = clamp(place.xy, vec2(0.0, 0.0), vec2(1.0, 1.0)) * vec2({0} - 1, {1} - 1);
    ivec2 node = min(ivec2(position), ivec2({0} - 2, {1} - 2));
    vec2 upper = position - vec2(node);
    int y = ({sides} * texel + int(place.z)) * {1} + node.y;
    vec4 a = mix(vt_column(node.x, y), vt_column(node.x + 1, y), upper.x);
    return mix(a, mix(vt_column(node.x, y + 1), vt_column(node.x + 1, y + 1), upper.x), upper.y);
}}
""",
}

_FILMS = """\
// Thin films: reflectances over the cosine, averages over direction and roughness.
// {}, {} x {} texels, never filtered.
"""

_OF_FILMS = """\
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
{0} vt_sin{1}({0} x) {{
    {0} turns = round(x / 3.14159265);
    {0} y = (x - turns * 3.140625) - turns * 9.67653590e-4;
    {0} z = y * y;
    {0} series = 1.0 / 120.0 - z * (1.0 / 5040.0 - z * (1.0 / 362880.0 - z / 39916800.0));
    return (1.0 - 2.0 * (turns - 2.0 * floor(0.5 * turns))) * (y - y * z * (1.0 / 6.0 - z * series));
}}
"""

_HELPERS: dict[str, dict[tuple[tuple[str, Kind], ...], str]] = {
    "": {
        (("sqrt", "number"),): "float vt_sqrt(float x) { return sqrt(max(x, 0.0)); }\n",
        (("sqrt", "colour"),): "vec3 vt_sqrt3(vec3 x) { return sqrt(max(x, vec3(0.0, 0.0, 0.0))); }\n",
        (("mean", "number"),): "float vt_mean(vec3 x) { return (x.r + x.g + x.b) / 3.0; }\n",
        (
            ("both", "conditions"),
        ): "bvec3 vt_both(bvec3 a, bvec3 b) { return bvec3(a.x && b.x, a.y && b.y, a.z && b.z); }\n",
    },
    "Drivers may leave sine and cosine with errors of 2e-4; this series is as good as single precision": {
        (("sin", "number"), ("cos", "number")): _SINE.format("float", ""),
        (("sin", "colour"), ("cos", "colour")): _SINE.format("vec3", "3"),
        (("cos", "number"),): "float vt_cos(float x) { return vt_sin(x + 1.57079633); }\n",
        (("cos", "colour"),): "vec3 vt_cos3(vec3 x) { return vt_sin3(x + 1.57079633); }\n",
    },
}
