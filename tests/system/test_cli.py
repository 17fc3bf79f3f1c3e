"""The command as a user runs it, with real models and real pictures.

Rationale: what unit tests cannot show is that the parts fit, that the messages of all of them are fit to be read, and
that a process ends as it should when it is interrupted, when its output is not read, and when LLVM is missing.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interrupts import hear

import velatura as vt

Run = Callable[..., tuple[int, str, str]]


def start(*arguments: str, **options: Any) -> subprocess.Popen[str]:
    """The command in a process of its own."""
    command = [sys.executable, "-m", "velatura", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def finish(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    out, err = process.communicate(timeout=120)
    return process.returncode, out, err


PAPER = ("--model", "belcour2018")  # which has all switches


# Results


def test_lobes_as_json_are_those_of_python(run: Run) -> None:
    """Expected: the JSON holds, to the last digit, what `vt.lobes` returns."""
    status, out, err = run("lobes", "coated-gold", *PAPER, "--cos", "1,0.5,0.1", "--set", "tir=off", "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    lobes = vt.lobes(vt.preset("coated-gold"), cos_theta=[1.0, 0.5, 0.1], tir="off", model=found["model"])
    others = ["remainder", "passed", "absorbed"]
    assert list(found) == ["model", "cos", "reflected", "transmitted", *others]
    assert (found["cos"], found["transmitted"]) == ([1.0, 0.5, 0.1], None)
    assert len(found["reflected"]) == len(lobes.energy)
    for k, lobe in enumerate(found["reflected"]):
        for field in ("energy", "alpha", "covariance", "own_alpha"):
            np.testing.assert_array_equal(np.transpose(lobe[field]), getattr(lobes, field)[k])
        for field in ("rotation", "own_rotation"):
            np.testing.assert_array_equal(lobe[field], getattr(lobes, field)[k])
    for name in others:
        np.testing.assert_array_equal(np.transpose(found[name]), getattr(lobes, name))


def test_what_a_stack_transmits_is_in_the_json(run: Run) -> None:
    """Expected: a stack that ends in a dielectric has a transmitted lobe; with the reflected ones no energy is lost."""
    _, out, _ = run("lobes", "frosted-glass", *PAPER, "--set", "reflectance=fresnel", "--set", "tir=off", "--json")
    found = json.loads(out)
    total = np.sum([lobe["energy"] for lobe in [*found["reflected"], found["transmitted"]]], axis=0)
    assert total == pytest.approx(np.ones((1, 3)), abs=1e-6)


def test_lobes_of_each_channel(run: Run) -> None:
    """Expected: with `channels=separate` a list per channel, and lists over directions within it."""
    _, out, _ = run("lobes", "coated-gold", *PAPER, "--cos", "1,0.5", "--set", "channels=separate", "--json")
    lobe = json.loads(out)["reflected"][1]
    assert np.shape(lobe["energy"]) == (2, 3)
    assert (np.shape(lobe["alpha"]), np.shape(lobe["rotation"])) == ((3, 2, 2), (3, 2))
    assert run("lobes", "coated-gold", *PAPER, "--set", "channels=separate")[0] == 0


def test_a_setting_changes_the_answer(run: Run) -> None:
    """Expected: a rougher coat gives a first lobe of exactly that roughness."""
    _, out, _ = run("lobes", "coated-gold", "--set", "layer0_alpha=.25", "--json")
    assert json.loads(out)["reflected"][0]["alpha"] == [pytest.approx([0.25, 0.25])]


def test_a_setting_may_be_a_page_of_refractiveindex_info(run: Run) -> None:
    """Expected: titanium below the coat, in the place of gold."""
    page = "main/Ti/Johnson"
    _, out, _ = run("lobes", "coated-gold", "--set", f"layer2_eta={page}", "--json")
    index = vt.Substance(refractiveindex=page)
    expected = vt.lobes(vt.preset("coated-gold").replace(layer2_eta=index), [1.0]).energy[1]
    assert json.loads(out)["reflected"][1]["energy"][0] == pytest.approx(expected[:, 0], abs=1e-6)


@pytest.mark.parametrize("name", ["picture.png", "picture.exr"])
def test_render_writes_one_picture_and_nothing_else(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Expected: one file of the right format, one line on standard output."""
    monkeypatch.chdir(tmp_path)
    size = ("--size", "24x16", "--spp", "4", "--scene", "sphere")
    status, out, err = run("render", "coated-gold", "-o", name, *size)
    assert (status, err) == (0, "")
    assert out.startswith(f"{name}: 24 x 16 pixels, 4 samples each")
    assert out.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == [name]
    magic = {".png": b"\x89PNG\r\n\x1a\n", ".exr": b"\x76\x2f\x31\x01"}
    assert Path(name).read_bytes().startswith(magic[Path(name).suffix])


def test_presets_and_schema(run: Run) -> None:
    """Expected: every preset is listed with its source, and the schema describes a material."""
    listed = {entry["name"]: entry for entry in json.loads(run("presets", "--json")[1])}
    assert set(listed) == set(vt.presets())
    assert all(entry["layers"] and entry["source"] for entry in listed.values())
    lines = run("presets")[1].splitlines()
    assert [line.split()[0] for line in lines] == list(listed)
    assert max(map(len, lines)) < 80
    assert json.loads(run("schema")[1])["$defs"]["stack"]["required"] == ["layers"]


