"""All code of the manual, its gallery and the README runs as it is printed.

Rationale: what a page prints is copied. The Python of a page runs in its order and in one namespace, its commands in
this process, both in a folder with the files that the page takes for granted. Pictures and samples are few here,
regardless of what the page asks for. Expected: no error, and exit status 0. Commands within sentences, which have names
in place of files, are not run: expected are a verb and options that the program has.
"""

from __future__ import annotations

import inspect
import re
import runpy
import shlex
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import typer
import yaml
from fewer import with_less
from manual import BLOCK, PAGES, ROOT, blocks, written

import velatura as vt
from velatura import api, comparison, figures, inverse, kernel, sweeps
from velatura.benchmark import cost, entrants, scores, stacks
from velatura.benchmark.candidates import Walk
from velatura.cli import app
from velatura.comparison import evaluated_lobes, pictures, plugins
from velatura.editor import server
from velatura.errors import Incomplete
from velatura.inverse.fitting import descent
from velatura.inverse.lobes.target import FURTHER
from velatura.programs import fit
from velatura.shader import closures, prefiltered
from velatura.sweeps import run as sweeping

Run = Callable[..., tuple[int, str, str]]
COMMAND = re.compile(r"^(velatura|make|pip|python) ", re.MULTILINE)

SCRIPTS = sorted((ROOT / "docs" / "examples").glob("*.py"))

# A model that solves no energies, in place of the default one where that would take minutes
QUICK = "bati2021"

# Commands that are not run here, by their beginning, and why
ELSEWHERE = {
    "make demo": "it installs, as each run of these tests has done",
    "make test": "it runs this test",
    "pip install": "it installs",
    "python benchmarks/fuzz.py": "it takes hours; tests/system/test_random_inputs.py runs a part",
    "python benchmarks/validation.py": "it takes two minutes; tests/unit/test_validation.py runs a part",
    "velatura benchmark truth": "it takes hours; tests/unit/test_benchmark.py walks through a part",
    "mpiexec": "it needs MPI",
    "velatura export worn-painted-steel": "it takes ten seconds; tests/system/test_baked_maps.py bakes smaller images",
    "velatura edit --static": "it takes minutes; tests/browser/test_offline.py writes a part",
}
# Options that commands are given here besides their own, by the beginnings of these, and why
BESIDES = {
    "velatura benchmark score --edition 2": ("--model walk,velatura,openpbr", "the first has scored all"),
    **{
        f"velatura invert {target}": (f"--model {QUICK}", "tests/unit/test_inverse_wishes.py asks the default model")
        for target in ("pane.yaml", "bright-edge.yaml", "workshop.yaml")
    },
}
# Languages that are not run here, and why
OTHERS = {
    "text": "it is output",
    "glsl": "tests/system/test_engines.py runs it",
    "js": "tests/browser/test_shader.py runs it",
    "html": "tests/browser/test_three.py, test_three_webgpu.py and test_babylon.py open it",
}
# Pages that are not run here, and the tests that run them whole
PAGES_ELSEWHERE = {"docs/tutorials/four-steps.md": "tests/system/test_newcomer.py"}
# Scripts of the gallery that are not run here, and the tests that run them
RUN_ELSEWHERE = {
    "coats.py": "tests/system/test_sweeps.py",
    "recover.py": "tests/system/test_in_mitsuba.py",
    "recover_texture.py": "tests/system/test_in_mitsuba.py",
}


def commands(text: str) -> list[list[str]]:
    """The words of each command of a block."""
    lines = text.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


# Files that pages take for granted


def material(folder: Path, name: str = "coated-gold.yaml") -> None:
    vt.save(vt.preset("coated-gold"), folder / name)


def picture(folder: Path, name: str) -> None:
    import mitsuba as mi

    vt.kernel.mitsuba()
    kind, value = (np.uint8, 128) if name.endswith(".png") else (np.float32, 0.5)
    mi.Bitmap(np.full((4, 8, 3), value, kind)).write(str(folder / name))


