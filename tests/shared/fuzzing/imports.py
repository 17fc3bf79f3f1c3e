"""Mutated files of other programs: each is refused in one line that names it, or means the same once it is written.

Materials (MaterialX, glTF, scenes of Mitsuba), tables of reflectance and of spectra, and textures.
"""

from __future__ import annotations

import base64
import functools
import json
import re
import resource
import struct
import tempfile
import time
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.files import WORDS, bytes_changed, changed
from velatura import kernel
from velatura.binding.textures import texels as texels_of_file
from velatura.errors import InvalidInput
from velatura.inverse import load_table
from velatura.programs import embedded
from velatura.programs.materialx.read import RENAMED, SHADERS
from velatura.stack import dumps, loads

SLOW_S = 20.0  # of the processor
LARGE_KIB = 2**21  # by which the memory of the process may grow

#: Words of these files.
NAMES = """
multiply add dot image constant extract swizzle nodegraph output nodename interfacename value type color3
baseColorTexture bufferView byteLength byteOffset extensions index source uri images textures
1_0 \u0663 -1 1e308 1e999 true a.mtlx b.mtlx ../a.mtlx /dev/zero %2e%2e data:;base64,A
"""
OWN_WORDS = (*NAMES.split(), "0.5, 0.5, 0.5", "9" * 400, "9" * 5000, "n" * 5000)
NUMBERS = (
    "-1",
    "0",
    "2",
    "1e999",
    "-1e308",
    "1e-320",
    "true",
    "null",
    "[]",
    "{}",
    "[1,2,3]",
    '"x"',
    "NaN",
    *OWN_WORDS[-3:],
)
ENDS = (0, 1, 2, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1)  # of integers in binary files

Files = dict[str, bytes]
Wrong = tuple[str, str] | None  # the kind of a failure, and its detail


def trial(rng: np.random.Generator) -> list[Failure]:
    """A file of some kind, changed in a few places."""
    kind = str(rng.choice(list(KINDS)))
    make, read, binary = KINDS[kind]
    files = make(rng)
    name = str(rng.choice(list(files))) if rng.random() < 0.3 else next(iter(files))
    for _ in range(rng.integers(kind != "glb", 4)):
        text = not (binary or name.endswith((".png", ".glb")))
        files[name] = _text_changed(files[name], rng) if text else _data_changed(files[name], rng)
    return tried(kind, files, read)


def tried(kind: str, files: Files, read: Callable[[Path], Wrong]) -> list[Failure]:
    """Failures of how the first of some files is read."""
    case = {"kind": kind, **files}
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            Path(folder, name).write_bytes(data)
        path = Path(folder, next(iter(files)))
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
        found: Wrong = None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                found = read(path)
        except InvalidInput as error:
            if len(str(error).splitlines()) != 1 or not str(error).isprintable() or len(str(error)) > 1000:
                found = "refused in several lines", repr(str(error))
            elif folder not in str(error):
                found = "refused without naming the file", str(error)
        except Exception as error:
            found = f"{kind} raised {type(error).__name__}", repr(str(error))
        taken = time.process_time() - start
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
        if sorted(each.name for each in Path(folder).iterdir()) != sorted(files):
            found = "the folder has changed", ", ".join(sorted(each.name for each in Path(folder).iterdir()))
    if found is None and taken > SLOW_S:
        found = f"{kind} is slow", f"{taken:.0f} s of the processor"
    if found is None and grown > LARGE_KIB:
        found = f"{kind} takes memory", f"{grown >> 10} MiB"
    return [Failure(*found, case)] if found else []


# How they are read ---------------------------------------------------------------------------------------------------


def _material(path: Path) -> Wrong:
    """The material is the same once it is written."""
    from velatura.programs.formats import FORMATS

    names, _ = import_module(FORMATS[path.suffix]).materials(path)
    found = vt.imports.read(path, next(iter(names), None))
    for format in ("yaml", "json"):
        if loads(dumps(found.stack, format), f"again.{format}") != found.stack:
            return f"not equal from {format}", dumps(found.stack, format)[:200]
    if any(not str(each).isprintable() for each in found.left):
        return "a note of several lines", repr([str(each) for each in found.left])
    return None