# Bad input


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["render", "coated-gold", "-o", "nowhere/a.png"], ["nowhere"]),
        (["render", "coated-gold", "-o", "a.gif"], [".png", ".exr"]),
        (["render", "coated-gold", "--scene", "bal"], ["bal", "ball"]),
        (["render", "coated-gold", "--scene", "missing.xml"], ["missing.xml"]),
        (["render", "coated-gold", "--env", "missing.hdr"], ["missing.hdr"]),
        (["render", "coated-gold", "--env", ""], ["unknown environment"]),
        (["render", "coated-gold", "--model", "belcour2081"], ["belcour2081", "belcour2018"]),
        (["render", "coated-gold", "--model", ""], ["unknown model"]),
        (["coat", "coated-gold", "--model", ""], ["unknown model"]),
        (["lobes", "coated-gold", "--cos", "1,0"], ["cos", "0"]),
        (["lobes", "coated-gold", "--cos", "1.01"], ["cos", "1.01"]),
        (["lobes", "coated-gold", "--cos", "nan"], ["cos", "nan"]),
        (["lobes", "coated-gold", "--set", "tir=sometimes"], ["tir", "sometimes", "published"]),
        (["lobes", "coated-gold", "--set", "reflectanse=fgd"], ["reflectanse", "reflectance"]),
        (["lobes", "coated-gold", "--set", "layer0_alpha=2"], ["alpha", "2"]),
        (["lobes", "coated-gold", "--set", "layer2_eta=main/Au/Jonson"], ["layer 2", "eta", "main/Au/Johnson"]),
        (["lobes", "coated-gold", "--set", "layer2_conductor=main/Au/Johnson"], ["conductor", "eta: {refractiveindex"]),
        (["lobes", "coated-gould"], ["coated-gould", "coated-gold"]),
        (["lobes", "broken.yaml"], ["broken.yaml"]),
        (["lobes", "empty.yaml"], ["empty.yaml", "layers"]),
        (["lobes", "negative.yaml"], ["negative.yaml", "alpha", "-0.1"]),
        (["lobes", "misspelt.yaml"], ["misspelt.yaml", "alhpa", "alpha"]),
        (["lobes", "buried.yaml"], ["buried.yaml", "layer 1"]),
        (["lobes", "untextured.yaml"], ["untextured.yaml", "missing.png"]),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: list[str]
) -> None:
    """Expected: the line names what is wrong and what is known or allowed; nothing is written."""
    files = {
        "broken": "layers: [interface: {eta: 1.5}",
        "empty": "layers: []",
        "negative": "layers: [interface: {eta: 1.5, alpha: -0.1}]",
        "misspelt": "layers: [interface: {eta: 1.5, alhpa: 0.1}]",
        "buried": "layers: [interface: {conductor: Au}, medium: {depth: 1}]",
        "untextured": "layers: [interface: {eta: 1.5, alpha: {texture: missing.png}}]",
    }
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert err.startswith("velatura: ")
    assert err.count("\n") == 1
    assert all(word in err for word in words), err
    assert len(list(tmp_path.iterdir())) == len(files)


# Processes


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    """Expected: Ctrl-C in the middle of a long picture ends it soon, with status 130 and an empty folder."""
    process = start("render", "coated-gold", "--spp", "1000000", "--size", "256", cwd=tmp_path, preexec_fn=hear)
    while "libLLVM" not in Path(f"/proc/{process.pid}/maps").read_text():
        assert process.poll() is None, process.stderr and process.stderr.read()
        time.sleep(0.05)
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    status, _, err = finish(process)
    assert (status, err) == (130, "velatura: interrupted\n")
    assert not list(tmp_path.iterdir())


def test_nobody_reads() -> None:
    """Expected: a reader that goes away (`velatura schema | head -1`) is no reason for a traceback."""
    process = start("schema")
    assert process.stdout is not None
    process.stdout.close()
    status = process.wait(timeout=120)
    assert process.stderr is not None
    assert (status, process.stderr.read()) == (1, "")


def shell(command: str, cwd: Path, **environment: str) -> tuple[int, str, str]:
    """The command, written as `velatura`, in a shell."""
    whole = command.replace("velatura", f"{sys.executable} -m velatura")
    ended = subprocess.run(whole, shell=True, cwd=cwd, capture_output=True, env={**os.environ, **environment})
    return ended.returncode, ended.stdout.decode(), ended.stderr.decode()


@pytest.mark.parametrize(
    ("output", "says"),
    [(">/dev/full", "no space left on device"), (">&-", "standard output is closed"), ("2>/dev/full >&-", "")],
)
def test_an_output_that_takes_nothing(output: str, says: str, tmp_path: Path) -> None:
    """Expected: one line, where there is a place for it, and status 1."""
    line = f"velatura: {says}\n" if says else ""
    for unbuffered in ("", "1"):
        assert shell(f"velatura schema {output}", tmp_path, PYTHONUNBUFFERED=unbuffered) == (1, "", line)


def test_output_is_utf8_in_every_locale(tmp_path: Path) -> None:
    """Expected: names of materials and of files come out as they are, also where Python would write ASCII."""
    (tmp_path / "é.yaml").write_text('name: "Lack, größe 1"\nlayers: [{interface: {eta: 1.5}}]', encoding="utf-8")
    plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    status, out, err = shell("velatura lobes é.yaml && velatura export é.yaml --to json", tmp_path, **plain)
    assert (status, err) == (0, "")
    assert out.count("Lack, größe 1") == 2 and "°" in out
    assert shell("velatura lobes ü.yaml", tmp_path, **plain)[::2] == (2, "velatura: ü.yaml: file not found\n")


def test_an_llvm_that_cannot_be_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: `render` and `doctor` say the command that mends it, with status 1; numbers need no LLVM."""
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM.so"))
    render, doctor, lobes = start("render", "coated-gold", cwd=tmp_path), start("doctor"), start("lobes", "coated-gold")
    mend = "apt-get install -y libllvm19"
    status, out, err = finish(render)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("velatura: ") and mend in err
    status, out, _ = finish(doctor)
    assert status == 1 and mend in out
    assert finish(lobes)[::2] == (0, "")
