"""Work of a program in SPIR-V for one pixel, at most: instructions that compute, and texels that are fetched."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import machines

CALL, FUNCTION, END, LABEL, MERGE, CONSTANT, LESS, FETCH = 57, 54, 56, 248, 246, 43, 177, 95
# Names, types, memory, control, and the parts of vectors and structs, which take no instruction of their own
_FREE = frozenset({*range(0, 80), 80, 81, *range(245, 258), 317, *range(330, 335)}) | {86, 100}


@dataclass
class _Function:
    own: int = 0
    fetched: int = 0
    calls: list[tuple[int, int]] = field(default_factory=list)


def counted(code: bytes, name: str = "main") -> tuple[int, int]:
    """Instructions and fetches of a function, with those that it calls; both sides of branches, all rounds of loops."""
    words = struct.unpack(f"<{len(code) // 4}I", code)
    functions: dict[int, _Function] = {}
    names, constants = dict[str, int](), dict[int, int]()
    merges: list[tuple[int, int]] = []  # of open loops: where each ends, and how often it runs
    current, at = _Function(), 5
    rounds = _rounds(words)
    while at < len(words):
        op, size = words[at] & 0xFFFF, words[at] >> 16
        args = words[at + 1 : at + size]
        if op == 5:  # OpName
            text = struct.pack(f"<{size - 2}I", *args[1:]).split(b"\0")[0].decode()
            names.setdefault(text.split("(")[0], args[0])
        elif op == CONSTANT:
            constants[args[1]] = args[2]
        elif op == FUNCTION:
            current = functions[args[1]] = _Function()
        elif op == LABEL and merges and merges[-1][0] == args[0]:
            merges.pop()
        elif op == MERGE:
            merges.append((args[0], rounds[at]))
        times = 1
        for _, each in merges:
            times *= each
        if op == CALL:
            current.calls.append((times, args[2]))
        current.fetched += times * (op == FETCH)
        current.own += times * (op not in _FREE)
        at += size

    def total(which: int) -> tuple[int, int]:
        function = functions[which]
        inner = [(times, *total(called)) for times, called in function.calls]
        return (
            function.own + sum(times * a for times, a, _ in inner),
            function.fetched + sum(times * b for times, _, b in inner),
        )

    return total(names[name])


def _rounds(words: tuple[int, ...]) -> dict[int, int]:
    """How often the loop runs that is merged at a place: up to the constant that its index is less than."""
    constants: dict[int, int] = {}
    found: dict[int, int] = {}
    at, opened = 5, -1
    while at < len(words):
        op, size = words[at] & 0xFFFF, words[at] >> 16
        if op == CONSTANT:
            constants[words[at + 2]] = words[at + 3]
        elif op == MERGE:
            opened = at
        elif op == LESS and opened >= 0:
            found[opened], opened = constants[words[at + 4]], -1
        at += size
    return found


ENTRY = """
layout(local_size_x = 1) in;
layout(set = 1, binding = 0) buffer Given { vec4 given[]; };
void main() {
    vec3 wi = given[0].xyz, wo = given[1].xyz, u = given[2].xyz;
    VtMaterial m = vt_material(vec2(0.5));
    VtLobes l = vt_lobes(m, wi);
    given[3] = vt_eval_pdf(m, l, wi, wo) + vec4(vt_sample(m, l, wi, u), 0.0);
}
"""
FUNCTIONS = ("vt_lobes", "vt_eval_pdf", "vt_sample")


def counts(text: str) -> dict[str, tuple[int, int]]:
    """Instructions and fetches of each function of a shader in GLSL for Vulkan."""
    code = machines.spirv(f"#version 450\n{text}{ENTRY}", "-V")
    return {name: counted(code, name) for name in FUNCTIONS}
