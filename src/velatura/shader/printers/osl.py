"""Open Shading Language: a material as a sum of closures."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import ops, tables
from velatura.errors import remark
from velatura.model import DEFAULT, Model, named
from velatura.model.variance import Isotropic, Roughness
from velatura.ops import Value
from velatura.optics.ggx import Direction
from velatura.renderer import directional_grid
from velatura.shader import closures
from velatura.shader.closures import Closure, Closures, ColumnReader, Loss, TabulatedClosures
from velatura.shader.lookups import atlas, films
from velatura.shader.lookups.lookup import together
from velatura.shader.material import brushed, identifier, place, title
from velatura.shader.material import constant as as_constant
from velatura.shader.mixture import named_after, shares
from velatura.shader.printers.printer import ATOM, Language
from velatura.shader.printers.statements import statements
from velatura.shader.program import described
from velatura.shader.recorder import recording
from velatura.shader.recorder.graph import Graph
from velatura.shader.recorder.symbol import Kind, Operand, Symbol, in_order, operand
from velatura.stack import Address, Brushing, Described, MaterialLike, Stack, Texture, Varying, load
from velatura.stack.flat_names import prefix

LINE = 116  # characters of comments
ACROSS = 12  # numbers of an array on a line
LARGE = 1e3  # limit of a parameter that is not stated, nor one beyond it

Array = NDArray[np.floating]

_TYPES: dict[str, str] = {"number": "float", "colour": "color", "condition": "int", "conditions": "color"}
# Words of the language, its globals and functions, and names of the shader
_WORDS = """
    and bool break case catch char class closure color const continue default delete do double else emit enum extern
    false float for friend goto if illuminance illuminate inline int light matrix new normal not operator or output
    patch point private protected public return shader short signed sizeof static string struct surface switch template
    this throw true try typedef uniform union unsigned varying vector virtual void volatile while
    P I N Ng dPdu dPdv Ps u v time dtime dPdtime Ci wi UV Tangent Normal cosine view shading x y z outwards BSDF
    abs acos asin atan atan2 backfacing blackbody ceil clamp cos cosh cross degrees diffuse distance dot exp fabs floor
    fmod getattribute hypot length log luminance max microfacet min mix mod noise normalize pow radians reflect refract
    round select sign sin sinh sqrt step tan texture transform translucent transparent trunc
