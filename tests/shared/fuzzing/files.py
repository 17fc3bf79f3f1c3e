"""Mutated material files: each is refused in one line that names it, or means the same once it is written again."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import velatura as vt
from fuzzing import Failure
from fuzzing.stacks import random_stack
from velatura.errors import InvalidInput
from velatura.stack import dumps, loads, save

SLOW_S = 5.0
ENDINGS = (".yaml", ".yml", ".json", ".YAML", ".txt", "")
ENCODINGS = ("utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1", "cp037", "utf-7")
SPACES = ("\t", "\r", "\r\n", "\x00", "\x0b", "\x0c", "\x1b", "\x85", "\xa0", "\u2028", "\u2029", "\ufeff", "\u202e")
NUMBERS_AND_SIGNS = """
~ null true yes no on off .nan .inf -.inf NaN Infinity -0 0x1F 0o17 1_000 1:30 12e03 1e400 -1e400 1e39 1e-400
2026-11-22 2026-13-45 2001-12-14t21:59:43.10-05:00 << = * & ! | > % @ ` ? - : , [] {} [[]] [{}] {{}} '' [,] {,} \"'
eta k alpha layers interface medium diffuse conductor rotation texture brushing Au bk7 mirror films name
"""
TAGS = """
!!timestamp foo; !!bool maybe; !!binary ///; !!set {1, 2}; !!omap [1]; !!pairs [1]; !!int x; !!float x; !!null x;
!!str 1; !!map []; !!seq {}; !!merge x; !!value =; !x y; !<tag:a> 1; !!python/object/apply:os.getcwd [];
!!python/name:os.getcwd; &a [*a]; *a; &a 1; <<: *a; <<: {}
"""
VALUES = """
{texture: a.png}; {texture: .}; {texture: ''}; {texture: a.png, channel: x}; {brushing: radial, u: x}; [1, 2];
[1, 2, 3]; [1, 2, 3, 4]; [1, [2], 3]; {1: 2}; {[1]: 2}; {null: 1}; ? a; --- {}; ...; a b
"""
WORDS = (
    *NUMBERS_AND_SIGNS.split(),
    *(word.strip() for word in (TAGS + ";" + VALUES).split(";")),
    *("9" * 5000, "1." + "0" * 400, "[" * 300, "{a: " * 200, "- " * 200, "é", "\U0001f600", "\ud800"),
)


def trial(rng: np.random.Generator) -> list[Failure]:
    """A preset or a random stack as a file, changed in a few places."""
    stack = vt.preset(str(rng.choice(vt.presets()))) if rng.random() < 0.5 else random_stack(rng, rng.random() < 0.5)
    text = dumps(stack, str(rng.choice(["yaml", "json"]))) if rng.random() < 0.8 else _long_hand(stack)
    for _ in range(rng.integers(1, 4)):
        text = changed(text, rng)
    encoding = str(rng.choice(ENCODINGS)) if rng.random() < 0.2 else "utf-8"
    data = text.encode(encoding, "surrogatepass" if encoding.startswith("utf-") and encoding != "utf-7" else "replace")
    if rng.random() < 0.2:
        data = bytes_changed(data, rng)
    like = ".json" if text.lstrip().startswith("{") else ".yaml"
    return tried(data, like if rng.random() < 0.9 else str(rng.choice(ENDINGS)))


def tried(data: bytes, ending: str) -> list[Failure]:
    """Failures of how a file of this content is read."""
    case = {"ending": ending, "content": data}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "material" + ending)
        path.write_bytes(data)
        start = time.perf_counter()
        try:
            found = _read(path)
        except InvalidInput as error:
            one_line = len(str(error).splitlines()) == 1 and str(error).isprintable()
            found = None if one_line else ("refused in several lines", repr(str(error)))
            if one_line and not str(error).startswith(f"{path}: "):
                found = "refused without naming the file", str(error)
        except Exception as error:
            found = f"raised {type(error).__name__}", repr(str(error))
        taken = time.perf_counter() - start
        if [*Path(folder).iterdir()] != [path] or path.read_bytes() != data:
            found = "the folder has changed", ", ".join(sorted(entry.name for entry in Path(folder).iterdir()))
    if found is None and taken > SLOW_S:
        found = "slow", f"{taken:.0f} s"
    return [Failure(*found, case)] if found else []


def _read(path: Path) -> tuple[str, str] | None:
    """The fault of a file that is accepted: what is written of it must be read as the same."""
    stack = vt.load(path)
    for written in ("yaml", "json"):
        if loads(dumps(stack, written), f"again.{written}") != stack:
            return f"not equal from {written}", dumps(stack, written)[:200]
    with tempfile.TemporaryDirectory() as folder:
        save(stack, Path(folder, "again.yaml"))
        if vt.load(Path(folder, "again.yaml")) != stack:
            return "not equal once saved", dumps(stack)[:200]
    return None


# How texts are changed


def changed(text: str, rng: np.random.Generator) -> str:
    """A text with one thing changed."""
    return _CHANGES[rng.integers(len(_CHANGES))](text, rng)


def _long_hand(stack: vt.Stack) -> str:
    """YAML in block style, every value on a line of its own."""
    import yaml

    return yaml.safe_dump(stack.to_dict(), sort_keys=False)


def _place(text: str, rng: np.random.Generator) -> int:
    return int(rng.integers(len(text) + 1))


def _token(text: str, rng: np.random.Generator) -> tuple[int, int]:
    """Where a word or number of the text begins and ends."""
    import re

    found = [match.span() for match in re.finditer(r"[\w.+-]+", text)] or [(0, len(text))]
    return found[rng.integers(len(found))]


def _with_word(text: str, rng: np.random.Generator) -> str:
    begin, end = _token(text, rng)
    return text[:begin] + str(rng.choice(WORDS)) + text[end:]


def _tagged(text: str, rng: np.random.Generator) -> str:
    begin, _ = _token(text, rng)
    return f"{text[:begin]}{rng.choice([word for word in WORDS if word[0] in '!&'])} {text[begin:]}"


def _swapped(text: str, rng: np.random.Generator) -> str:
    (a, b), (c, d) = sorted([_token(text, rng), _token(text, rng)])
    return text if b > c else text[:a] + text[c:d] + text[b:c] + text[a:b] + text[d:]


def _number_changed(text: str, rng: np.random.Generator) -> str:
    import re

    numbers = [match.span() for match in re.finditer(r"-?\d+\.?\d*(e-?\d+)?", text)]
    if not numbers:
        return text
    begin, end = numbers[rng.integers(len(numbers))]
    power = float(rng.choice([1, 40, 320]))
    number = f"{rng.choice(['', '-'])}{rng.uniform(1, 10):.3g}e{int(rng.uniform(-power, power))}"
    return text[:begin] + number + text[end:]


def _with_character(text: str, rng: np.random.Generator) -> str:
    at = _place(text, rng)
    character = str(rng.choice(SPACES)) if rng.random() < 0.5 else str(rng.choice([*"{}[]:,-#&*!|>'\"%@`?~ \n\\"]))
    return text[:at] + character + text[at:]


