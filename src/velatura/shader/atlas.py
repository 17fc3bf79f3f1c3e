"""The tables that a shader reads, as one texture of floats, and the code that reads it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from velatura import tables
from velatura.tables import Table

WIDTH = 1024  # texels

# Loops over corners, where code without them is longer: compilers of shaders take their time for every call again
HELPERS = f"""\
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


def pack(names: Iterable[str]) -> tuple[np.ndarray, str]:
    """The texture, float32 of shape (height, WIDTH, 4), and the functions that read each table from it."""
    parts: list[np.ndarray] = []
    readers, start = [], 0
    for name, table in tables.load().items():
        if name in set(names):
            flat = _texels(table)
            parts.append(flat)
            readers.append(_reader(name, table, start))
            start += len(flat)
    filled = np.concatenate([*parts, np.zeros((-start % WIDTH if parts else WIDTH, 4), np.float32)])
    return filled.reshape(-1, WIDTH, 4), "".join(readers)


def texels(name: str) -> int:
    """How many texels a node of a table takes, if it has more than one channel."""
    return (getattr(tables.load(), name).data.shape[-1] + 3) // 4


def _texels(table: Table) -> np.ndarray:
    """Nodes in order of their axes, channels filled up to whole texels; a single one is packed."""
    channels = table.data.shape[-1]
    flat = table.data.reshape(-1, channels)
    if channels == 1:
        return np.pad(flat.ravel(), (0, -len(flat) % 4)).reshape(-1, 4)
    return np.pad(flat, ((0, 0), (0, -channels % 4))).reshape(-1, 4)


def _reader(name: str, table: Table, start: int) -> str:
    """A function of the coordinates; it loops over texels, which compiles faster than reading them one by one."""
    nodes, channels, count = table.shape, table.data.shape[-1], texels(name)
    axes = "xyz"[: len(nodes)]
    size, at = f"ivec{len(nodes)}({', '.join(map(str, nodes))})", f"vec{len(nodes)}({', '.join(axes)})"
    arguments = ", ".join(f"float {axis}" for axis in axes)
    if channels == 1:
        colours = arguments.replace("float", "vec3")
        each = ", ".join(f"{axis}[c]" for axis in axes)
        lines = [
            f"float vt_{name}({arguments}) {{",
            f"    return vt_volume({start}, {size}, {at});",
            "}",
            f"vec3 vt_{name}({colours}) {{",
            "    vec3 colour;",
            f"    for (int c = 0; c < 3; c++) colour[c] = vt_{name}({each});",
            "    return colour;",
        ]
    else:
        read = f"vt_{'plane' if len(nodes) == 2 else 'space'}({start}, {size}, {count}, i, {at})"
        lines = [
            f"vec4[{count}] vt_{name}({arguments}) {{",
            f"    vec4 texels[{count}];",
            f"    for (int i = 0; i < {count}; i++) texels[i] = {read};",
            "    return texels;",
        ]
    described = f"{' x '.join(map(str, nodes))} nodes, {channels} channel{'s' * (channels > 1)}"
    return "\n".join(["", f"// {described}", *lines, "}", ""])
