"""Machines that run printed shaders on arrays of numbers: a compute shader for each language, on the CPU.

WGSL runs as it is; Vulkan GLSL, HLSL and Slang are compiled to SPIR-V by glslangValidator and Slang's own compiler,
HLSL by both. All four run on the Vulkan device that `wgpu` finds. GLSL 4.50 runs in an OpenGL context without a window.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from velatura.shader.printers.c_like import FILMS, MAPS, SAMPLER, TABLES, VALUES, CLike
from velatura.shader.printers.glsl import Desktop, Vulkan
from velatura.shader.printers.hlsl import Hlsl, Slang
from velatura.shader.printers.printer import Struct
from velatura.shader.printers.wgsl import Wgsl

THREADS = 64  # of a group
RESULTS, GIVEN = 0, 1  # bindings of the second group
IN_OPENGL = 8  # textures of materials stay below
SLANG, HLSL = 1, 2  # languages by Slang's compiler
SLOTS = {"vt_tables": TABLES, "vt_baked": TABLES, "vt_films": FILMS}
INSTALLED = "apt-get install -y mesa-vulkan-drivers libvulkan1 glslang-tools, and pip install wgpu slangpy moderngl"


@dataclass(frozen=True)
class Changing:
    """Values that change: numbers by their place in the material, whose `structs` are declared, and arrays (N,) or
    (N, 3) by name, in the order of their declaration."""

    structs: Sequence[Struct]
    values: Mapping[str, Sequence[float]]
    arrays: Mapping[str, np.ndarray]

    def packed(self, least: int) -> bytes:
        """The contents of a buffer, where structs and elements of arrays are aligned to `least` bytes or more: 16 in
        uniform blocks (std140), 4 in storage."""
        fields = {struct.name: struct.fields for struct in self.structs}
        data, end = bytearray(), 0

        def aligned(at: int, to: int) -> int:
            return -(-at // to) * to

        def put(at: int, numbers: Any) -> int:
            own = np.asarray(numbers, "<f4").tobytes()
            data.extend(bytes(max(0, at + len(own) - len(data))))
            data[at : at + len(own)] = own
            return at + len(own)

        def alignment(kind: str) -> int:
            if kind in fields:
                return max(least, *(alignment(field.type) for field in fields[kind]))
            return 16 if kind == "colour" else 4

        def placed(kind: str, place: str, at: int) -> int:
            at = aligned(at, alignment(kind))
            if kind not in fields:
                return put(at, self.values[place])
            for name, own, _ in fields[kind]:
                at = placed(own, f"{place}.{name}".lstrip("."), at)
            return aligned(at, alignment(kind))

        end = placed("VtMaterial", "", 0)
        for array in self.arrays.values():
            stride = 16 if array.ndim > 1 else max(4, least)
            end = aligned(end, stride)
            for numbers in array:
                put(end, numbers)
                end += stride
        return bytes(data).ljust(aligned(end, 16), b"\0")


class Machine(ABC):
    """A language, and what compiles and runs it."""

    printer: CLike

    @abstractmethod
    def missing(self) -> str:
        """The tool that must be installed before anything can run, or nothing."""

    @abstractmethod
    def compile(self, text: str) -> None:
        """Refuse a program that is not of the language."""

    @abstractmethod
    def declarations(self, count: int) -> str:
        """The texture `vt_given`, and the array `results`."""

    @abstractmethod
    def main(self, lines: Sequence[str]) -> str:
        """Statements for each `row` below a number of them."""

    @abstractmethod
    def run(
        self,
        text: str,
        count: int,
        size: int,
        textures: Mapping[str, np.ndarray],
        bindings: Mapping[str, int] = SLOTS,
        changing: Changing | None = None,
    ) -> np.ndarray:
        """Results of a program: `size` of them for each of so many rows, (count, size, 4).

        Textures are float arrays (height, width, 4) by name; among them `vt_given`, with a row for each. `changing` is
        what a program with uniforms reads.
        """


class _OnVulkan(Machine):
    storage = False  # whether values that change are in a storage buffer, not in a uniform block

    def missing(self) -> str:
        if find_spec("wgpu") is None:
            return f"wgpu is missing: {INSTALLED}"
        return "" if _device() else f"there is no Vulkan device: {INSTALLED}"

    def run(
        self,
        text: str,
        count: int,
        size: int,
        textures: Mapping[str, np.ndarray],
        bindings: Mapping[str, int] = SLOTS,
        changing: Changing | None = None,
    ) -> np.ndarray:
        import wgpu

        device = _device()
        shader = device.create_shader_module(code=self.code(text))
        maps = [name for name in textures if name.startswith("vt_map")]
        places = {**bindings, **{name: MAPS + k for k, name in enumerate(maps)}}
        given: tuple[list[dict], list[dict]] = ([], [])
        views = []
        for name, data in textures.items():
            group, place = (1, GIVEN) if name == "vt_given" else (0, places[name])
            kind = "float" if name in maps else "unfilterable-float"
            views.append(_texture(device, data, name in maps))
            given[group].append({"binding": place, "resource": views[-1], "kind": kind})
        if maps:
            filtering = device.create_sampler(mag_filter="linear", min_filter="linear")
            given[0].append({"binding": SAMPLER, "resource": filtering, "kind": "filtering"})
        if changing:
            packed = changing.packed(4 if self.storage else 16)
            kind = "STORAGE" if self.storage else "UNIFORM"
            block = device.create_buffer_with_data(data=packed, usage=getattr(wgpu.BufferUsage, kind))
            resource = {"buffer": block, "offset": 0, "size": block.size}
            entry = {
                "binding": VALUES,
                "resource": resource,
                "kind": "read-only-storage" if self.storage else "uniform",
            }
            given[0].append(entry)
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
        results = device.create_buffer(size=16 * count * size, usage=usage)
        whole = {"buffer": results, "offset": 0, "size": results.size}
        given[1].append({"binding": RESULTS, "resource": whole, "kind": "storage"})

        # Bind
        layouts = [device.create_bind_group_layout(entries=[_entry(**each) for each in group]) for group in given]
        groups = [
            device.create_bind_group(
                layout=layout, entries=[{key: each[key] for key in ("binding", "resource")} for each in group]
            )
            for layout, group in zip(layouts, given)
        ]
        pipeline = device.create_compute_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=layouts),
            compute={"module": shader, "entry_point": "main"},
        )

        # Run
        encoder = device.create_command_encoder()
        computed = encoder.begin_compute_pass()
        computed.set_pipeline(pipeline)
        for k, group in enumerate(groups):
            computed.set_bind_group(k, group)
        computed.dispatch_workgroups(-(-count // THREADS))
        computed.end()
        device.queue.submit([encoder.finish()])
        found = np.frombuffer(device.queue.read_buffer(results), np.float32).reshape(count, size, 4)
        for each in (results, *(view.texture for view in views)):
            each.destroy()
        return found

    def compile(self, text: str) -> None:
        _device().create_shader_module(code=self.code(text))

    @abstractmethod
    def code(self, text: str) -> str | bytes:
        """The code that the device reads: WGSL or SPIR-V."""


class InWgsl(_OnVulkan):
    printer = Wgsl()
    storage = True

    def declarations(self, count: int) -> str:
        return (
            f"@group(1) @binding({RESULTS}) var<storage, read_write> results: array<vec4f>;\n"
            f"@group(1) @binding({GIVEN}) var vt_given: texture_2d<f32>;\n"
        )

    def main(self, lines: Sequence[str]) -> str:
        head = f"@compute @workgroup_size({THREADS})\nfn main(@builtin(global_invocation_id) id: vec3u) {{"
        return "\n".join([head, "let row = i32(id.x);", *lines, "}"])

    def code(self, text: str) -> str:
        return text.replace("textureSample(map, vt_sampler, uv)", "textureSampleLevel(map, vt_sampler, uv, 0.0)")


class InVulkan(_OnVulkan):
    printer: CLike = Vulkan()

    def missing(self) -> str:
        return super().missing() or ("" if _glslang() else f"glslangValidator is missing: {INSTALLED}")

    def declarations(self, count: int) -> str:
        return (
            f"layout(local_size_x = {THREADS}) in;\n"
            f"layout(set = 1, binding = {RESULTS}) buffer Results {{ vec4 results[]; }};\n"
            f"layout(set = 1, binding = {GIVEN}) uniform texture2D vt_given;\n"
        )

    def main(self, lines: Sequence[str]) -> str:
        return "\n".join(["void main() {", "int row = int(gl_GlobalInvocationID.x);", *lines, "}"])

    def code(self, text: str) -> bytes:
        return spirv(f"#version 450\n{text}", "-V")


_UNFILTERED = "#define VT_SAMPLE(map, uv) map.SampleLevel(vt_sampler, uv, 0.0)\n"


class InHlsl(InVulkan):
    printer = Hlsl()

    def missing(self) -> str:
        return super().missing() or ("" if find_spec("slangpy") else f"slangpy is missing: {INSTALLED}")

    def declarations(self, count: int) -> str:
        return (
            f"RWStructuredBuffer<float4> results : register(u{RESULTS}, space1);\n"
            f"Texture2D<float4> vt_given : register(t{GIVEN}, space1);\n"
        )

    def main(self, lines: Sequence[str]) -> str:
        head = f"[numthreads({THREADS}, 1, 1)]\nvoid main(uint3 id : SV_DispatchThreadID) {{"
        return "\n".join([head, "int row = int(id.x);", *lines, "}"])

    def code(self, text: str) -> bytes:
        _slang(_UNFILTERED + text, HLSL)  # its front end knows scopes as Microsoft's compilers do
        return spirv(_UNFILTERED + text, "-Od", "-D", "-V", "-e", "main")


class InHlslBySlang(InHlsl):
    """HLSL as Slang's compiler hands it on, where the device takes functions of textures; both compile it."""

    def code(self, text: str) -> bytes:
        super().code(text)
        return _slang(_UNFILTERED + text, HLSL)