"""


class Osl(Language):
    """The spelling of Open Shading Language; its conditions of colours are colours of 0 and 1."""

    words = frozenset(_WORDS.split())

    def input(self, place: str) -> str:
        if place.startswith("m."):
            return place[2:].replace(".", "_")
        name, _, axis = place.partition(".")
        return f"{name}[{'xyz'.index(axis)}]" if axis else name

    def literal(self, x: Operand) -> str:
        if isinstance(x, tuple):
            return self.colour([self.literal(channel) for channel in x])
        if isinstance(x, bool):
            return str(int(x))
        assert not isinstance(x, Symbol)
        text = f"{np.float32(x):.9g}" if np.float32(x) != np.float32(f"{x:.6g}") else f"{x:.6g}"
        return text if "." in text or "e" in text else f"{text}.0"

    def colour(self, channels: Sequence[str]) -> str:
        return f"color({', '.join(channels)})"

    def component(self, x: str, channel: int, kind: Kind) -> str:
        return f"{x}[{channel}]"

    def each_channel(self, op: str, a: str, b: str) -> str:
        return f"color({a}) * color({b})" if op == "both" else f"vt_{op}({a}, {b})"

    def select(self, condition: str, a: str, b: str) -> tuple[str, int]:
        return f"({condition} ? {a} : {b})", ATOM

    def select_channels(self, conditions: str, a: str, b: str) -> str:
        return f"select({b}, {a}, {conditions})"

    def value(self, table: str, args: Sequence[str], wide: bool) -> str:
        nodes = atlas.layouts([table])[0].nodes
        return f"vt_value(vt_{table}, {', '.join(map(str, nodes))}, {', '.join(args)})"

    def film(self, table: str, args: Sequence[str]) -> str:
        nodes = films.layouts([table])[0].nodes
        return f"vt_film(vt_{table}, {', '.join(map(str, nodes))}, {', '.join(args)})"

    def named(self, name: str, kind: Kind, text: str) -> str:
        return f"{_TYPES[kind]} {name} = {text};"

    def texels(self, name: str, table: str, count: int, args: Sequence[str], where: str = "") -> list[str]:
        _, _, nodes, channels = atlas.layouts([table])[0]
        at = ", ".join([*map(str, nodes), *args])
        return [f"float {name}[{channels}];", f"vt_texels(vt_{table}, {at}, {name});"]

    def baked(self, name: str, group: Any, place: Sequence[str]) -> list[str]:
        at = ", ".join([*map(str, group.nodes), *place])
        return [f"float {name}[{group.texels}];", f"vt_closures(vt_{group.name}, {at}, {name});"]

    def nodes(self, name: str, nodes: Sequence[float]) -> list[str]:
        return [f"float {name}[{len(nodes)}] = {{{', '.join(map(self.literal, nodes))}}};"]

    def results(self, name: str, kind: Kind, count: int) -> list[str]:
        return [f"{_TYPES[kind]} {name}[{count}];"]

    def state(self, name: str, following: str, kind: Kind, begin: Sequence[str]) -> list[str]:
        kind_of, count = _TYPES[kind], len(begin)
        return [f"{kind_of} {name}[{count}] = {{{', '.join(begin)}}};", f"{kind_of} {following}[{count}];"]

    def loop(self, index: str, times: int, lines: Sequence[str]) -> list[str]:
        return [f"for (int {index} = 0; {index} < {times}; {index}++) {{", *_indented(lines), "}"]

    def advance(self, name: str, following: str) -> str:
        return f"for (int k = 0; k < arraylength({name}); k++) {name}[k] = {following}[k];"


OSL = Osl()


@dataclass(frozen=True)
class OslShader:
    """The code, the name of its shader, whether its lobes turn with the tangent, and its difference from the model."""

    text: str
    name: str
    turns: bool
    losses: Sequence[Loss]


def osl(
    stack: MaterialLike, model: str | Model = DEFAULT, constant: Collection[str] = (), **switches: str
) -> OslShader:
    """A material as a shader whose output `BSDF` is a sum of closures.

    Args:
        stack: a material (a stack, a mixture, a file, or a preset's name). Of models in closed form its values are
            parameters; of a solved one the closures are tabulated over direction, but where values come from textures.
        constant: flat names of values that are worked in.

    Raises:
        InvalidInput: as `velatura.shader.record`; a thickness of a film that is a texture.
    """
    material, asked = load(stack), named(model, **switches)
    for address, value in material.values():
        if address.film is not None:
            # A table over thickness, too, would be megabytes of code
            address.plain(value, "in OSL films have no textures")
    recording.check_constant(material, constant)
    wi = recording.direction("wi")
    parts = [_Part.of(path, each, asked, constant, wi) for path, each in material.leaves()]
    found = closures.weighted(shares(material, constant), [part.found for part in parts])
    halves = closures.shares(material)
    numbers = [(share, closures.numbers(part.stack)) for share, part in zip(halves, parts)]
    known = closures.side_by_side(halves, [part.known for part in parts])
    return _Program(material, parts, found, list(closures.losses(numbers, asked, known))).made()


@dataclass(frozen=True)
class _Part:
    """A stack: its closures, recorded with the names of its part, and in NumPy; and what they look up, by name."""

    stack: Stack
    model: Model
    found: Sequence[Closure]
    known: Closures
    films: Mapping[str, Array]
    columns: Mapping[str, Array]

    @classmethod
    def of(cls, parts: tuple[int, ...], stack: Stack, asked: Model, constant: Collection[str], wi: Direction) -> _Part:
        chosen, own, known = recording.drawn_by(stack, asked), prefix(parts), closures.numbers(stack)
        columns: dict[str, Array] = {}
        with ops.readable():
            if chosen.closed_form:
                constants = [name for name in stack.flat() if own + name in constant]
                found, above = closures.in_closed_form(stack, chosen, constants, wi)
            else:
                baked = closures.tabulated(known, chosen)
                found, above = _read(baked, wi), baked.above
                columns[f"{own}columns"] = baked.rows
        numbers = [x for closure in found for x in (closure.weight, *closure.roughness, closure.eta)]
        filmed = films.tables(stack, films.read_by(in_order(Graph().unique(numbers))), chosen)
        each = iter(named_after(parts, numbers))
        found = [
            Closure(closure.kind, next(each), Roughness(next(each), next(each), next(each)), next(each))
            for closure in found
        ]
        return cls(stack, chosen, found, above, {own + name: table for name, table in filmed.items()}, columns)


class _Columns(NamedTuple):
    """The array of columns over direction: how many, and its nodes along each axis."""

    name: str
    texels: int
    nodes: tuple[int, ...]


def _read(baked: TabulatedClosures, wi: Direction) -> list[Closure]:
    """Closures that are read from the array of columns."""
    array = _Columns("columns", baked.rows.shape[-1], baked.shape)
    above = wi[2] > 0
    one = len(baked.etas) == 1
    side = 0.0 if one else ops.select(above, 0.0, 1.0)

    def read(w: Direction) -> ColumnReader:
        at = [operand(x) for x in (*directional_grid.places(w, len(baked.shape)), side)]
        texels = Symbol("baked", tuple(at), "texels", array)
        return ColumnReader.of([Symbol("component", (texels,), "number", k) for k in range(array.texels)], together)

    return baked.at(wi, read, baked.etas[0] if one else ops.select(above, *baked.etas))


@dataclass(frozen=True)
class _Program:
    """The parts of a shader."""

    material: Described
    parts: Sequence[_Part]
    closures: Sequence[Closure]
    losses: Sequence[Loss]

    def made(self) -> OslShader:
        outputs: list[tuple[Value, Kind]] = []
        for closure in self.closures:
            outputs += [(closure.weight, "colour"), *((x, "number") for x in (*closure.roughness, closure.eta))]
        found = Graph().unique([x for x, _ in outputs])
        lines, texts = statements([(x, kind) for x, (_, kind) in zip(found, outputs)], OSL)
        symbols = in_order(found)
        read = {symbol.detail for symbol in symbols if symbol.op == "input"}
        values = [(at, x) for at, x in self.material.values() if f"m.{place(at)}" in read]
        varying = [(at, x) for at, x in values if isinstance(x, Varying)]
        body = [*self._arrays(symbols, varying), *(_varied(at, x) for at, x in varying), *_FRAME, *lines, ""]
        body += _sum([closure.kind for closure in self.closures], [texts[k : k + 5] for k in range(0, len(texts), 5)])
        name, parameters = self._name(), ",\n".join(self._parameters(values))
        shader = "\n".join([f"shader {name}(", parameters, ")", "{", *_indented(body), "}", ""])
        turns = any(recording.variance(part.stack) is not Isotropic for part in self.parts)
        return OslShader("\n".join([self._header(), *_helpers(shader), shader]), name, turns, self.losses)

    def _parameters(self, values: Sequence[tuple[Address, Any]]) -> list[str]:
        """The declarations of values, of the files of textures, and of the place on the surface."""
        kinds = {path: stack.kinds for path, stack in self.material.leaves()}
        numbers = [_parameter(kinds.get(at.parts, ()), at, x) for at, x in values if not isinstance(x, Varying)]
        files = [_file(f"{at.name}_map", x) for at, x in values if isinstance(x, Texture)]
        varies = any(isinstance(x, Varying) for _, x in values)
        return [*numbers, *files, *([_UV] if varies else []), *_PLACE]

    def _name(self) -> str:
        """An identifier."""
        name = identifier(self.material)
        return f"vt_{name}" if name in OSL.words or not name[0].isalpha() else name

    def _header(self) -> str:
        """Comments that describe the material and what is lost."""
        over = "Lobes are tabulated over the direction of view. " if any(part.columns for part in self.parts) else ""
        varying = " where textures are half bright" if not recording.is_uniform(self.material) else ""
        return _HEADER.format(
            name=remark(title(self.material)),
            model=" and ".join(dict.fromkeys(described(part.model) for part in self.parts)),
            text="\n".join(f"// {line}" for line in wrap(_ABOUT.format(over=over, varying=varying), LINE)),
            lost="\n".join(f"//    {loss}" for loss in self.losses),
        )

    def _arrays(self, symbols: Sequence[Symbol], varying: Sequence[tuple[Address, Varying]]) -> Iterator[str]:
        """The numbers that are looked up."""
        for name in sorted({symbol.detail for symbol in symbols if symbol.op in ("texels", "value")}):
            yield from _of_table(name)
        for part in self.parts:
            for name, film in part.films.items():
                yield from _array(name, film)
        for at, x in varying:
            if isinstance(x, Texture) and x.curve:
                yield from _array(f"{at.name}_curve", np.array(x.curve))
        for part in self.parts:
            for name, rows in part.columns.items():
                yield from _array(name, rows)


def _helpers(shader: str) -> list[str]:
    """The functions that a shader calls."""
    called = set(re.findall(r"[A-Za-z_]\w*(?=\()", shader))  # once, since a shader has megabytes of numbers
    return [text for name, text in _HELPERS.items() if name in called]


@cache
def _of_table(name: str) -> list[str]:
    return _array(name, getattr(tables.load(), name).data)


def _array(name: str, values: Array) -> list[str]:
    """The declaration of an array of numbers."""
    numbers = [f"{x:.6g}" for x in np.ravel(values).astype(np.float32).tolist()]
    lines = [f"    {', '.join(numbers[k : k + ACROSS])}," for k in range(0, len(numbers), ACROSS)]
    return [f"float vt_{name}[{len(numbers)}] = {{", *lines[:-1], lines[-1].rstrip(","), "};"]


def _parameter(kinds: Sequence[str], at: Address, value: Any) -> str:
    """The declaration of a value of a stack of these kinds of layers."""
    number = as_constant(at, value)
    text = OSL.literal(operand(number)) if not at.colour or np.ndim(number) else OSL.colour([OSL.literal(number)])
    low, high = at.declared.within
    part = f"Part {'.'.join(map(str, at.parts))}" if at.parts else ""
    layer = "" if at.layer is None else f"Layer {at.layer}"
    where = ", ".join(name for name in (part, layer) if name)
    facts = [f'string label = "{where}{": " * bool(where)}{at.key}"', f'string help = "{at.declared.doc}"']
    if where:
        facts.append(f'string page = "{where}{"" if at.layer is None else f" ({kinds[at.layer]})"}"')
    facts += [f"float {name} = {x:g}" for name, x in (("min", low), ("max", high)) if abs(x) < LARGE]
    return f"    {_TYPES['colour' if at.colour else 'number']} {at.name} = {text}\n        [[ {', '.join(facts)} ]]"


def _file(name: str, image: Texture) -> str:
    """The declaration of the file of a texture."""
    metadata = f'string label = "{name}", string widget = "filename"'
    return f"    string {name} = {_string(image.texture.as_posix())}\n        [[ {metadata} ]]"


def _string(text: str) -> str:
    """A literal; what a string or a preprocessor reads otherwise stands in octal digits."""
    return '"' + re.sub(r'["\\?]', lambda found: f"\\{ord(found[0]):03o}", text) + '"'


def _varied(at: Address, value: Varying) -> str:
    """The declaration of a value at the texture coordinates."""
    literal = OSL.literal
    if isinstance(value, Brushing):
        u, v, offset = map(literal, brushed(value))
        return f"float {at.name} = degrees(atan2(UV[1] - {v}, UV[0] - {u})) + {offset};"
    assert isinstance(value, Texture)
    channel, file = value.channel or "r", f"{at.name}_map"
    texel = f"vt_colour({file}, UV)" if channel == "rgb" else f"vt_channel({file}, {'rgba'.index(channel)}, UV)"
    texel = f"vt_linear({texel})" if value.encoding == "srgb" else texel
    texel = f"vt_curve(vt_{at.name}_curve, {texel})" if value.curve else texel
    low, high = (literal(float(np.clip(x, -1e6, 1e6))) for x in at.declared.within)
    bounded = f"clamp({texel} * {literal(value.scale)} + {literal(value.offset)}, {low}, {high})"
    colour = f"color({bounded})" if channel != "rgb" else bounded
    return f"color {at.name} = {colour};" if at.colour else f"float {at.name} = {bounded};"


def _sum(kinds: Sequence[closures.Kind], each: Sequence[Sequence[str]]) -> Iterator[str]:
    """The sum of closures, of a weight, two roughnesses, a rotation and an index each."""
    yield "BSDF = 0;"
    for kind, (weight, u, v, rotation, eta) in zip(kinds, each):
        yield f"BSDF += ({weight}) * {_CLOSURES[kind].format(u=u, v=v, rotation=rotation, eta=eta)};"


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}".rstrip() for line in lines]


_AXIS = "vt_turned(x, y, {rotation})"
_CLOSURES: dict[closures.Kind, str] = {
    "reflection": f'generalized_schlick_bsdf(shading, {_AXIS}, 1.0, 0.0, {{u}}, {{v}}, 1.0, 1.0, 5.0, "ggx")',
    "refraction": f'microfacet("ggx", shading, {_AXIS}, {{u}}, {{v}}, {{eta}}, 1)',
    "straight": 'microfacet("ggx", view, x, {u}, {v}, {eta}, 1)',
    "diffuse": "diffuse(shading)",
    "translucent": "translucent(shading)",
}

_HEADER = """\
// {name}, by the model {model}; Open Shading Language.
//
{text}
//
{lost}
"""

_ABOUT = (
    "The output BSDF is a sum of closures: GGX reflections of reflectance 1 by generalized_schlick_bsdf, refractions"
    " without Fresnel by microfacet, diffuse light. {over}Its difference from the model{varying}, in light from above,"
    " as total variation and as the greatest difference of albedo:"
)

_UV = '    point UV = point(u, v, 0)\n        [[ string label = "UV", string widget = "null" ]]'
_PLACE = [
    '    vector Tangent = dPdu\n        [[ string label = "Tangent", string widget = "null" ]]',
    '    normal Normal = N\n        [[ string label = "Normal", string widget = "null" ]]',
    "    output closure color BSDF = 0",
]

_FRAME = """\
// The direction of view in the frame of the surface: x along the tangent, z outwards. N faces the viewer; I points away
// from it, but not in Cycles. Inputs without a value are 0 there.
vector view = normalize(dot(N, I) > 0 ? I : -I);
normal shading = normalize(dot(Normal, Normal) > 0 ? Normal : N);
shading = dot(shading, view) > 0 ? shading : -shading;
vector outwards = backfacing() ? -shading : shading;
vector x = dot(Tangent, Tangent) > 0 ? Tangent : dPdu;
x = normalize(x - dot(x, outwards) * outwards);
vector y = cross(outwards, x);
float cosine = max(dot(view, shading), 1e-3);
vector wi = vector(dot(view, x), dot(view, y), backfacing() ? -cosine : cosine);
""".splitlines()

_HELPERS = {
    "vt_turned": """\
vector vt_turned(vector x, vector y, float rotation) { return cos(rotation) * x + sin(rotation) * y; }
""",
    "vt_mean": """\
float vt_mean(color x) { return (x[0] + x[1] + x[2]) / 3; }
""",
    **{
        f"vt_{op}": f"color vt_{op}(color a, color b)\n"
        f"{{\n    return color(a[0] {sign} b[0], a[1] {sign} b[1], a[2] {sign} b[2]);\n}}\n"
        for op, sign in (("less", "<"), ("greater", ">"), ("at_most", "<="), ("at_least", ">="))
    },
    "vt_texels": """\
// The channels of a table, interpolated in a plane or in space
void vt_texels(float table[], int nx, int ny, float x, float y, output float texels[])
{
    int channels = arraylength(texels);
    float px = clamp(x, 0.0, 1.0) * (nx - 1), py = clamp(y, 0.0, 1.0) * (ny - 1);
    int i = min(int(px), nx - 2), j = min(int(py), ny - 2);
    for (int k = 0; k < channels; k++) {
        int a = (i * ny + j) * channels + k, b = a + ny * channels;
        texels[k] = mix(mix(table[a], table[a + channels], py - j), mix(table[b], table[b + channels], py - j), px - i);
    }
}

void vt_texels(float table[], int nx, int ny, int nz, float x, float y, float z, output float texels[])
{
    int channels = arraylength(texels);
    float px = clamp(x, 0.0, 1.0) * (nx - 1), py = clamp(y, 0.0, 1.0) * (ny - 1), pz = clamp(z, 0.0, 1.0) * (nz - 1);
    int i = min(int(px), nx - 2), j = min(int(py), ny - 2), k = min(int(pz), nz - 2);
    for (int c = 0; c < channels; c++) {
        float planes[2];
        for (int s = 0; s < 2; s++) {
            int a = (((i + s) * ny + j) * nz + k) * channels + c, b = a + nz * channels;
            float before = mix(table[a], table[a + channels], pz - k);
            float after = mix(table[b], table[b + channels], pz - k);
            planes[s] = mix(before, after, py - j);
        }
        texels[c] = mix(planes[0], planes[1], px - i);
    }
}
""",
    "vt_value": """\
// A table of one channel, interpolated in space
float vt_value(float table[], int nx, int ny, int nz, float x, float y, float z)
{
    float px = clamp(x, 0.0, 1.0) * (nx - 1), py = clamp(y, 0.0, 1.0) * (ny - 1), pz = clamp(z, 0.0, 1.0) * (nz - 1);
    int i = min(int(px), nx - 2), j = min(int(py), ny - 2), k = min(int(pz), nz - 2);
    float planes[2];
    for (int s = 0; s < 2; s++) {
        int a = ((i + s) * ny + j) * nz + k, b = a + nz;
        planes[s] = mix(mix(table[a], table[a + 1], pz - k), mix(table[b], table[b + 1], pz - k), py - j);
    }
    return mix(planes[0], planes[1], px - i);
}

color vt_value(float table[], int nx, int ny, int nz, color x, color y, color z)
{
    color found = 0;
    for (int c = 0; c < 3; c++)
        found[c] = vt_value(table, nx, ny, nz, x[c], y[c], z[c]);
    return found;
}
""",
    "vt_film": """\
// Thin films: reflectances over the cosine, averages over direction and roughness
color vt_film(float table[], int n, float x)
{
    float position = clamp(x, 0.0, 1.0) * (n - 1);
    int i = min(int(position), n - 2), a = 3 * i;
    color before = color(table[a], table[a + 1], table[a + 2]), after = color(table[a + 3], table[a + 4], table[a + 5]);
    return mix(before, after, position - i);
}

color vt_film(float table[], int nx, int ny, float x, float y)
{
    float px = clamp(x, 0.0, 1.0) * (nx - 1), py = clamp(y, 0.0, 1.0) * (ny - 1);
    int i = min(int(px), nx - 2), j = min(int(py), ny - 2);
    color found = 0;
    for (int c = 0; c < 3; c++) {
        int a = (i * ny + j) * 3 + c, b = a + ny * 3;
        found[c] = mix(mix(table[a], table[a + 3], py - j), mix(table[b], table[b + 3], py - j), px - i);
    }
    return found;
}
""",
    "vt_linear": """\
// Decoded from sRGB
float vt_linear(float x) { return x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4); }
color vt_linear(color x) { return color(vt_linear(x[0]), vt_linear(x[1]), vt_linear(x[2])); }
""",
    "vt_curve": """\
