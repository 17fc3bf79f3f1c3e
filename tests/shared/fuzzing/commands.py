"""Mutated command lines and input files: no traceback, a known exit status, and nothing written or lost on refusal."""

from __future__ import annotations

import contextlib
import io
import itertools
import os
import signal
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any
from unittest import mock

import numpy as np

from fuzzing import Failure, files, pictures
from fuzzing.stacks import random_stack
from velatura import cli
from velatura.stack import dumps

LIMIT_S, CLOCK = 60, 20  # seconds of the processor, and how many times that by the clock, for a busy machine
PROCESSES = 0.1  # share of command lines that run as a process of their own

MATERIAL = """\
name: Coated
layers:
  - interface: {eta: 1.5, alpha: 0.05}
  - medium: {sigma_a: [0.1, 0.5, 2.0]}
  - interface: {eta: [0.2, 0.9, 1.2], k: [3.9, 2.6, 2.2], alpha: 0.2}
"""
TARGET = "lobes:\n  - {energy: 0.05, alpha: 0.1}\n  - {energy: [0.4, 0.3, 0.2], alpha: 0.2, base: conductor}\n"
TABLE = "theta_i,theta_o,phi,r,g,b\n0,0,180,2.0,1.9,1.8\n0,20,180,0.4,0.4,0.4\n30,30,180,2.1,2.0,1.9\n60,50,180,1,1,1\n"
SCENE = """\
<scene version="3.0.0"><integrator type="path"/><emitter type="constant"/><shape type="sphere">
<bsdf type="diffuse" id="material"/></shape><sensor type="perspective"><film type="hdrfilm">
<integer name="width" value="8"/><integer name="height" value="8"/></film><transform name="to_world">
<lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform></sensor></scene>
"""
GLTF = (
    '{"asset": {"version": "2.0"}, "materials": [{"name": "Red", "pbrMetallicRoughness": {"baseColorFactor": '
    '[0.8, 0.1, 0.1, 1], "metallicFactor": 0, "roughnessFactor": 0.4}}]}'
)
INPUTS = {
    "surface.gltf": GLTF,
    "material.yaml": MATERIAL,
    "target.yaml": TARGET,
    "table.csv": TABLE,
    "scene.xml": SCENE,
    "kept.txt": "kept\n",
}

