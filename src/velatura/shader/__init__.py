"""The model as shader code: its own functions, recorded and printed as GLSL."""

from velatura.shader.material import constant
from velatura.shader.program import Shader, shader
from velatura.shader.recording import Recording, record, structure, variance

__all__ = ["Recording", "Shader", "constant", "record", "shader", "structure", "variance"]