// Values for texels from 0 to 1, in equal steps
float vt_curve(float values[], float x)
{
    float position = clamp(x, 0.0, 1.0) * (arraylength(values) - 1);
    int i = min(int(position), arraylength(values) - 2);
    return mix(values[i], values[i + 1], position - i);
}

color vt_curve(float values[], color x)
{
    return color(vt_curve(values, x[0]), vt_curve(values, x[1]), vt_curve(values, x[2]));
}
""",
    "vt_channel": """\
float vt_channel(string file, int channel, point uv)
{
    float found = texture(file, uv[0], 1 - uv[1], 0.0, 0.0, 0.0, 0.0, "interp", "linear", "wrap", "periodic",
        "firstchannel", channel);
    return found;
}
""",
    "vt_colour": """\
color vt_colour(string file, point uv)
{
    color found = texture(file, uv[0], 1 - uv[1], 0.0, 0.0, 0.0, 0.0, "interp", "linear", "wrap", "periodic");
    return found;
}
""",
    "vt_closures": """\
// Weights and roughnesses over the cosine
void vt_closures(float table[], int n, float x, float side, output float columns[])
{
    int count = arraylength(columns);
    float position = clamp(x, 0.0, 1.0) * (n - 1);
    int i = min(int(position), n - 2), a = (int(side) * n + i) * count;
    for (int k = 0; k < count; k++)
        columns[k] = mix(table[a + k], table[a + count + k], position - i);
}

// The same over cosine and azimuth
void vt_closures(float table[], int nx, int ny, float x, float y, float side, output float columns[])
{
    int count = arraylength(columns);
    float px = clamp(x, 0.0, 1.0) * (nx - 1), py = clamp(y, 0.0, 1.0) * (ny - 1);
    int i = min(int(px), nx - 2), j = min(int(py), ny - 2);
    int a = (int(side) * nx * ny + i * ny + j) * count, b = a + ny * count;
    for (int k = 0; k < count; k++)
        columns[k] = mix(mix(table[a + k], table[a + count + k], py - j),
            mix(table[b + k], table[b + count + k], py - j), px - i);
}
""",
}