COMMANDS = """
lobes material.yaml --cos 1,0.5 --phi 30 --model belcour2018 --set layer0_alpha=0.2 --set tir=off --json
lobes coated-gold --cos 0.7
render material.yaml -o new.png --size 8 --spp 1 --scene sphere --env sky --seed 3
render material.yaml -o new.exr --size 8x6 --spp 1 --scene scene.xml --model bati2021
render material.yaml --size 8 --spp 1 --env light.exr --set layer0_alpha=0.1
check material.yaml --json --plots plots --set form=symmetric
compare material.yaml --models velatura,belcour2018 --cos 1 --paths 2000 --seed 1 --json
invert target.yaml -o new.yaml --seed 1 --model bati2021 --json
invert target.yaml -o found --count 2 --set tir=off
coat material.yaml --eta 1.4 --alpha 0.1 --keep-appearance -o new.yaml
coat material.yaml --eta 1.6 --json -o new.json
explore target.yaml --count 2 --seed 1
fit table.csv target.yaml --starts 1 -o new.yaml --seed 1 --json
simplify material.yaml --interfaces 1 -o new.yaml --json
export material.yaml --to glsl -o new.glsl --constant layer0_eta
export material.yaml --to json -o new.json --set layer0_alpha=0.3
export material.yaml --to mitsuba-xml -o new.xml --model weier2020
export material.yaml --to python
export material.yaml --to gltf -o new.gltf
export material.yaml --to openpbr -o new.mtlx
import surface.gltf -o new.yaml
sweep nowhere.yaml -o new.zarr --workers 1
benchmark score --values table.csv --kind pane --keep found --json
benchmark pairs -o found
edit nowhere.yaml --static kept.txt
cite weier2020 --format text
figure no-such -o new.png --size 8
presets --json
schema
doctor
"""
WORDS = """
nan inf -inf -1 0 0.5 1e400 1e-400 1,2 , = a=b -- - -x --help --json --model --set --no-such --set= -o -o= {} [1,2]
coated-gold material.yaml target.yaml table.csv scene.xml kept.txt light.exr texture.png nowhere.yaml ~ * $HOME é.yaml
folder folder/new.png folder/new.yaml closed/new.png closed/new.yaml loop.yaml loop.png link.yaml link.png
no/such/new.png no/such/new.yaml /dev/full /dev/null/new.png /proc/new.yaml new.png new.exr new.yaml new.txt
layer0_alpha=nan layer0_alpha=1e39 layer9_eta=1 layer0_eta=Au exterior=0 thin=true name= model=x form=
layer0_alpha=0.1,0.2 layer1_g=1 layer1_depth=1e39 layer2_rotation=1e9 map=power channels=separate
"""
ODD = (
    "",
    " ",
    "\n",
    "a\nb.yaml",
    "a\x1bb.yaml",
    "\udcff.yaml",
    "\U0001f600.png",
    "{layers: []}",
    "9" * 400,
    "x" * 5000,
)
LONG = ("x" * 5000, "a" * 300, "a" * 245 + ".png", "a" * 245 + ".yaml")
ENVIRONMENTS: tuple[dict[str, str], ...] = (
    {},
    {"LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    {"COLUMNS": "1", "TERM": "dumb"},
    {"HOME": "/nonexistent", "PYTHONOPTIMIZE": "2"},
)
REDIRECTIONS = ("", "", ">/dev/full", ">&-", "2>&-", "<&-", "| head -c 10 >/dev/null; exit ${PIPESTATUS[0]}")


class _Late(Exception):
    """The end of a command line that takes too long; no OSError, which the command line reports in one line."""


def trial(rng: np.random.Generator) -> list[Failure]:
    """A command line with a few words changed, or an input file."""
    line = str(rng.choice(COMMANDS.strip().splitlines())).split()
    inputs = dict(INPUTS)
    if rng.random() < 0.3:
        inputs["material.yaml"] = dumps(random_stack(rng, rng.random() < 0.5))
    for _ in range(rng.integers(0, 4)):
        if rng.random() < 0.3:
            name = str(rng.choice([name for name in inputs if name in line] or list(inputs)))
            inputs[name] = files.changed(inputs[name], rng)
        else:
            _change(line, rng)
    if rng.random() >= PROCESSES:
        return tried(line, inputs)
    environment = ENVIRONMENTS[rng.integers(len(ENVIRONMENTS))]
    return tried(line, inputs, environment, REDIRECTIONS[rng.integers(len(REDIRECTIONS))])


def _change(line: list[str], rng: np.random.Generator) -> None:
    at = int(rng.integers(1, len(line) + 1)) if len(line) > 1 else 1
    what, word = rng.integers(6), str(rng.choice([*WORDS.split(), *ODD, *LONG]))
    if what < 3 and at < len(line):
        line[at] = word
    elif what == 3 and at < len(line):
        del line[at]
    elif what == 4 and len(line) > 2:
        other = int(rng.integers(1, len(line)))
        line[other], line[at - 1 or 1] = line[at - 1 or 1], line[other]
    else:
        line.insert(at, word)


def tried(
    line: list[str], inputs: dict[str, str], environment: dict[str, str] | None = None, redirection: str = ""
) -> list[Failure]:
    """Failures of how a command line ends, in a folder with these files; in this process unless an environment
    is given."""
    case: dict[str, Any] = {"line": line, **{k: v for k, v in inputs.items() if v != INPUTS[k]}}
    if environment is not None:
        case |= {"environment": environment, "redirection": redirection}
    with _folder(inputs) as folder:
        before = _contents(folder)
        if environment is None:
            status, out, err = _run(line)
        else:
            status, out, err = _run_process(line, environment, redirection)
        wrong = [*_ended(status, out, err, redirection), *_written(line, status, before, _contents(folder))]
    return [Failure(kind, detail, case) for kind, detail in wrong]


# What must hold


def _ended(status: int, out: str, err: str, redirection: str) -> Iterator[tuple[str, str]]:
    last = (err.strip().splitlines() or [""])[-1]
    if "Traceback" in err:
        yield "traceback", last
    elif status not in (0, 1, 2, 3):
        yield f"exit status {status}", last
    elif status in (1, 2, 3) and err == "" and "2>" in redirection:
        return
    elif status == 2 and not (out == "" and err.count("\n") == 1 and err.startswith("velatura: ")):
        yield "refused in more than a line", repr((out + err)[:300])
    elif status in (1, 3) and err and not last.startswith("velatura: "):
        yield "failed without a word", repr(err[-300:])


def _written(line: list[str], status: int, before: dict[str, Any], after: dict[str, Any]) -> Iterator[tuple[str, str]]:
    named = {word for option, word in itertools.pairwise(line) if option in ("-o", "--output", "--plots")}
    for name, content in before.items():
        if after.get(name) != content and not (status == 0 and (name in named or name.startswith("link"))):
            yield "a file was lost or changed", name
    made = sorted(set(after) - set(before))
    if made and status in (2, 3):
        yield "written on refusal", ", ".join(made)
    if any(Path(name).name.startswith(".") or "tmp" in name for name in made):
        yield "something unfinished is left", ", ".join(made)


# How it is run


@contextlib.contextmanager
def _folder(inputs: dict[str, str]) -> Iterator[Path]:
    """A working folder with the inputs, pictures, links and folders."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path, text in inputs.items():
            (folder / path).write_bytes(text.encode("utf-8", "surrogatepass"))
        (folder / "texture.png").write_bytes(pictures.png())
        (folder / "light.exr").write_bytes(b"not a picture")
        for made in ("folder", "closed"):
            (folder / made).mkdir()
        for link, target in {"loop.yaml": "loop.yaml", "loop.png": "loop.png"}.items():
            (folder / link).symlink_to(target)
        for link, target in {"link.yaml": "kept.yaml", "link.png": "kept.png"}.items():
            (folder / target).write_text("kept\n")
            (folder / link).symlink_to(target)
        (folder / "closed").chmod(0o500)
        os.chdir(folder)
        try:
            yield folder
        finally:
            os.chdir(here)
            (folder / "closed").chmod(0o700)


def _contents(folder: Path) -> dict[str, Any]:
    """Every file, link and folder, with what it holds."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        kind = os.readlink(path) if path.is_symlink() else None if path.is_dir() else path.read_bytes()
        found[str(path.relative_to(folder))] = kind, path.lstat().st_mode
    return found


def _run(line: list[str]) -> tuple[int, str, str]:
    """Run in this process; a time limit is an exception like any other."""
    out, err = io.StringIO(), io.StringIO()
    status = 0
    with (
        mock.patch.object(sys, "argv", ["velatura", *line]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        _limited(),
    ):
        try:
            cli.main()
        except SystemExit as exit:
            status = int(exit.code or 0)
        except BaseException:
            traceback.print_exc()
    return status, out.getvalue(), err.getvalue()


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    def stop(number: int, frame: FrameType | None) -> None:
        raise _Late(f"not done after {LIMIT_S} s")

    timers = {signal.ITIMER_PROF: (signal.SIGPROF, LIMIT_S), signal.ITIMER_REAL: (signal.SIGALRM, CLOCK * LIMIT_S)}
    before = {number: signal.signal(number, stop) for number, _ in timers.values()}
    for timer, (_, seconds) in timers.items():
        signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        for timer in timers:
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


def _run_process(line: list[str], environment: dict[str, str], redirection: str) -> tuple[int, str, str]:
    shell = ["bash", "-c", f'"$@" {redirection}', "bash", sys.executable, "-m", "velatura", *line]
    kept = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    try:
        done = subprocess.run(
            shell, env={**kept, **environment}, capture_output=True, timeout=CLOCK * LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return 124, "", f"not done after {CLOCK * LIMIT_S} s"
    except (ValueError, OSError) as error:  # a word that no process can be given
        return 2, "", f"velatura: {error}\n"
    return done.returncode, done.stdout.decode("utf-8", "replace"), done.stderr.decode("utf-8", "replace")
