"""Inverse design as a user types it.

Rationale: the functions are tested elsewhere; here, that targets become material files that the other verbs read, that
nothing is written when there is no stack, and that every failure is one line with its exit status.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import inverse
from velatura.inverse.local import surrogate

pytestmark = pytest.mark.usefixtures("one_thread")

Run = Callable[..., tuple[int, str, str]]

TARGET = """name: Hazy metal
lobes:
  - {energy: 0.1, alpha: 0, interfaces: 1}
  - {energy: [0.35, 0.25, 0.3], variance: 0.04, interfaces: 1, base: conductor}
"""
COATED = "layers: [interface: {eta: 1.5, alpha: 0.05}, interface: {conductor: Au, alpha: 0.2}]\n"
PAIR = "lobes:\n  - {energy: [0.09, 0.09, 0.15], variance: 0.03, interfaces: 2}\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with targets in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hazy.yaml").write_text(TARGET)
    (tmp_path / "pair.yaml").write_text(PAIR)
    (tmp_path / "bright.yaml").write_text("lobes:\n  - {energy: 0.6}\n")
    (tmp_path / "coated.yaml").write_text(COATED)
    return tmp_path


@pytest.fixture
def solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One answer to one question, which commands print in two forms."""
    for name in ("alternatives", "coat", "simplify"):
        monkeypatch.setattr(inverse, name, once(getattr(inverse, name)))


def once(function: Callable[..., Any]) -> Callable[..., Any]:
    known: dict[str, Any] = {}

    def ask(*arguments: Any, **switches: Any) -> Any:
        key = repr((arguments, switches))
        if key not in known:
            known[key] = function(*arguments, **switches)
        return known[key]

    return ask