def _spectrum(path: Path) -> Wrong:
    """The table is the same once it is written."""
    table = vt.Spectrum(spectrum=path).table()
    with tempfile.TemporaryDirectory() as folder:
        again = Path(folder, "again.spd")
        again.write_text("".join(f"{x!r} {y!r}\n" for x, y in zip(*table)))
        return None if vt.Spectrum(spectrum=again).table() == table else ("a spectrum is not equal", repr(table)[:200])


def _table(path: Path) -> Wrong:
    """The table is finite, and the same when it is read again."""
    one, two = load_table(path), load_table(path)
    if not (np.isfinite(one.value).all() and np.isfinite(one.directions.wi).all() and one.value.size):
        return "a table is not finite", str(path.suffix)
    return None if np.array_equal(one.value, two.value) else ("a table is not equal", str(path.suffix))


def _texture(path: Path) -> Wrong:
    """The texels are finite."""
    texels = texels_of_file(kernel.mitsuba(), "alpha", vt.Texture(texture=path, channel="r"), False)
    return None if texels.size and np.isfinite(texels).all() else ("texels are not finite", str(texels.shape))


# Files ---------------------------------------------------------------------------------------------------------------


def _number(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 1.0, 0.5, float(rng.uniform()), float(rng.uniform(1, 3))]))


def _values(rng: np.random.Generator, tag: str) -> dict[str, float | list[float]]:
    """Some parameters of a surface."""
    declared = SHADERS[tag].PARAMETERS
    chosen = rng.choice(len(declared), min(6, len(declared)), replace=False)
    return {
        declared[k].name: [_number(rng) for _ in range(3)] if declared[k].is_colour else _number(rng) for k in chosen
    }


def _materialx(rng: np.random.Generator) -> Files:
    tag = str(rng.choice(list(SHADERS)))
    names = {theirs: ours for ours, theirs in RENAMED.get(tag, {}).items()}
    inputs, nodes = "", ""
    for k, (name, value) in enumerate(_values(rng, tag).items()):
        kind = "color3" if isinstance(value, list) else "float"
        text = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
        if rng.random() < 0.4:
            node = str(rng.choice(["multiply", "add", "power", "divide", "invert", "dot", "extract", "swizzle"]))
            source = f'<image name="i{k}" type="{kind}"><input name="file" type="filename" value="a.png"/></image>'
            if rng.random() < 0.5:
                source = (
                    f'<constant name="i{k}" type="{kind}"><input name="value" type="{kind}" value="{text}"/></constant>'
                )
            nodes += source + f'<{node} name="n{k}" type="{kind}"><input name="in1" nodename="i{k}"/>'
            nodes += f'<input name="in" nodename="i{k}"/><input name="in2" nodename="n{max(k - 1, 0)}"/></{node}>'
            nodes += f'<output name="o{k}" type="{kind}" nodename="n{k}"/>'
            inputs += f'<input name="{names.get(name, name)}" type="{kind}" nodegraph="G" output="o{k}"/>\n'
        else:
            inputs += f'<input name="{names.get(name, name)}" type="{kind}" value="{text}"/>\n'
    graph = f'<materialx version="1.39"><nodegraph name="G">{nodes}</nodegraph></materialx>'
    surface = f'<{tag} name="S" type="surfaceshader">\n{inputs}</{tag}>'
    material = '<surfacematerial name="M"><input name="surfaceshader" nodename="S"/></surfacematerial>'
    look = '<look name="L"><materialassign name="A" material="M"/></look>' if rng.random() < 0.3 else ""
    head = '<materialx version="1.39" colorspace="lin_rec709" xmlns:xi="x">\n<xi:include href="b.mtlx"/>'
    text = f"{head}\n{surface}\n{material}{look}</materialx>\n"
    if rng.random() < 0.2:
        text = f'<?xml version="1.0"?>\n{embedded.in_xml(_held(), text)}'
    return {"a.mtlx": text.encode(), "b.mtlx": graph.encode(), "a.png": picture(".png")}


