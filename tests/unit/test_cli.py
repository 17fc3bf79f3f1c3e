"""The command line around the model: how arguments are read, what is printed, and which status it exits with.

The model and the renderer are replaced by the plainest things that have their shape, so that every number that is
printed here is known.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import velatura
from velatura.cli import options, progress
from velatura.errors import MissingTool, NoSolution
from velatura.inverse.lobes.target import Fixed, Target, TargetLobe, load_target
from velatura.kernel import Component
from velatura.model.lobe_statistics import LobeStatistics, StackLobes
from velatura.scenes.stage import width_and_height

Run = Callable[..., tuple[int, str, str]]

MATERIAL = """\
name: Varnish
layers:
  - interface: {eta: 1.5, alpha: 0.1}
  - medium: {sigma_a: [0.1, 0.2, 0.3]}
  - interface: {eta: 0.2, k: 3.9, alpha: 0.2}
"""


@pytest.fixture
def material(tmp_path: Path) -> str:
    path = tmp_path / "varnish.yaml"
    path.write_text(MATERIAL)
    return str(path)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Puts stubs in the place of model and scenes, and notes what they are called with."""
    seen: dict[str, Any] = {}

    def lobes(stack: Any, cos_theta: list[float], **options: Any) -> StackLobes:
        seen.update(stack=stack, cos_theta=cos_theta, **options)
        n = len(cos_theta)
        lobe = LobeStatistics(
            energy=np.arange(3 * n).reshape(3, n) / 10,
            covariance=np.arange(3 * n).reshape(3, n) + 1.0,
            alpha=np.array([[0.1] * n, [0.2] * n]),
            rotation=np.full(n, math.pi / 6),
            own_alpha=np.array([[0.3] * n, [0.4] * n]),
            own_rotation=np.zeros(n),
        )
        incident = np.array([np.zeros(n), np.zeros(n), cos_theta])
        transmitted = lobe if seen.get("transmits") else None
        found = StackLobes.of(tuple(incident), [lobe, lobe], transmitted, np.full((3, n), 0.25))
        return replace(found, passed=np.zeros((3, n)), absorbed=np.full((3, n), 0.5))

    def render(stack: Any, progress: Callable[[int, int], None], **options: Any) -> np.ndarray:
        seen.update(stack=stack, **options)
        progress(1, 2)
        seen.get("meanwhile", lambda: None)()
        return np.zeros((6, 8, 3))

    scenes = SimpleNamespace(
        check_view=lambda view: seen.update(view=view),
        check_writable=lambda path: seen.update(checked=path),
        write_image=lambda image, path, view: path.write_text(f"picture {image.shape}"),
    )
    model = SimpleNamespace(DEFAULT="plain", SWITCHES={"tir": ("off", "published"), "map": ("belcour", "weier")})
    monkeypatch.setitem(sys.modules, "velatura.model", model)
    monkeypatch.setitem(sys.modules, "velatura.scenes", scenes)
    monkeypatch.setitem(sys.modules, "velatura.scenes.stage", SimpleNamespace(width_and_height=width_and_height))
    for name, stub in {"model": model, "scenes": scenes, "lobes": lobes, "render": render}.items():
        monkeypatch.setitem(vars(velatura), name, stub)
    return seen


# Arguments


@pytest.mark.parametrize(
    ("setting", "name", "expected"),
    [
        ("layer0_alpha_u=.3", "layer0_alpha_u", 0.3),
        ("layer0_alpha=2e-1", "layer0_alpha_v", 0.2),
        ("layer1_sigma_a=1,2,3", "layer1_sigma_a", (1.0, 2.0, 3.0)),
        ("layer1_sigma_a=[1, 2, 3]", "layer1_sigma_a", (1.0, 2.0, 3.0)),
        ("layer0_eta=1.7", "layer0_eta", 1.7),
        ("exterior=1.33", "exterior", 1.33),
    ],
)
def test_set_changes_a_parameter(
    run: Run, material: str, calls: dict[str, Any], setting: str, name: str, expected: object
) -> None:
    assert run("lobes", material, "--set", setting)[0] == 0
    assert calls["stack"].flat()[name] == expected


def test_set_takes_switches_and_names(run: Run, material: str, calls: dict[str, Any]) -> None:
    status, _, _ = run("lobes", material, "--set", "tir=off", "--set", "map=weier", "--set", "layer2_conductor=Au")
    assert status == 0
    assert (calls["tir"], calls["map"]) == ("off", "weier")
    assert calls["stack"].kinds == ("dielectric", "medium", "conductor")
    assert calls["stack"].flat()["layer2_eta"].name == "Au"


