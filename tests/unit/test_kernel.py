"""The door to Mitsuba: a bad LLVM is refused in one line, variants are kept, plugins follow them."""

from __future__ import annotations

import glob
import importlib.metadata
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from velatura import kernel
from velatura.errors import MissingTool

OLD_LLVMS = sorted(glob.glob("/usr/lib/*/libLLVM-1[456].so"))

HELD = 64 << 20  # bytes

ASK_FOR_MITSUBA = """
from velatura import kernel
try:
    kernel.mitsuba()
except kernel.MissingTool as error:
    print(error)
"""


@pytest.fixture
def mi() -> Iterator[Any]:
    module = kernel.mitsuba("llvm_ad_rgb")
    yield module
    module.set_variant("llvm_ad_rgb")


@pytest.fixture
def old_llvm(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(kernel, "llvm_version", lambda: (15, 0, 6))
    kernel._llvm_works.cache_clear()
    yield
    kernel._llvm_works.cache_clear()


# LLVM


@pytest.mark.parametrize("library", ["/nowhere/libLLVM.so", *OLD_LLVMS])
def test_a_missing_or_old_llvm_is_refused_in_one_line(library: str) -> None:
    """Dr.Jit alone would print lines of its own, or end the process; the user shall see our one line and no more."""
    environment = os.environ | {"DRJIT_LIBLLVM_PATH": library}
    command = [sys.executable, "-c", ASK_FOR_MITSUBA]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 1
    assert "LLVM 19" in done.stdout
    assert "unset DRJIT_LIBLLVM_PATH; " in done.stdout
    assert "apt-get install -y libllvm19`" in done.stdout


def test_an_old_llvm_that_cannot_compile_is_named(old_llvm: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel, "_compiles_minimum", lambda: False)
    with pytest.raises(MissingTool, match=r"15\.0\.6 is too old: run `.*apt-get install -y libllvm19`$"):
        kernel.require_llvm()


def test_an_old_llvm_that_can_compile_is_accepted(old_llvm: None) -> None:
    """The probe really compiles, in a process of its own; here with this machine's LLVM, which is a good one."""
    kernel.require_llvm()


def test_a_trusted_llvm_costs_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel._llvm_works.cache_clear()
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("started a process"))
    kernel.require_llvm()


@pytest.mark.parametrize(("user", "command"), [(0, "apt-get"), (1000, "sudo apt-get")])
def test_the_command_asks_for_root_where_it_must(user: int, command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr(os, "geteuid", lambda: user)
    assert kernel.llvm_command() == f"{command} update && {command} install -y libllvm19"


# Variants


def test_a_variant_is_kept_or_set_as_asked(mi: Any) -> None:
    assert kernel.mitsuba("scalar_rgb").variant() == "scalar_rgb"
    assert kernel.mitsuba().variant() == "scalar_rgb"
    assert kernel.mitsuba(kernel.default_variant()).variant() == "llvm_ad_rgb"


# Plugins


def test_a_plugin_is_registered_once_for_every_variant(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel, "_factories", {})
    monkeypatch.setattr(kernel, "_registered", set())
    made = []

    @kernel.plugin("of_the_test")
    def make(mi: Any) -> type:
        made.append(mi.variant())

        class OfTheTest(mi.BSDF):
            def __init__(self, properties: Any) -> None:
                mi.BSDF.__init__(self, properties)

            def to_string(self) -> str:
                return f"OfTheTest[{made[-1]}]"

        return OfTheTest

    kernel.register()
    kernel.register()
    assert made == ["llvm_ad_rgb"]
    for variant in ("llvm_ad_rgb", "scalar_rgb", "llvm_ad_rgb", "scalar_rgb"):
        mi.set_variant(variant)
        assert "OfTheTest" in str(mi.load_dict({"type": "of_the_test"}))
    assert made == ["llvm_ad_rgb", "scalar_rgb"]


# Doctor


def test_doctor_finds_all_well_here() -> None:
    rows = kernel.doctor()
    assert [row.what for row in rows] == ["Python", "mitsuba", "drjit", "LLVM", "CUDA"]
    assert all(row.ok and row.found for row in rows)


def test_doctor_shows_the_extras(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the versions of an extra's packages; a missing one is no fault, and has its command."""
    rows = {row.what: row for row in kernel.extras()}
    found = rows["Extra editor"].found
    assert all(re.search(rf"\b{package} [\d.]+\d", found) for package in ("starlette", "uvicorn", "websockets"))

    known = importlib.metadata.version

    def version(name: str) -> str:
        if name == "matplotlib":
            raise importlib.metadata.PackageNotFoundError(name)
        return known(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    plots, *_ = kernel.extras()
    assert plots.ok and plots.found.endswith('pip install "velatura[plots]"')


def test_doctor_names_the_command_for_llvm(old_llvm: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel, "_compiles_minimum", lambda: False)
    (row,) = (row for row in kernel.doctor() if row.what == "LLVM")
    assert row == ("LLVM", "15.0.6, too old", False, kernel.llvm_command())


def test_doctor_names_the_command_for_a_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing_installed(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", nothing_installed)
    missing = [row for row in kernel.doctor() if not row.ok]
    assert [row.what for row in missing] == ["mitsuba", "drjit"]
    assert all(row.mend.endswith("-m pip install mitsuba") for row in missing)


# OpenEXR

ONE_PROCESSOR = """
import os, sys
from pathlib import Path
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
import numpy as np
import velatura as vt
from velatura import kernel, scenes
scenes.write_image(np.full((4, 4, 3), 0.25), sys.argv[1])
rough = vt.Stack([vt.Interface(conductor="Au", alpha={"texture": sys.argv[1]})])
kernel.bitmap(Path(sys.argv[1]))
picture = vt.render(rough, env="lobby", size="8x6", spp=1, model="belcour2018")
print(picture.shape)
"""


def test_openexr_is_read_and_written_with_one_processor(tmp_path: Path) -> None:
    """Rationale: Mitsuba leaves it to threads of Dr.Jit, and waits for ever where there is none but its own."""
    command = [sys.executable, "-c", ONE_PROCESSOR, str(tmp_path / "alpha.exr")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (done.stderr, done.stdout) == ("", "(6, 8, 3)\n")


def test_threads_return_to_the_limit_after_pictures(mi: Any, tmp_path: Path) -> None:
    """Expected: reading works with one thread, which is all that there is again once a scene is loaded."""
    import drjit as dr

    path = str(tmp_path / "light.exr")
    mi.Bitmap(np.ones((2, 2, 3), np.float32)).write(path)
    with kernel.threads_restored():
        kernel.use_threads(1)
        kernel.load_dict({"type": "bitmap", "filename": path})
        assert dr.thread_count() == 1
        kernel.allow_pictures()
        kernel.use_threads(1)
        assert dr.thread_count() == 1


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_memory_that_was_much_at_once_is_returned(mi: Any) -> None:
    """Dr.Jit would keep all that an array had."""
    import drjit as dr

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    kernel.return_memory()
    array = dr.full(mi.Float, 1.0, HELD // 4)
    dr.make_opaque(array)
    dr.sync_thread()
    before = resident()
    del array
    kernel.return_memory()
    assert before - resident() > 0.9 * HELD