def _gltf(rng: np.random.Generator, ending: str = ".gltf") -> Files:
    image = picture(".png")
    inline = f"data:image/png;base64,{base64.b64encode(image).decode()}"
    images: list[dict[str, Any]] = [{"uri": "a.png"}, {"uri": inline, "name": "b"}, {"bufferView": 0}]
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "images": images,
        "textures": [{"source": k} for k in range(3)],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(image)}],
        "buffers": [{"byteLength": len(image)} | ({} if ending == ".glb" else {"uri": inline})],
    }
    material: dict[str, Any] = {"name": "M", "extensions": {}}
    for factor in SHADERS["gltf_pbr"].PARAMETERS:
        if rng.random() < 0.4:
            value = [_number(rng) for _ in range(3)] if factor.is_colour else _number(rng)
            part = material if factor.within == "pbrMetallicRoughness" else material["extensions"]
            if factor.within:
                part.setdefault(factor.within, {})[factor.name] = value
    for part, key in (
        ("pbrMetallicRoughness", "baseColorTexture"),
        ("pbrMetallicRoughness", "metallicRoughnessTexture"),
    ):
        if rng.random() < 0.5:
            material.setdefault(part, {})[key] = {"index": int(rng.integers(3))}
    if rng.random() < 0.2:
        document["asset"]["generator"] = "Velatura 1"
        material["extras"] = {embedded.KEY: embedded.in_gltf(_held(), material)}
    text = json.dumps({**document, "materials": [material]}, indent=1).encode()
    if ending == ".glb":
        text = _text_changed(text, rng)
        text += b" " * (-len(text) % 4)
        rest = struct.pack("<I4s", len(image), b"BIN\0") + image
        text = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest
    return {f"a{ending}": text, "a.png": image}


def _glb(rng: np.random.Generator) -> Files:
    return _gltf(rng, ".glb")


def _scene(rng: np.random.Generator) -> Files:
    inside = ""
    for name, value in _values(rng, "disney_principled").items():
        if isinstance(value, list):
            inside += f'<rgb name="{name}" value="{", ".join(map(str, value))}"/>\n'
        elif rng.random() < 0.3:
            inside += f'<texture name="{name}" type="bitmap"><string name="filename" value="a.png"/></texture>\n'
        else:
            inside += f'<float name="{name}" value="{value}"/>\n'
    bsdf = f'<bsdf type="principled" id="M">\n{inside}</bsdf>'
    text = f'<scene version="3.0.0">\n<default name="x" value="0.5"/>\n{bsdf}\n</scene>\n'
    return {
        "a.xml": (embedded.in_xml(_held(), text) if rng.random() < 0.2 else text).encode(),
        "a.png": picture(".png"),
    }


def _spectra(rng: np.random.Generator) -> Files:
    rows = "".join(f"{nm:g} {rng.uniform(1, 2):.4f}\n" for nm in np.linspace(380, 780, rng.integers(2, 30)))
    return {"a.spd": b"# nm value\n" + rows.encode()}


def _csv(rng: np.random.Generator) -> Files:
    brushed = rng.random() < 0.5
    head = "theta_i,phi_i,theta_o,phi_o,r,g,b" if brushed else "theta_i,theta_o,phi,r,g,b"
    rows = (rng.uniform(0, 80, 4 if brushed else 3).tolist() + rng.uniform(0, 2, 3).tolist() for _ in range(5))
    return {"a.csv": "\n".join([head, *(",".join(f"{x:.3f}" for x in row) for row in rows)]).encode()}


def _merl(rng: np.random.Generator) -> Files:
    counts = rng.integers(1, 5, 3)
    data = rng.uniform(-0.1, 1, 3 * int(np.prod(counts)))
    return {"a.binary": counts.astype("<i4").tobytes() + data.astype("<f8").tobytes()}