class InSlang(InHlsl):
    printer = Slang()

    def main(self, lines: Sequence[str]) -> str:
        return f'[shader("compute")]\n{super().main(lines)}'

    def code(self, text: str) -> bytes:
        return _slang(_UNFILTERED + text)


class InOpenGl(Machine):
    printer = Desktop()

    def missing(self) -> str:
        if find_spec("moderngl") is None:
            return f"moderngl is missing: {INSTALLED}"
        return "" if _context() else "there is no OpenGL 4.5 without a window: apt-get install -y libegl1"

    def compile(self, text: str) -> None:
        _context().compute_shader(f"#version 450\n{text}").release()

    def declarations(self, count: int) -> str:
        return (
            f"layout(local_size_x = {THREADS}) in;\n"
            f"layout(std430, binding = {RESULTS}) buffer Results {{ vec4 results[{count}]; }};\n"
            f"layout(binding = {IN_OPENGL}) uniform sampler2D vt_given;\n"
        )

    def main(self, lines: Sequence[str]) -> str:
        return "\n".join(["void main() {", "int row = int(gl_GlobalInvocationID.x);", *lines, "}"])

    def run(
        self,
        text: str,
        count: int,
        size: int,
        textures: Mapping[str, np.ndarray],
        bindings: Mapping[str, int] = SLOTS,
        changing: Changing | None = None,
    ) -> np.ndarray:
        context: Any = _context()
        program = context.compute_shader(f"#version 450\n{text}")
        maps = [name for name in textures if name.startswith("vt_map")]
        places = {**bindings, "vt_given": IN_OPENGL} | {name: MAPS + k for k, name in enumerate(maps)}
        made = []
        for name, data in textures.items():
            texels = np.ascontiguousarray(data, np.float32)
            texture = context.texture(texels.shape[1::-1], 4, texels.tobytes(), dtype="f4")
            texture.filter = (context.LINEAR,) * 2 if name in maps else (context.NEAREST,) * 2
            texture.use(places[name])
            made.append(texture)
        if changing:
            members = {f"vt_parameters.{place}": np.array([numbers]) for place, numbers in changing.values.items()}
            for name, array in {**members, **changing.arrays}.items():
                if name in program:  # the compiler leaves out what has no effect, ends of arrays among it
                    program[name].write(array[: program[name].array_length].astype("<f4").tobytes())
        results = context.buffer(reserve=16 * size * (-(-count // THREADS) * THREADS))
        results.bind_to_storage_buffer(RESULTS)
        program.run(-(-count // THREADS))
        found = np.frombuffer(results.read(), np.float32).reshape(-1, size, 4)[:count]
        for each in (program, results, *made):
            each.release()
        return found


#: By the format that each is exported as.
MACHINES: dict[str, Machine] = {
    "glsl450": InOpenGl(),
    "vulkan": InVulkan(),
    "hlsl": InHlsl(),
    "slang": InSlang(),
    "wgsl": InWgsl(),
}


def spirv(text: str, *options: str) -> bytes:
    """A compute shader, compiled by glslangValidator."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "shader.comp"), Path(folder, "shader.spv")
        source.write_text(text, encoding="utf-8")
        command = ["glslangValidator", *options, "-S", "comp", "-o", str(target), str(source)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise ValueError(f"{done.returncode}: {done.stdout}{done.stderr}")
        return target.read_bytes()


def _glslang() -> str | None:
    return shutil.which("glslangValidator")


@cache
def _device() -> Any:
    """A Vulkan device, None where there is none."""
    os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())
    os.environ.setdefault("WGPU_BACKEND_TYPE", "Vulkan")
    import wgpu

    try:
        return wgpu.gpu.request_adapter_sync().request_device_sync()
    except Exception:
        return None


@cache
def _context() -> Any:
    """An OpenGL context without a window, None where there is none."""
    import moderngl

    try:
        settings: Any = {"backend": "egl"}
        return moderngl.create_context(standalone=True, require=450, **settings)
    except Exception:
        return None


def _entry(binding: int, resource: Any, kind: str) -> dict[str, Any]:
    """The entry of a group's layout."""
    import wgpu

    described = {
        **{each: {"buffer": {"type": each}} for each in ("storage", "read-only-storage", "uniform")},
        "filtering": {"sampler": {"type": "filtering"}},
    }.get(kind, {"texture": {"sample_type": kind, "view_dimension": "2d"}})
    return {"binding": binding, "visibility": wgpu.ShaderStage.COMPUTE, **described}


def _texture(device: Any, data: np.ndarray, filtered: bool) -> Any:
    """Floats; halves where they are filtered, as devices need not filter floats."""
    import wgpu

    texels = np.ascontiguousarray(data, np.float16 if filtered else np.float32)
    size = (*texels.shape[1::-1], 1)
    texture = device.create_texture(
        size=size,
        format="rgba16float" if filtered else "rgba32float",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
    )
    layout = {"bytes_per_row": texels[0].nbytes, "rows_per_image": texels.shape[0]}
    device.queue.write_texture({"texture": texture}, texels, layout, size)
    return texture.create_view()


@cache
def _compiler() -> tuple[Any, int]:
    """Slang's compiler, and a session of it."""
    spec = find_spec("slangpy")
    assert spec and spec.origin
    (path,) = Path(spec.origin).parent.glob("libslang-compiler.so*")
    library = ctypes.CDLL(str(path))
    pointer, text, integer = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
    for name, kind, *arguments in (
        ("spCreateSession", pointer, text),
        ("spCreateCompileRequest", pointer, pointer),
        ("spDestroyCompileRequest", None, pointer),
        ("spSetCodeGenTarget", None, pointer, integer),
        ("spAddTranslationUnit", integer, pointer, integer, text),
        ("spAddTranslationUnitSourceString", None, pointer, integer, text, text),
        ("spAddEntryPoint", integer, pointer, integer, text, integer),
        ("spCompile", integer, pointer),
        ("spGetDiagnosticOutput", text, pointer),
        ("spGetEntryPointCode", pointer, pointer, integer, ctypes.POINTER(ctypes.c_size_t)),
    ):
        function = getattr(library, str(name))
        function.restype, function.argtypes = kind, arguments
    return library, library.spCreateSession(None)


def _slang(text: str, language: int = SLANG) -> bytes:
    """A compute shader in Slang or HLSL, as SPIR-V."""
    slang, session = _compiler()
    spirv_code, compute = 6, 6  # SLANG_SPIRV, SLANG_STAGE_COMPUTE
    request = slang.spCreateCompileRequest(session)
    try:
        slang.spSetCodeGenTarget(request, spirv_code)
        unit = slang.spAddTranslationUnit(request, language, b"material")
        slang.spAddTranslationUnitSourceString(request, unit, b"material.slang", text.encode())
        slang.spAddEntryPoint(request, unit, b"main", compute)
        if slang.spCompile(request):
            raise ValueError(slang.spGetDiagnosticOutput(request).decode())
        size = ctypes.c_size_t()
        return ctypes.string_at(slang.spGetEntryPointCode(request, 0, ctypes.byref(size)), size.value)
    finally:
        slang.spDestroyCompileRequest(request)
