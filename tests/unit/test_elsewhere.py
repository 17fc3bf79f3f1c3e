"""Where the renderer is not installed, and on systems other than Linux.

Rationale: the package is Python, and only what renders needs Mitsuba. Expected: lobes, the inverse, imports, bakes,
shaders and sweeps work without it, and all else is refused in one line with the command that installs it. Of Windows
its path rules are tried, and the calls that it lacks.
"""

from __future__ import annotations

import ntpath
import os
import signal
import subprocess
import sys
from pathlib import Path, PureWindowsPath
from types import SimpleNamespace

import pytest

from velatura import files, kernel
from velatura.stack import paths
from velatura.sweeps import engines

HIDDEN = """
import importlib.metadata, sys
from importlib.machinery import PathFinder

class Hidden:
    def find_spec(self, name, *rest):
        if name.split(".")[0] in ("mitsuba", "drjit"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

def version(name, real=importlib.metadata.version):
    if name in ("mitsuba", "drjit"):
        raise importlib.metadata.PackageNotFoundError(name)
    return real(name)

real = PathFinder.find_spec
PathFinder.find_spec = lambda name, *rest: None if name in ("mitsuba", "drjit") else real(name, *rest)
importlib.metadata.version = version
sys.meta_path.insert(0, Hidden())
"""

WORKS = """
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import velatura as vt

stack = vt.Stack([{"interface": {"eta": 1.5}}, {"medium": {"sigma_s": 1.0}}, {"diffuse": {"albedo": 0.5}}])
metal = {"interface": {"eta": {"refractiveindex": "main/Au/Johnson"}, "alpha": 0.2}}
assert vt.lobes(vt.Stack([metal]), 1.0).energy[0][0, 0] > 0.9
assert vt.lobes(stack, 1.0).remainder.max() > 0.2
assert vt.inverse.invert_stack([{"energy": 0.04}]).stack.interfaces
vt.inverse.coat(vt.Stack([metal]), 1.3)
assert "vt_sample" in vt.export(stack, "glsl").text
vt.export(stack, "gltf").save("paint.gltf")
assert vt.load("paint.gltf").interfaces
space = vt.Space(material=vt.Stack([metal]), vary={"layer0_alpha": {"range": [0.1, 0.3], "steps": 2}})
with ThreadPoolExecutor(1) as executor:
    assert vt.sweep(space, "lobes", store="points.zarr", executor=executor, cos_theta=[1], model="belcour2018").sizes
for refused in (
    lambda: vt.render(stack),
    lambda: vt.bsdf(stack),
    lambda: vt.check(stack),
    lambda: vt.reference.statistics(stack, 1.0, paths=100),
    lambda: vt.Interface(conductor="Au"),
):
    try:
        refused()
        raise SystemExit("not refused")
    except vt.MissingTool as error:
        assert "pip install mitsuba" in str(error), error
from velatura.cli import main
sys.argv = ["velatura", "doctor"]
main()
"""


def test_what_does_not_render_works_without_mitsuba(tmp_path: Path) -> None:
    command = [sys.executable, "-W", "ignore", "-c", HIDDEN + WORKS]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode == 1 and not run.stderr, run.stderr
    assert kernel.WITHOUT in run.stdout
    assert "To install mitsuba" in run.stdout


def test_paths_follow_the_rules_of_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "os", SimpleNamespace(path=ntpath))
    monkeypatch.setattr(files, "Path", PureWindowsPath)
    monkeypatch.setattr(paths, "Path", PureWindowsPath)
    folder = PureWindowsPath(r"C:\work\materials")
    assert files.relative(r"C:\work\images\a b.png", folder) == "../images/a b.png"
    assert files.relative(r"D:\images\a.png", folder) == "D:/images/a.png"
    names = ["coated-gold", r"C:\coated-gold", r"materials\coated-gold", "C:coated-gold", "gold.yaml"]
    assert [paths.is_preset(name) for name in names] == [True, False, False, False, False]


def test_calls_that_windows_lacks_are_not_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: bytes are read unchanged, line ends included, and all processors are counted."""
    for module, name in ((os, "O_NONBLOCK"), (os, "sched_getaffinity"), (os, "geteuid"), (signal, "pthread_sigmask")):
        monkeypatch.delattr(module, name)
    monkeypatch.setattr(sys, "platform", "win32")
    (tmp_path / "lines.txt").write_bytes(b"one\r\ntwo\r\n\x1a")
    assert files.content(tmp_path / "lines.txt") == b"one\r\ntwo\r\n\x1a"
    assert engines._cores() == (os.cpu_count() or 1)
    with engines._interrupts_wait():
        assert "winget" in kernel.llvm_command()
