"""A shader in GLSL ES 3.00, and the texture of the tables that it reads."""

from __future__ import annotations

from velatura.exports.formats import Export, Request
from velatura.shader import shader
from velatura.stack import Varying


def write(request: Request) -> Export:
    """The shader; beside it, if it reads any tables, little-endian floats in rows of RGBA."""
    free = [name for name, value in request.stack.flat().items() if not isinstance(value, Varying)]
    made = shader(request.stack, request.model, free if list(request.constant) == ["all"] else request.constant)
    return Export(made.text, {".tables.bin": made.tables.astype("<f4").tobytes()} if made.looked_up else {})