def test_azimuth_is_in_degrees_outside_and_radians_inside(run: Run, material: str, calls: dict[str, Any]) -> None:
    run("lobes", material, "--phi", "90", "--cos", "1,.5")
    assert calls["phi"] == pytest.approx(math.pi / 2)
    assert calls["cos_theta"] == [1.0, 0.5]


@pytest.mark.parametrize(("size", "expected"), [("32", (32, 32)), ("64x48", (64, 48)), (None, None)])
def test_size_in_pixels(
    run: Run, material: str, calls: dict[str, Any], tmp_path: Path, size: str | None, expected: object
) -> None:
    output = str(tmp_path / "a.png")
    status, out, _ = run("render", material, "-o", output, *(["--size", size] if size else []))
    assert (status, calls["size"]) == (0, expected)
    assert "8 x 6 pixels" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lobes", "M", "--set", "tri=off"], ["tri", "tir"]),
        (["lobes", "M", "--set", "zzz=1"], ["zzz", "tir", "map", "exterior"]),
        (["lobes", "M", "--set", "layer0_alpa=1"], ["layer0_alpa", "alpha"]),
        (["lobes", "M", "--set", "layer9_alpha=1"], ["layer9_alpha", "layer 2"]),
        (["lobes", "M", "--set", "layer0_alpha=-1"], ["alpha", "-1", "0 to 1"]),
        (["lobes", "M", "--set", "layer0_alpha=rough"], ["alpha", "rough", "a number"]),
        (["lobes", "M", "--set", "layer0_alpha=[.2"], ["alpha", "[.2"]),
        (["lobes", "M", "--set", "layer0_eta=glas"], ["eta", "glas"]),
        (["lobes", "M", "--set", "tir"], ["tir", "KEY=VALUE"]),
        (["lobes", "M", "--set", "tir="], ["tir", "KEY=VALUE"]),
        (["lobes", "M", "--cos", "one"], ["--cos", "above 0"]),
        (["lobes", "M", "--cos", ""], ["--cos"]),
        (["lobes", "M", "--phi", "up"], ["--phi"]),
        (["lobes", "nowhere.yaml"], ["nowhere.yaml", "not found"]),
        (["lobes", "no-such-preset"], ["no-such-preset"]),
        (["lobes", "a\nb.yaml"], ["a\\nb.yaml: file not found"]),
        (["lobes"], ["M"]),
        (["lobe"], ["lobe", "lobes"]),
        (["lobes", "M", "--jsn"], ["--jsn"]),
        (["export", "M"], ["--to", "Choose from: glsl, "]),
        (["render", "M", "--size", "0"], ["--size", "from 1"]),
        (["render", "M", "--size", "10by10"], ["--size", "WxH"]),
        (["render", "M", "--size", "99999"], ["--size", "16384"]),
        (["render", "M", "--spp", "0"], ["--spp: must be a whole number in 1 to 1048576, got 0\n"]),
        (["render", "M", "--spp", "many"], ["--spp: must be a whole number in 1 to 1048576, got many\n"]),
        (["coat", "M", "--eta", "20"], ["--eta: must be a number in 0.1 to 10.0, got 20\n"]),
        (["render", "M", "--seed", "-1"], ["--seed"]),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    run: Run, material: str, calls: dict[str, Any], arguments: list[str], words: list[str]
) -> None:
    status, out, err = run(*(material if argument == "M" else argument for argument in arguments))
    assert (status, out) == (2, "")
    assert err.startswith("velatura: ")
    assert err.count("\n") == 1
    assert all(word in err for word in words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "bare-gold", "--model", "nosuch"], "velatura, reference, exact, weidlich_wilkie)"),
        (["benchmark", "score", "--model", "nosuch"], "unknown entrant 'nosuch' (known: walk, "),
    ],
)
def test_an_unknown_model_lists_all_that_are_accepted(run: Run, arguments: list[str], words: str) -> None:
    status, out, err = run(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1) and words in err


# Results


def test_json_of_lobes_runs_over_directions(run: Run, material: str, calls: dict[str, Any]) -> None:
    _, out, err = run("lobes", material, "--cos", "1,0.5", "--model", "other", "--json")
    lobe = {
        "energy": [[0.0, 0.2, 0.4], [0.1, 0.3, 0.5]],
        "alpha": [[0.1, 0.2], [0.1, 0.2]],
        "rotation": [math.pi / 6, math.pi / 6],
        "covariance": [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]],
        "own_alpha": [[0.3, 0.4], [0.3, 0.4]],
        "own_rotation": [0.0, 0.0],
    }
    others = {"remainder": [[0.25] * 3] * 2, "passed": [[0.0] * 3] * 2, "absorbed": [[0.5] * 3] * 2}
    expected = {"model": "other", "cos": [1.0, 0.5], "reflected": [lobe, lobe], "transmitted": None} | others
    assert json.loads(out) == expected
    assert err == ""