def files(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {"hazy.yaml", "pair.yaml", "bright.yaml", "coated.yaml"}


def test_a_target_becomes_a_material(run: Run, folder: Path) -> None:
    """Expected: the file is a material whose lobes are those that were asked for."""
    status, out, err = run("invert", "hazy.yaml", "-o", "stack.yaml")
    assert (status, err) == (0, "")
    assert out.splitlines()[-1] == "stack.yaml"
    stack = vt.load("stack.yaml")
    assert (stack.name, stack.kinds) == ("Hazy metal", ("dielectric", "conductor"))
    found = vt.lobes(stack, 1.0)
    assert found.energy[1][:, 0] == pytest.approx([0.35, 0.25, 0.3], abs=1e-6)
    assert found.covariance[1][0, 0] == pytest.approx(0.04, abs=1e-6)
    assert run("lobes", "stack.yaml")[0] == 0


def test_the_answer_as_json(run: Run, folder: Path) -> None:
    """Expected: one object with the material and the class; nothing written."""
    status, out, _ = run("invert", "pair.yaml", "--json", "--model", "bati2021", "--set", "reflectance=fresnel")
    report = json.loads(out)
    assert status == 0
    assert report["feasible"] is True
    assert vt.Stack.from_dict(report["stack"]).kinds == ("dielectric", "medium", "dielectric")
    (lobe,) = report["class"]["lobes"]
    assert lobe["eta_1"][0][0] == 1
    assert len(lobe["channels"]) == 3
    assert files(folder) == set()


def test_several_stacks_and_the_class_as_a_picture(run: Run, folder: Path) -> None:
    """Expected: as many files as asked for, all with the same lobes head-on, and a picture by the target's name."""
    status, out, _ = run("invert", "pair.yaml", "--count", "3", "-o", "stacks", "--plot")
    assert status == 0
    assert files(folder) == {"stacks", "pair.png"}
    paths = sorted((folder / "stacks").iterdir())
    assert [path.name for path in paths] == ["pair-1.yaml", "pair-2.yaml", "pair-3.yaml"]
    for path in paths:
        found = vt.lobes(vt.load(path), 1.0)
        assert (found.energy[0] + found.energy[1])[:, 0] == pytest.approx([0.09, 0.09, 0.15], abs=1e-6)
    assert "pair.png" in out


def test_a_wish_beyond_lobes_becomes_a_material(run: Run, folder: Path) -> None:
    """Expected: the refusal of a clear pane with its way out, which is solved, as text, as JSON and as a file."""
    pane = "layers: [interface: {eta: 1.5, alpha: 0.02}, interface: {eta: 1.0, alpha: 0.02}]"
    Path("pane.yaml").write_text(f"passed: {{energy: [0.5, 0.3, 0.6], haze: 0.8}}\nstart: {{{pane}}}\n")
    arguments = ("invert", "pane.yaml", "--model", "bati2021")
    assert run(*arguments) == (
        3,
        "",
        "velatura: no stack: passed: no medium absorbs (possible: a tinted medium below layer 0)\n",
    )
    status, out, err = run(*arguments, "--way", "1", "-o", "found.yaml")
    assert (status, err, out.splitlines()[-1]) == (0, "", "found.yaml")
    assert "asked: passed energy [0.5, 0.3, 0.6], haze 0.8; has: passed energy [0.5, 0.3, 0.6], haze 0.8" in out
    seen = vt.lobes("found.yaml", 1.0, model="bati2021")
    assert seen.passed[:, 0] == pytest.approx((0.5, 0.3, 0.6), abs=1e-3)
    report = json.loads(run(*arguments, "--way", "1", "--json")[1])
    assert report["reached"]["passed"][0]["haze"] == pytest.approx(0.8, abs=1e-3)
    assert vt.Stack.from_dict(report["stack"]) == vt.load("found.yaml")
    assert "--plot: draws classes of lobes alone" in run(*arguments, "--plot")[2]


@pytest.mark.parametrize("model", ["velatura", "bati2021"])
def test_what_cannot_be_exits_with_3(run: Run, folder: Path, model: str) -> None:
    """Expected: one line that says why and what is possible, the same as JSON, and nothing written; .36 is what a
    dielectric of index 4 reflects."""
    status, out, err = run("invert", "bright.yaml", "-o", "stack.yaml", "--plot", "--model", model)
    assert (status, out) == (3, "")
    ways = "lobe 1 energy 0.36; lobe 1 base conductor"
    assert err == f"velatura: no stack: lobe 1: no index up to 4 reflects as much (possible: {ways})\n"
    status, out, _ = run("invert", "bright.yaml", "--json", "--model", model)
    report = json.loads(out)
    assert (status, report["feasible"], report["model"]) == (3, False, model)
    assert report["nearest"]["lobes"][0]["energy"] == pytest.approx(0.36, abs=1e-3)
    assert files(folder) == set()


@pytest.mark.parametrize(
    "lobes",
    [
        "[{energy: [0.08, 0.04, 0.05]}]",
        "[{energy: 0.1, alpha: 0.2}, {energy: [0.4, 0.3, 0.2], alpha: 0.02, base: conductor}]",
        "[{energy: 0.05, fixed: {eta: [1.3]}}, {energy: 0.3, alpha: 0.1, base: conductor}]",
    ],
)
def test_the_nearest_is_solved_when_it_is_fed_back(run: Run, folder: Path, lobes: str) -> None:
    """Expected: the JSON of a refusal holds a target file, whose material has the lobes that it names."""
    (folder / "wish.yaml").write_text(f"lobes: {lobes}\n")
    status, out, _ = run("invert", "wish.yaml", "--json")
    nearest = json.loads(out)["nearest"]
    assert status == 3
    (folder / "nearest.json").write_text(json.dumps(nearest))
    assert run("invert", "nearest.json", "-o", "stack.yaml")[0] == 0
    found, first = vt.lobes(vt.load("stack.yaml"), 1.0), 0
    for lobe in nearest["lobes"]:
        own = slice(first, first := first + lobe.get("interfaces", 1))
        energy = np.sum(found.energy[own], axis=0)[:, 0]
        assert energy == pytest.approx(np.broadcast_to(lobe["energy"], 3), abs=1e-6)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("lobes:\n  - {energy: -1}\n", "bad.yaml: lobe 1: energy: must lie in 0 to 1e9, got -1"),
        ("lobes:\n  - {energy: .nan}\n", "bad.yaml: lobe 1: energy: must be finite, got nan"),
        ("lobes:\n  - {enrgy: 1}\n", "bad.yaml: lobe 1: unknown key 'enrgy' (did you mean energy?)"),
        ("channels: all\nlobes: [{energy: .1}]", "bad.yaml: channels: must be one of mean, separate, got 'all'"),
        ("lobs: []\n", "bad.yaml: unknown key 'lobs' (did you mean lobes?)"),
        ("{", "bad.yaml: line 1: is not valid YAML: expected the node content, but found '<stream end>'"),
    ],
)
def test_what_is_no_target_exits_with_2(run: Run, folder: Path, text: str, line: str) -> None:
    """Expected: one line that names the file and the key, and nothing written."""
    (folder / "bad.yaml").write_text(text)
    status, out, err = run("invert", "bad.yaml", "-o", "stack.yaml")
    assert (status, out, err) == (2, "", f"velatura: {line}\n")
    assert files(folder) == {"bad.yaml"}