def table(folder: Path) -> None:
    """Of one metal, in a few directions."""
    stack = vt.Stack([vt.Interface(eta=1.5, k=3.0, alpha=0.2)])
    rows = inverse.table_of(stack, inverse.Directions.about_lobes(False), vt.MODELS[0])
    wi, wo = rows.directions.wi, rows.directions.wo
    angles = [np.degrees(np.arccos(w[2])) for w in (wi, wo)]
    phi = np.degrees(np.arctan2(wo[1], wo[0]) - np.arctan2(wi[1], wi[0]))
    lines = [",".join(f"{x:.6f}" for x in row) for row in zip(*angles, phi, *rows.value)]
    (folder / "table.csv").write_text("theta_i,theta_o,phi,r,g,b\n" + "\n".join(lines) + "\n")


def files_of_benchmark(folder: Path) -> None:
    script = next(text for text in written("docs/how-to/benchmark.md", "python") if "task/mine.npy" in text)
    (folder / "mine.py").write_text(script)


def files_of_readme(folder: Path) -> None:
    material(folder, "my-material.yaml")
    picture(folder, "sunset.hdr")
    (folder / "target.yaml").write_text(written("docs/how-to/inverse.md", "yaml")[0])
    (folder / "plan.yaml").write_text(written("docs/how-to/sweeps.md", "yaml")[0])
    (folder / "varnished.mtlx").write_text(written("docs/how-to/imports.md", "xml")[0])


def files_of_inverse(folder: Path) -> None:
    further = "pane.yaml", "bright-edge.yaml", "wider-edge.yaml", "flakes.yaml", "workshop.yaml", "lacquered.yaml"
    names = "target.yaml", None, *further, "metal.yaml", "blue-over-red.yaml"
    for name, text in zip(names, written("docs/how-to/inverse.md", "yaml")):
        if name:
            (folder / name).write_text(text)
    table(folder)


def files_of_materials(folder: Path) -> None:
    picture(folder, "scratches.png")
    for part in ("eta", "k"):
        (folder / f"my-alloy.{part}.spd").write_text("400 1.5\n700 2.5\n")


def files_of_mitsuba(folder: Path) -> None:
    material(folder)
    picture(folder, "scratches.png")
    parts = '<integrator type="path"/><shape type="sphere"/><sensor type="perspective"/>'
    (folder / "scene.xml").write_text(f'<scene version="3.0.0">{parts}</scene>')


def files_of_imports(folder: Path) -> None:
    (folder / "varnished.mtlx").write_text(written("docs/how-to/imports.md", "xml")[0])


def files_of_shaders(folder: Path) -> None:
    vt.export("coated-gold", "mitsuba-xml").save(folder / "gold.xml")
    vt.export("frosted-metal", "bsdf").save(folder / "gold.bsdf")


FILES: dict[str, Callable[[Path], None]] = {
    "README.md": files_of_readme,
    "docs/how-to/benchmark.md": files_of_benchmark,
    "docs/how-to/imports.md": files_of_imports,
    "docs/how-to/in-mitsuba.md": files_of_mitsuba,
    "docs/how-to/inverse.md": files_of_inverse,
    "docs/how-to/shaders.md": files_of_shaders,
    "docs/reference/materials.md": files_of_materials,
}


# Fewer samples