def _rgl(rng: np.random.Generator) -> Files:
    n = int(rng.choice([1, 2, 4]))
    grids = rng.uniform(0.1, 1, (4, 4)), rng.uniform(0.1, 1, (4, 4))
    return {"a.bsdf": tensors(rgl(*grids, np.linspace(0, 6, n), rgb=rng.uniform(0, 1, (n, 3, 3, 4, 4))))}


def _rgl_spectra(rng: np.random.Generator) -> Files:
    n = int(rng.integers(1, 5))
    grids = rng.uniform(0.1, 1, (4, 4)), rng.uniform(0.1, 1, (4, 4))
    colours = {"wavelengths": np.linspace(400, 700, n), "spectra": rng.uniform(0, 1, (1, 3, n, 4, 4))}
    return {"a.bsdf": tensors(rgl(*grids, **colours))}


def rgl(
    ndf: np.ndarray, sigma: np.ndarray, phi_i: Sequence[float] | np.ndarray = (0.0,), **colours: np.ndarray
) -> dict[str, np.ndarray]:
    """Arrays of a measurement of the RGL database (Dupuy & Jakob 2018) at three angles of incidence, without a warp."""
    even = np.ones((len(phi_i), 3, 4, 4))
    grids = {"phi_i": phi_i, "ndf": ndf, "sigma": sigma, "vndf": even, "luminance": even, **colours}
    return {
        "description": np.frombuffer(b"made", np.uint8),
        "jacobian": np.array([1], np.uint8),
        "theta_i": np.array([0, 0.8, 1.5], np.float32),
        **{name: np.asarray(grid, np.float32) for name, grid in grids.items()},
    }


def _polarised(rng: np.random.Generator) -> Files:
    single, counts = np.float32, [int(n) for n in rng.integers(1, 4, 3)]
    axes = {
        name: np.linspace(0, 1.2, n)[None].astype(single) for name, n in zip(("phi_d", "theta_d", "theta_h"), counts)
    }
    wavelengths = np.array([450, 550, 650], np.uint16)
    matrices = rng.uniform(-0.1, 1, (*counts, 3, 4, 4)).astype(single)
    return {"a.pbsdf": tensors({**axes, "wvls": wavelengths, "M": matrices})}


def _astm(rng: np.random.Generator) -> Files:
    names = str(rng.choice(["BRDF", "R,G,B", "X,Y,Z", "450nm,550nm,650nm"]))
    rows = (rng.uniform(0, 1.5, 5 + names.count(",")) for _ in range(5))
    lines = [
        f"NUM_POINTS 5\nVARS theta_i,phi_i,theta_s,phi_s,{names}",
        *(",".join(f"{x:.3f}" for x in row) for row in rows),
    ]
    return {"a.astm": "\n".join(lines).encode()}


def _zemax(rng: np.random.Generator) -> Files:
    content = str(rng.choice(["Monochrome", "XYZ"]))
    text = f"Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent {content}\nScatterType BRDF\n"
    text += "SampleRotation 1\n0\nAngleOfIncidence 2\n0 40\nScatterAzimuth 2\n0 180\nScatterRadial 3\n0 5 30\n"
    for name in ("Monochrome",) if content == "Monochrome" else [f"Tristimulus{x}" for x in "XYZ"]:
        blocks = (" ".join(f"{x:.3f}" for x in rng.uniform(0, 1, 6)) for _ in range(2))
        text += f"{name}\nDataBegin\n" + "".join(f"TIS 0.5\n{block}\n" for block in blocks) + "DataEnd\n"
    return {"a.bsdf": text.encode()}


def tensors(fields: dict[str, np.ndarray]) -> bytes:
    """Arrays in the format of tensor files: a head with names, types, places and shapes, then the numbers."""
    types = {np.dtype(np.uint8): 1, np.dtype(np.uint16): 3, np.dtype(np.float32): 10}
    head, body = b"tensor_file\0" + bytes([1, 0]) + struct.pack("<I", len(fields)), b""
    begin = len(head) + sum(2 + len(name) + 2 + 1 + 8 + 8 * field.ndim for name, field in fields.items())
    for name, field in fields.items():
        kind, place = types[field.dtype], begin + len(body)
        head += struct.pack("<H", len(name)) + name.encode() + struct.pack("<HBQ", field.ndim, kind, place)
        head += struct.pack(f"<{field.ndim}Q", *field.shape)
        body += field.tobytes()
    return head + body