@pytest.mark.parametrize(
    "arguments",
    [
        ("invert", "none.yaml"),
        ("invert", "hazy.yaml", "--set", "tirr=off"),
        ("invert", "hazy.yaml", "--set", "tir=maybe"),
        ("invert", "hazy.yaml", "--model", "belcour"),
        ("invert", "hazy.yaml", "-o", "one.yaml", "--count", "2"),
        ("invert", "hazy.yaml", "-o", "no/folder/here"),
        ("invert", "hazy.yaml", "-o", ""),
        ("invert", "hazy.yaml", "-o", "stack.txt"),
        ("check", "coated-gold", "--plots", ""),
        ("coat", "coated-gold", "--eta", "-1"),
        ("coat", "coated-gold", "-o", "coated.txt"),
        ("explore", "hazy.yaml", "-o", "sheet.png"),
        ("explore", "hazy.yaml", "--sheet", "-o", "sheet.txt"),
    ],
)
def test_wrong_arguments_exit_with_2(run: Run, folder: Path, arguments: tuple[str, ...]) -> None:
    """Expected: one line, and nothing written."""
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert files(folder) == set()


@pytest.mark.parametrize(("model", "degrees"), [("bati2021", 3e-5), ("velatura", 0.5)])
def test_a_coat_that_keeps_the_appearance(run: Run, folder: Path, model: str, degrees: float) -> None:
    """Expected: lobes that stay within 1e-4, a material on disk; without the switch, a report of what changes.

    Of `velatura` the axes of lobes are those of samples.
    """
    arguments = ("coat", "coated-gold", "--model", model)
    status, out, _ = run(*arguments, "--alpha", "0.02", "--keep-appearance", "-o", "kept.yaml", "--json")
    report = json.loads(out)
    assert status == 0
    for lobe in report["lobes"]:
        assert lobe["energy_after"] == pytest.approx(lobe["energy_before"], abs=1e-4)
        assert lobe["alpha_after"] == pytest.approx(lobe["alpha_before"], abs=1e-4)
    assert len(vt.load("kept.yaml").interfaces) == 3
    brushed = vt.load("kept.yaml").interfaces[-1]  # as the bare gold is, along the same axis
    assert brushed.rotation == pytest.approx(30, abs=degrees) and brushed.alpha[0] < brushed.alpha[1]
    report = json.loads(run(*arguments, "--json")[1])
    assert any(lobe["energy_after"] != pytest.approx(lobe["energy_before"], abs=1e-3) for lobe in report["lobes"])
    assert files(folder) == {"kept.yaml"}