def _without_part(text: str, rng: np.random.Generator) -> str:
    at, size = _place(text, rng), int(rng.geometric(0.1))
    return text[:at] + text[at + size :]


def _cut(text: str, rng: np.random.Generator) -> str:
    return text[: _place(text, rng)]


def _line_twice(text: str, rng: np.random.Generator) -> str:
    lines = text.splitlines(keepends=True) or [""]
    at, to = rng.integers(len(lines)), rng.integers(len(lines))
    lines.insert(to, lines[at])
    return "".join(lines)


def _line_moved(text: str, rng: np.random.Generator) -> str:
    lines = text.splitlines(keepends=True) or [""]
    line = lines.pop(rng.integers(len(lines)))
    lines.insert(rng.integers(len(lines) + 1), line if rng.random() < 0.5 else "  " + line)
    return "".join(lines)


def _many_times(text: str, rng: np.random.Generator) -> str:
    return text * int(rng.integers(2, 4))


def bytes_changed(data: bytes, rng: np.random.Generator) -> bytes:
    """Data with a few bytes changed, or more."""
    changed = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(len(changed) + 1))
        if rng.random() < 0.5 and at < len(changed):
            changed[at] = int(rng.integers(256))
        else:
            changed[at:at] = rng.bytes(int(rng.integers(1, 4)))
    return bytes(changed)


_CHANGES: tuple[Callable[[str, np.random.Generator], str], ...] = (
    *(_with_word, _with_word, _with_word, _tagged, _swapped, _number_changed, _number_changed, _with_character),
    *(_with_character, _without_part, _cut, _line_twice, _line_moved, _many_times),
)