ENDINGS = (".png", ".jpg", ".exr", ".hdr", ".pfm", ".ppm", ".bmp", ".tga")


def _picture(rng: np.random.Generator) -> Files:
    ending = str(rng.choice(ENDINGS[:5]))
    return {f"a{ending}": picture(ending)}


@functools.cache
def picture(ending: str) -> bytes:
    """A picture of 4 x 3 pixels in a format."""
    mi = kernel.mitsuba()
    texels = np.random.default_rng(0).uniform(0, 1, (3, 4, 3)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"a{ending}")
        single = ending in (".exr", ".hdr", ".pfm")
        mi.Bitmap(texels if single else (texels * 255).astype(np.uint8)).write(str(path))
        return path.read_bytes()


def _held() -> Any:
    return json.loads(dumps(vt.preset("coated-gold"), "json"))


#: How a kind is made and read, and whether it is binary.
KINDS: dict[str, tuple[Callable[[np.random.Generator], Files], Callable[[Path], Wrong], bool]] = {
    "mtlx": (_materialx, _material, False),
    "gltf": (_gltf, _material, False),
    "glb": (_glb, _material, True),
    "xml": (_scene, _material, False),
    "spectrum": (_spectra, _spectrum, False),
    "csv": (_csv, _table, False),
    "merl": (_merl, _table, True),
    "rgl": (_rgl, _table, True),
    "rgl-spectra": (_rgl_spectra, _table, True),
    "polarised": (_polarised, _table, True),
    "astm": (_astm, _table, False),
    "zemax": (_zemax, _table, False),
    "texture": (_picture, _texture, True),
}

# How they are changed ------------------------------------------------------------------------------------------------


def _text_changed(data: bytes, rng: np.random.Generator) -> bytes:
    if rng.random() < 0.1:
        return bytes_changed(data, rng)
    text = data.decode("utf-8", "replace")
    text = changed(text, rng) if rng.random() < 0.3 else _with_value(text, rng)
    return text.encode("utf-8", "surrogatepass")


def _with_value(text: str, rng: np.random.Generator) -> str:
    """A text with another value in quotes, or in place of a number, so that it is mostly XML or JSON still."""
    places = [match.span() for match in re.finditer(r'(?<=")[^"]*(?=")|-?[0-9][\w.+-]*', text)] or [(0, len(text))]
    begin, end = places[rng.integers(len(places))]
    if text[begin - 1 : begin] == '"' == text[end : end + 1]:
        words = OWN_WORDS if rng.random() < 0.7 else WORDS
        word = words[int(rng.integers(len(words)))]
        word = json.dumps(word)[1:-1] if text.lstrip().startswith("{") else escape(word, {'"': "&quot;"})
    else:
        word = NUMBERS[rng.integers(len(NUMBERS))]
    return text[:begin] + word + text[end:]


def _data_changed(data: bytes, rng: np.random.Generator) -> bytes:
    what = rng.random()
    if what < 0.3 or len(data) < 16:
        return bytes_changed(data, rng)
    if what < 0.4:
        return data[: rng.integers(len(data))]
    # An integer, or a number, most in the head
    size = int(rng.choice([2, 4, 8]))
    at = int(rng.integers(min(len(data) - 8, 400 if rng.random() < 0.8 else len(data))))
    ends = (*ENDS, *(int.from_bytes(struct.pack("<f", x), "little") for x in (np.nan, np.inf, -1.0, 1e30)))
    value = int(ends[rng.integers(len(ends))]) % 2 ** (8 * size)
    return data[:at] + value.to_bytes(size, "little" if rng.random() < 0.7 else "big") + data[at + size :]