def test_a_coat_too_rough_to_keep_says_what_is_lost(
    run: Run, folder: Path, solved_once: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: a near material, with a line for each layer; the coat's own lobe has a row, as in JSON."""
    monkeypatch.setattr(surrogate, "ROUNDS", 2)  # of requests, none of which can be met
    arguments = ("coat", "coated.yaml", "--alpha", "0.5", "--keep-appearance")
    status, out, err = run(*arguments, "-o", "rough.yaml")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    start = "cannot keep all of its appearance under the coat: "
    assert sum(start in line for line in lines) == 2 and lines[-1] == "rough.yaml"
    assert any("coat" in line and "0.5000" in line for line in lines)
    report = json.loads(run(*arguments, "--json")[1])
    assert len(report["losses"]) == 2 and report["coat"]["alpha"] == pytest.approx([0.5, 0.5], abs=1e-6)
    assert files(folder) == {"rough.yaml"}


def test_an_answer_names_its_model(run: Run, folder: Path, solved_once: None) -> None:
    """Expected: one line, for the model that renders and for another; always in JSON."""
    lines = {
        "velatura": "Holds for velatura, which renders.",
        "bati2021": "Holds for bati2021; renders are by velatura, whose lobes differ: --model velatura answers for it.",
    }
    for arguments in (
        ["invert", "pair.yaml"],
        ["coat", "coated.yaml"],
        ["coat", "coated.yaml", "--keep-appearance"],
        ["simplify", "frosted-metal", "--interfaces", "1"],
    ):
        assert lines["velatura"] in run(*arguments)[1].splitlines()
        assert json.loads(run(*arguments, "--json")[1])["model"] == "velatura"
        if "--keep-appearance" not in arguments:
            assert lines["bati2021"] in run(*arguments, "--model", "bati2021")[1].splitlines()
        assert json.loads(run(*arguments, "--model", "bati2021", "--json")[1])["model"] == "bati2021"
    assert json.loads(run("invert", "bright.yaml", "--json")[1])["model"] == "velatura"


def test_a_kept_appearance_is_held_to_the_model_that_renders(run: Run, folder: Path) -> None:
    """Expected: how far it is kept by that one, as vt.lobes has it, and the lobe that the coat itself adds."""
    arguments = ("--alpha", "0.1", "--keep-appearance", "--model", "bati2021")
    _, out, _ = run("coat", "coated-gold", *arguments, "-o", "kept.yaml")
    before, after = vt.lobes("coated-gold", 1.0), vt.lobes("kept.yaml", 1.0)
    energy, alpha = (
        max(abs(x - y).max() for x, y in zip(getattr(before, name), getattr(after, name)[1:]))
        for name in ("energy", "alpha")
    )
    assert energy > 0.01 < alpha
    assert f"Kept by bati2021; by velatura, which renders, energy changes by up to {energy:.4f} and alpha by " in out
    assert f"by up to {alpha:.4f}: --model velatura keeps them by it." in out
    coat = vt.lobes("kept.yaml", 1.0, model="bati2021").energy[0][0, 0]
    row = next(line for line in out.splitlines() if "coat " in line and "│" in line)
    assert row.replace("│", " ").split() == ["coat", f"{coat:.4f}", "0.1000"]


METAL = "{energy: 0.45, variance: 0.03, interfaces: 2, base: conductor}"
BLUE = "{energy: [0.025, 0.045, 0.05], variance: 0.028, interfaces: 2}"
RED = "{energy: [0.052, 0.025, 0.025], variance: 0.014, interfaces: 2}"


@pytest.mark.parametrize(
    ("lobes", "deep"),
    [([METAL], 0.05), ([BLUE, RED], 0.3), ([RED, BLUE], 0.3)],
    ids=["figures 1 (b) and 16", "figure 17, blue over red", "figure 17, red over blue"],
)
def test_figures_of_the_paper_are_explored(run: Run, folder: Path, lobes: list[str], deep: float) -> None:
    """Expected: stacks that differ towards the edge; the lowest medium of some absorbs, by channel; no index is 1."""
    Path("figure.yaml").write_text("lobes:\n" + "".join(f"  - {lobe}\n" for lobe in lobes))
    status, out, _ = run("explore", "figure.yaml", "--count", "10", "--model", "bati2021")
    *stacks, _ = out.splitlines()
    assert (status, len(stacks)) == (0, 10)
    assert float(stacks[-1].split()[0]) > 0.01
    lowest = [line.split(" | ")[-2] for line in stacks]
    coloured = [json.loads(part.removeprefix("tau ")) for part in lowest if part.startswith("tau [")]
    assert max(max(tau) for tau in coloured) > deep
    assert not any("eta 1 alpha" in line for line in stacks)


def test_stacks_by_their_difference_at_grazing_angles(run: Run, folder: Path) -> None:
    """Expected: a line for each stack, from the same to the most different, and the model; and a sheet of renders."""
    status, out, _ = run("explore", "pair.yaml", "--count", "3")
    *stacks, model = out.splitlines()
    assert model == "Holds for velatura, which renders."
    apart = [float(line.split()[0]) for line in stacks]
    assert (status, len(apart), apart[0]) == (0, 3, 0)
    assert apart == sorted(apart)
    assert run("explore", "pair.yaml", "--count", "2", "--sheet", "--size", "16", "--spp", "1")[0] == 0
    assert (folder / "pair-sheet.png").read_bytes().startswith(b"\x89PNG")


def test_a_way_out_is_taken_by_its_number(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: JSON lists the ways; one is taken, and its stack written; without that number the refusal stays."""
    monkeypatch.chdir(tmp_path)
    Path("bright.yaml").write_text("lobes:\n  - {energy: 0.5, alpha: 0.1}\n")
    arguments = ("invert", "bright.yaml", "--model", "bati2021")
    status, out, _ = run(*arguments, "--json")
    words = [way["words"] for way in json.loads(out)["ways"]]
    assert status == 3 and words[0].startswith("lobe 1 energy 0.35")
    status, out, err = run(*arguments, "--way", "1", "-o", "stack.yaml")
    assert (status, err) == (0, "") and f"Taken in its place: {words[0]}." in out
    assert vt.load("stack.yaml").interfaces[0].eta == pytest.approx(4, abs=1e-3)
    assert run(*arguments, "--way", "9")[0] == 3
