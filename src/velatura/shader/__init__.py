"""The model as shader code: its own functions, recorded, and printed by the printer of a language."""

from velatura.shader.material import constant
from velatura.shader.printers.printer import Printer
from velatura.shader.program import Shader, shader
from velatura.shader.recorder.recording import Recording, record, structure, variance

__all__ = ["Printer", "Recording", "Shader", "constant", "record", "shader", "structure", "variance"]