def test_table_of_lobes(run: Run, material: str, calls: dict[str, Any]) -> None:
    calls["transmits"] = True
    _, out, _ = run("lobes", material, "--cos", "1,0.5")
    assert "Varnish (plain)" in out
    rows = [line.replace("│", " ").split() for line in out.splitlines() if "°" in line]
    assert [row[:2] for row in rows] == [[cosine, name] for cosine in ("1", "0.5") for name in ("R1", "R2", "T")]
    assert rows[0][2:] == ["0.0000", "0.2000", "0.4000", "0.1000", "0.2000", "30.0°"]
    assert [line.replace("│", " ").split() for line in out.splitlines() if "remainder" in line] == [
        [cosine, "remainder", "0.2500", "0.2500", "0.2500"] for cosine in ("1", "0.5")
    ]


def test_render_writes_the_picture_named_after_the_material(
    run: Run, material: str, calls: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, _ = run("render", material, "--set", "tir=off", "--env", "sky", "--spp", "3")
    assert status == 0
    assert Path("varnish.png").read_text() == "picture (6, 8, 3)"
    assert out.startswith("varnish.png: 8 x 6 pixels, 3 samples each")
    expected = {"model": "plain", "tir": "off", "env": "sky", "scene": "ball", "spp": 3}
    assert {key: calls[key] for key in expected} == expected


def test_tables_are_measured(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    row = {
        "table": "dielectric",
        "shape": (64, 64),
        "bytes": 4096,
        "rank": None,
        "build_s": 1.25,
        "max_error": 2e-4,
        "rms_error": 5e-6,
    }
    monkeypatch.setattr("velatura.tables.build.report.report", lambda **_: [row])
    status, out, _ = run("tables", "--json")
    assert (status, json.loads(out)) == (0, [{**row, "shape": [64, 64]}])
    table = run("tables")[1]
    assert all(cell in table for cell in ["dielectric", "64x64", "4096", "1.25", "2.0e-04", "5.0e-06"])


def test_text_is_printed_as_it_is(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rationale: commands and names hold what Rich takes for markup. Expected: the same text, in tables and bars."""
    finding = Component("Extra sweep", 'pip install "velatura[sweep]" [/] :gold:', True)
    monkeypatch.setattr("velatura.kernel.extras", lambda: (finding,))
    assert " ".join(run("doctor")[1].split()).count(finding.found) == 1
    monkeypatch.setenv("FORCE_COLOR", "1")  # as on a terminal
    monkeypatch.setenv("TERM", "xterm")
    for title, made in (("[/a] :gold:", progress.bar), ("[/b] :gold:", lambda title: progress.clock(title, after=0))):
        shown = io.StringIO()
        monkeypatch.setattr(sys, "stderr", shown)
        with made(title):
            time.sleep(0.05)
        assert title in shown.getvalue()


def test_one_function_makes_the_consoles_of_tables() -> None:
    files = {path.name for path in Path(options.__file__).parent.glob("*.py") if "Console(" in path.read_text()}
    assert files == {"options.py", "progress.py"}


@pytest.mark.parametrize("ok", [True, False])
def test_doctor_says_the_command_that_mends(run: Run, monkeypatch: pytest.MonkeyPatch, ok: bool) -> None:
    found = "19.1" if ok else "missing"
    finding = SimpleNamespace(what="LLVM", found=found, ok=ok, mend="apt-get install -y libllvm19")
    monkeypatch.setattr("velatura.kernel.doctor", lambda: (finding,))
    monkeypatch.setattr(
        "velatura.editor.bundle.finding", lambda: SimpleNamespace(what="Page", found="bundled", ok=True)
    )
    status, out, _ = run("doctor")
    assert status == (0 if ok else 1)
    assert finding.found in out
    assert ("apt-get install -y libllvm19" in out) is not ok


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"velatura {velatura.__version__}\n", "")


def test_cite_prints_entries_of_the_default_model_and_of_others(run: Run) -> None:
    assert [line[:10] for line in run("cite")[1].splitlines() if line.startswith("@")] == ["@software{"] * 2
    status, out, _ = run("cite", "weier2020", "--format", "text")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == ["Weier,", "The", "Jakob,"]
    assert run("cite", "weier")[0] == 2


def test_help_lists_the_models() -> None:
    assert options.MODELS.split(", ") == [model.name for model in velatura.MODELS]


def test_help_fits_a_terminal_and_says_what_each_verb_does(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lines = run("--help")[1].splitlines()[1:]
    assert not any("..." in line for line in lines)
    for line in [*lines, *run("invert", "--help")[1].splitlines()]:
        assert len(line) <= 80


def test_help_of_invert_describes_a_target(run: Run, tmp_path: Path) -> None:
    """Expected: every key, and an example that is a target."""
    out = run("invert", "--help")[1]
    lines = out.splitlines()
    start = next(n for n, line in enumerate(lines) if "name: Hazy metal" in line)
    example = "\n".join(line[2:] for line in lines[start : lines.index("", start)])
    (tmp_path / "target.yaml").write_text(example)
    target = load_target(tmp_path / "target.yaml")
    assert len(target.lobes) == 2
    for key in (*Target.model_fields, *TargetLobe.model_fields, *Fixed.model_fields):
        assert re.search(rf"\b{key}\b", out), key


def test_every_verb_has_help(run: Run) -> None:
    _, out, _ = run("--help")
    for verb in ("render", "lobes", "presets", "schema", "tables", "doctor"):
        assert f"  {verb} " in out
        assert run(verb, "--help")[0] == 0
    assert run()[1] == out


# Ends


def raising(error: BaseException) -> Callable[[], None]:
    def meanwhile() -> None:
        raise error

    return meanwhile


def interrupted_in_a_library() -> None:
    """Libraries that are interrupted in the middle of C++ do not always pass the exception on as it is."""
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt as error:
        raise RuntimeError("a callback failed") from error


@pytest.mark.parametrize("meanwhile", [raising(KeyboardInterrupt()), interrupted_in_a_library])
def test_an_interrupt_leaves_no_picture(
    run: Run,
    material: str,
    calls: dict[str, Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    meanwhile: Callable[[], None],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
    monkeypatch.setattr(os, "_exit", sys.exit)
    calls["meanwhile"] = meanwhile
    status, out, err = run("render", material)
    assert (status, out) == (130, "")
    assert err.endswith("velatura: interrupted\n")
    assert not Path("varnish.png").exists()


@pytest.mark.parametrize(("error", "expected"), [(NoSolution("none exists"), 3), (MissingTool("run apt-get"), 1)])
def test_foreseen_errors_give_their_status(
    run: Run, material: str, calls: dict[str, Any], tmp_path: Path, error: Exception, expected: int
) -> None:
    calls["meanwhile"] = raising(error)
    status, _, err = run("render", material, "-o", str(tmp_path / "a.png"))
    assert status == expected
    assert err.endswith(f"velatura: {error}\n")
    assert "Traceback" not in err


def test_an_unforeseen_error_says_whose_it_is_before_its_traceback(
    run: Run, material: str, calls: dict[str, Any], tmp_path: Path
) -> None:
    calls["meanwhile"] = raising(ZeroDivisionError())
    status, out, err = run("render", material, "-o", str(tmp_path / "a.png"))
    assert (status, out) == (1, "")
    first, then, *_, last = err.splitlines()
    assert first.startswith("velatura: this is a mistake of Velatura's own")
    assert (then, last) == ("Traceback (most recent call last):", "ZeroDivisionError")


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (OSError(28, "No space left on device", "a.png"), "a.png: no space left on device"),
        (OSError("the pipe is closed"), "the pipe is closed"),
        (MemoryError(), "there is not enough memory for this"),
    ],
)
def test_what_the_system_refuses_is_one_line(
    run: Run, material: str, calls: dict[str, Any], tmp_path: Path, error: Exception, says: str
) -> None:
    calls["meanwhile"] = raising(error)
    assert run("render", material, "-o", str(tmp_path / "a.png")) == (1, "", f"velatura: {says}\n")


def test_a_step_that_takes_long_shows_the_time_that_passes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Expected: on a terminal, once it takes long, and nothing at all before that or into a pipe."""
    with progress.clock("Solving a.yaml", after=0.05):
        time.sleep(0.3)
    assert capsys.readouterr() == ("", "")
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, for Rich, that can move its cursor
    monkeypatch.setenv("TERM", "xterm")
    with progress.clock("Solving a.yaml"):
        pass
    assert capsys.readouterr() == ("", "")
    found, deadline = "", time.monotonic() + 30
    with progress.clock("Solving a.yaml", after=0.05):
        while "Solving a.yaml" not in found and time.monotonic() < deadline:
            time.sleep(0.05)
            out, err = capsys.readouterr()
            found += err
            assert out == ""
    assert "Solving a.yaml" in found


def test_a_date_of_the_environment_that_is_none_gets_one_line() -> None:
    """Rationale: NumPy reads it, too, when SciPy is loaded, which a process of its own does anew."""
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "x"}
    command = [sys.executable, "-m", "velatura", "lobes", "bare-gold"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("velatura: SOURCE_DATE_EPOCH: must be whole seconds since 1970")
