"""The tables that a shader reads, as one texture of floats, and the code that reads it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from velatura import tables
from velatura.tables import Table

WIDTH = 1024  # texels

HELPERS = f"""\
vec4 vt_texel(int i) {{
    return texelFetch(vt_tables, ivec2(i % {WIDTH}, i / {WIDTH}), 0);
}}

float vt_float(int i) {{
    vec4 texel = vt_texel(i / 4);
    return texel[i % 4];
}}

// One texel of the nodes of a plane, interpolated in single precision, which filters of textures do not have
vec4 vt_plane(int start, ivec2 nodes, int texels, int texel, vec2 at) {{
    vec2 position = clamp(at, 0.0, 1.0) * vec2(nodes - 1);
    ivec2 cell = min(ivec2(position), nodes - 2);
    vec2 upper = position - vec2(cell);
    int down = nodes.y * texels;
    int i = start + cell.x * down + cell.y * texels + texel;
    vec4 a = mix(vt_texel(i), vt_texel(i + texels), upper.y);
    vec4 b = mix(vt_texel(i + down), vt_texel(i + down + texels), upper.y);
    return mix(a, b, upper.x);
}}

// The same in space
vec4 vt_space(int start, ivec3 nodes, int texels, int texel, vec3 at) {{
    float position = clamp(at.x, 0.0, 1.0) * float(nodes.x - 1);
    int cell = min(int(position), nodes.x - 2);
    int deep = nodes.y * nodes.z * texels, i = start + cell * deep;
    vec4 a = vt_plane(i, nodes.yz, texels, texel, at.yz), b = vt_plane(i + deep, nodes.yz, texels, texel, at.yz);
    return mix(a, b, position - float(cell));
}}

// The same for one number a node, four of them in a texel
float vt_volume(int start, ivec3 nodes, vec3 at) {{
    vec3 position = clamp(at, 0.0, 1.0) * vec3(nodes - 1);
    ivec3 cell = min(ivec3(position), nodes - 2);
    vec3 upper = position - vec3(cell);
    int i = 4 * start + (cell.x * nodes.y + cell.y) * nodes.z + cell.z, z = nodes.z, yz = nodes.y * nodes.z;
    vec2 a = mix(vec2(vt_float(i), vt_float(i + 1)), vec2(vt_float(i + z), vt_float(i + z + 1)), upper.y);
    i += yz;
    vec2 b = mix(vec2(vt_float(i), vt_float(i + 1)), vec2(vt_float(i + z), vt_float(i + z + 1)), upper.y);
    vec2 along = mix(a, b, upper.x);
    return mix(along.x, along.y, upper.z);
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
        lines = [f"float vt_{name}({arguments}) {{", f"    return vt_volume({start}, {size}, {at});"]
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