# Of what a page asks for: pixels, samples, walks, stacks; and of a model, one that solves no energies
LESS = {"spp": 2, "size": (8, 8), "paths": 1000, "count": 2}
FEWER: list[tuple[Any, str, dict[str, Any]]] = [
    (api, "render", {**LESS, "model": lambda given: given or QUICK}),
    (comparison, "compare", {**LESS, "cos_theta": (0.7,), "models": lambda given: given or [QUICK]}),
    *((inverse, name, {**LESS, "model": QUICK}) for name in ("invert_stack", "alternatives", "simplify")),
    (inverse, "fit_target", {"starts": 1, "model": QUICK}),
    (inverse, "answers", LESS),
    (inverse, "coat", {"model": QUICK}),
]
# Of what no page asks for: samples, and directions and steps of fits
NUMBERS: list[tuple[Any, str, Any]] = [
    *((module, "SAMPLES", 2**14) for module in (evaluated_lobes, plugins)),
    (evaluated_lobes, "LIT_SAMPLES", 2**14),
    (pictures, "SAMPLES", 4),
    (scores, "SAMPLES", 6),
    (entrants, "WALK", Walk(seed=1, paths=2**13)),
    (cost, "POWER", 12),
    (cost, "TURNS", 3),
    (closures, "PLANE", (16, 9)),
    (descent, "ROUNDS", 4),
    (prefiltered, "SAMPLES", 64),
    (prefiltered, "LINE", (16,)),
    (prefiltered, "PLANE", (8, 5)),
    (fit, "NODES", 40),
    (fit, "AZIMUTHS", (0.0,)),
    (fit, "STEPS", 1),
    (fit, "REPORTED", 2**10),
    (fit, "COMPARED", 2**12),
]


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small pictures, few walks, few points; no server stays."""
    for module, name, fewer in FEWER:
        monkeypatch.setattr(module, name, with_less(getattr(module, name), **fewer))
    for module, name, value in NUMBERS:
        monkeypatch.setattr(module, name, value)

    def figure(name: str) -> Any:
        found = real(name)
        monkeypatch.setattr(found, "compute", with_less(found.compute, **{**LESS, "size": 8}))
        return found

    def sweep(plan: sweeps.Plan, store: Any, *_: Any, **named: Any) -> Any:
        with ThreadPoolExecutor(1) as executor:
            return all_of(plan.model_copy(update={"count": 4}), store, executor)

    one = {1: stacks.chosen(["diffuse base"], 1)[:1], 2: stacks.chosen(["wet asphalt"], 2)[:1]}
    monkeypatch.setattr(scores, "chosen", lambda kinds, number: one[number])
    real, all_of = figures.figure, sweeping.carry_out
    monkeypatch.setattr(figures, "figure", figure)
    monkeypatch.setattr(sweeping, "carry_out", sweep)
    monkeypatch.setattr(sweeps, "carry_out", sweep)
    monkeypatch.setattr(server, "serve", lambda material, port, browser: vt.load(material))


# The code


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page) and page not in PAGES_ELSEWHERE])
def test_the_code_of_a_page_runs(
    page: str, run: Run, cheap: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    FILES.get(page, lambda folder: None)(tmp_path)
    names: dict[str, Any] = {}
    printed = ""
    for language, text in blocks(page):
        if language == "python":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", Incomplete)
                exec(compile(text, page, "exec"), names)
        elif language == "sh":
            for command in commands(text):
                if not any(" ".join(command).startswith(known) for known in ELSEWHERE):
                    printed += carry_out(command, page, run)
        elif language == "yaml":
            parse(text, tmp_path)
        elif language == "csv":
            (tmp_path / text.splitlines()[0].removeprefix("# ")).write_text(text)
        elif language == "xml" and text.startswith("<?xml"):
            ElementTree.fromstring(text)  # a file that commands of the page read
        elif language == "xml":
            vt.register()
            vt.kernel.mitsuba().load_string(f'<scene version="3.0.0">{text}</scene>')
        else:
            assert language in OTHERS, f"{page}: a language that no test runs: {language or text}"
            assert language != "text" or not COMMAND.search(text), f"{page}: commands need a block of sh: {text}"
            if text.startswith("┃"):  # rows of a table that a command above has printed
                assert [row for row in text.splitlines() if row not in printed] == []


def carry_out(command: list[str], page: str, run: Run) -> str:
    """Run a command of Velatura, or a script in the current folder. Returns what the former prints."""
    program, *words = command
    if program == "python" and Path(words[0]).exists():
        runpy.run_path(words[0])
        return ""
    assert program == "velatura", f"{page}: neither run nor excepted: {' '.join(command)}"
    besides = [given for known, (given, _) in BESIDES.items() if " ".join(command).startswith(known)]
    status, out, err = run(*words, *shlex.split(" ".join(besides)))
    assert status == 0, f"{page}: {' '.join(command)}: {err}"
    return out


def parse(text: str, folder: Path) -> None:
    """Read a block as the file that it is: a target, a plan, a material, or layers of one; and keep it under the name
    that stands in its first line."""
    named = re.match(r"# (\S+\.yaml)$", text, re.MULTILINE)
    path = folder / (named[1] if named else "block.yaml")
    path.write_text(text if not text.startswith("-") else f"layers:\n{text}")
    keys = yaml.safe_load(path.read_text()).keys()
    if keys & {"lobes", *FURTHER}:
        inverse.load_target(path)
    elif "vary" in keys:
        sweeps.load_plan(path)
    else:
        vt.load(path)


@pytest.mark.parametrize(
    "script", [path for path in SCRIPTS if path.name not in RUN_ELSEWHERE], ids=lambda path: path.stem
)
def test_a_script_of_the_gallery_runs(
    script: Path, cheap: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In pictures of the size that it asks for, which it may put together."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.chdir(tmp_path)
    mitsuba = kernel.mitsuba("llvm_ad_rgb")
    for module in (api, mitsuba):
        monkeypatch.setattr(module, "render", with_less(inspect.unwrap(module.render), spp=2))
    runpy.run_path(str(script), run_name="__main__")
    pyplot.close("all")


def sentences(command: str) -> list[tuple[str, str, str]]:
    """What stands outside blocks between backticks: the page, and both groups of a pattern."""
    found = []
    for page in PAGES:
        text = BLOCK.sub("", (ROOT / page).read_text(encoding="utf-8"))
        found += [(page, *groups) for groups in re.findall(f"`{command}`", text.replace("\n", " "))]
    return found


def test_commands_in_sentences_exist() -> None:
    said = sentences(r"(velatura) ([^`]+)")
    assert len(said) > 20
    program = typer.main.get_command(app)
    for page, _, command in said:
        words, verb = shlex.split(command), program
        while words and hasattr(verb, "commands"):
            assert words[0] in verb.commands, f"{page}: no such verb: velatura {command}"
            verb = verb.commands[words.pop(0)]
        options = {name for parameter in verb.params for name in parameter.opts}
        unknown = {word for word in words if word.startswith("-")} - options
        assert not unknown, f"{page}: no such option: velatura {command}"


def test_programs_in_sentences_exist() -> None:
    said = sentences(r"(?:python )?((?:benchmarks|tools)/\w+\.py)([^`]*)")
    assert len(said) > 20
    for page, program, words in said:
        source = (ROOT / program).read_text(encoding="utf-8")
        if "from walks import" in source:  # which declares options of several programs
            source += (ROOT / "benchmarks" / "walks.py").read_text(encoding="utf-8")
        for option in re.findall(r"--[\w-]+", words):
            name = option[2:].replace("-", "_")
            declared = f'"{option}"', f" {name}=", f'"{name}":'  # in words, or by `rows.parser`
            assert any(each in source for each in declared), f"{page}: no such option: {program} {option}"
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    for page, target, _ in sentences(r"make ([a-z-]+)()"):
        assert target in targets, f"{page}: make {target}"


def test_all_exceptions_are_needed() -> None:
    """Expected: a command or a language that no page has any more is none here."""
    said = [
        " ".join(command) for page in PAGES for kind, text in blocks(page) if kind == "sh" for command in commands(text)
    ]
    assert [known for known in (*ELSEWHERE, *BESIDES) if not any(command.startswith(known) for command in said)] == []
    assert set(OTHERS) <= {language for page in PAGES for language, _ in blocks(page)}
    assert set(FILES) <= set(PAGES)
    for script, test in (*RUN_ELSEWHERE.items(), *PAGES_ELSEWHERE.items()):
        assert f'"{script}"' in (ROOT / test).read_text(encoding="utf-8")
