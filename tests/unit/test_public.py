"""The public surface: what `import velatura as vt` offers, and what it accepts."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import assert_type, deprecated

import velatura as vt
from velatura.model.lobe_statistics import StackLobes
from velatura.stack import dumps


def refusal(call: Callable[[], object]) -> str:
    """What is said of a valid material: so it was read, and nothing slow was begun."""
    with pytest.raises(vt.InvalidInput, match="fewer than the 2 that there are") as caught:
        call()
    return str(caught.value)


ONE_DIRECTION = vt.inverse.Directions.of(np.array([30.0]), np.array([30.0]), np.array([180.0]))
TABLE = vt.inverse.ReflectanceTable(ONE_DIRECTION, np.ones((3, 1)))

# A function, called with a material: each gives the same for a stack, a file and the name of a preset.
ASKED: dict[str, Callable[[Any], Any]] = {
    "load": lambda m: vt.load(m),
    "lobes": lambda m: np.array(vt.lobes(m, [1.0, 0.5]).energy),
    "compare": lambda m: vt.compare(m, ["belcour2018"], [0.7], paths=100).truth.albedo,
    "reference.statistics": lambda m: vt.reference.statistics(m, 0.7, paths=100).energy[0],
    "reference.distribution": lambda m: vt.reference.distribution(m, 0.7, paths=100, bins=4).reflected,
    "reference.stokes": lambda m: vt.reference.stokes(m, 0.7, paths=100).reflected[0],
    "inverse.coat": lambda m: vt.inverse.coat(m, 1.3).stack,
    "inverse.simplify": lambda m: refusal(lambda: vt.inverse.simplify(m, 2)),
    "inverse.grazing": lambda m: vt.inverse.grazing(m),
    "inverse.on_black": lambda m: vt.inverse.on_black(m),
    "inverse.table_of": lambda m: vt.inverse.table_of(m, ONE_DIRECTION, "bati2021").value,
    "inverse.fit": lambda m: vt.inverse.fit(TABLE, [m], "bati2021").stack,
    "shader": lambda m: vt.shader.shader(m).text,
    "bsdf": lambda m: str(vt.bsdf(m)),
    "render": lambda m: np.array(vt.render(m, spp=1, size=(8, 8))),
    "check": lambda m: [finding.law for finding in vt.check(m, "bati2021").findings],
}


@pytest.mark.parametrize("name", ASKED)
def test_a_material_is_a_stack_a_file_or_a_preset(name: str, tmp_path: Path) -> None:
    stack = vt.preset("coated-gold")
    path = tmp_path / "gold.yaml"
    path.write_text(dumps(stack))
    first, *others = (ASKED[name](material) for material in (stack, path, str(path), "coated-gold"))
    for other in others:
        assert np.allclose(first, other) if isinstance(first, np.ndarray) else first == other


@pytest.mark.parametrize("material", [None, 3, {"layers": []}, "no-such-preset", "no-such.yaml"])
def test_what_is_no_material_is_refused_in_one_line(material: Any) -> None:
    with pytest.raises(vt.InvalidInput) as caught:
        vt.lobes(material, 1.0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("cos_theta", "phi", "message"),
    [
        ([[1.0, 0.5]], 0.0, "cos_theta: must be a number or a list of numbers, got an array of shape (1, 2)"),
        ([1.0, [0.5, 0.2]], 0.0, "cos_theta: must be a number or a list of numbers"),
        ("one", 0.0, "cos_theta: must be a number or a list of numbers"),
        ([1.0, 0.5], [0.0, 1.0, 2.0], "phi: must be one number, or 2 as cos_theta is, got 3"),
        ([1.0, 0.5], [[0.0, 1.0]], "phi: must be a number or a list of numbers, got an array of shape (1, 2)"),
        (1.0, float("nan"), "phi: must be finite, got nan"),
        ([0.5, 1.5], 0.0, "cos_theta: must lie in 0 (excluded) to 1, got 1.5"),
    ],
)
def test_directions_of_another_shape_are_refused_in_one_line(cos_theta: Any, phi: Any, message: str) -> None:
    for function in (vt.lobes, vt.reference.statistics, vt.reference.distribution, vt.reference.stokes):
        with pytest.raises(vt.InvalidInput) as caught:
            function("coated-gold", cos_theta, phi)
        assert str(caught.value) == message


@pytest.mark.parametrize(("cos_theta", "phi"), [([1.0, 0.5], 0.3), (0.5, [0.3, 0.6]), ([0.5], [0.3, 0.6])])
def test_one_of_a_kind_goes_with_all_of_the_other(cos_theta: Any, phi: Any) -> None:
    whole = vt.lobes("coated-gold", *np.broadcast_arrays(cos_theta, phi))
    found = vt.lobes("coated-gold", cos_theta, phi)
    assert np.array_equal(found.alpha, whole.alpha)
    assert found.energy[0].shape == (3, 2)


def test_errors_are_caught_by_their_public_names() -> None:
    with pytest.raises(vt.NoSolution):
        vt.inverse.invert_stack([{"energy": 0.9, "alpha": 0.1}])
    assert all(issubclass(e, vt.VelaturaError) for e in (vt.InvalidInput, vt.NoSolution, vt.MissingTool, vt.LawBroken))
    assert issubclass(vt.InvalidInput, ValueError)


def test_help_says_shapes_units_and_errors(capsys: pytest.CaptureFixture[str]) -> None:
    help(vt.lobes)
    text = capsys.readouterr().out
    assert text.startswith("Help on function lobes in module velatura.api:")
    for word in ("preset", "radians", "Returns:", "(C, N)", "(2, N)", "Raises:", "InvalidInput"):
        assert word in text


def test_what_is_offered_has_types() -> None:
    """mypy reads these; `Any` would pass for none of them."""
    assert_type(vt.lobes("coated-gold", 1.0), StackLobes | Any)
    assert_type(vt.load("coated-gold"), vt.Stack | Any)
    assert_type(vt.inverse.coat("coated-gold"), vt.inverse.Coated)


REFUSED: dict[str, Callable[[], object]] = {
    "count of stacks": lambda: vt.inverse.alternatives([{"energy": 0.04}], 0),
    "count that is no number": lambda: vt.inverse.alternatives([{"energy": 0.04}], "many"),
    "interfaces": lambda: vt.inverse.simplify("coated-gold", "few"),  # type: ignore[call-overload]
    "paths": lambda: vt.compare("coated-gold", ["belcour2018"], paths=1.5),
    "walks": lambda: vt.reference.statistics("coated-gold", 1.0, paths="many"),  # type: ignore[call-overload]
    "BSDF": lambda: vt.check(3),
    "changed record": lambda: setattr(vt.preset("coated-gold").layers[0], "eta", 2.0),
    "unknown switch": lambda: vt.lobes("coated-gold", 1.0, nosuch="x"),
    "unknown model": lambda: vt.bsdf("coated-gold", "nosuch"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_every_refusal_is_an_error_of_ours_in_one_line(what: str) -> None:
    with pytest.raises(vt.VelaturaError) as caught:
        REFUSED[what]()
    assert str(caught.value) and "\n" not in str(caught.value)


def test_the_library_prints_nothing() -> None:
    """But for the command line, the server that it starts, and progress on terminals."""
    speaks = {"cli", "editor/server.py", "plugins/progress.py"}
    source = Path(vt.__file__).parent
    for path in source.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(source).as_posix()
        if "print(" in text and not {name, name.split("/")[0]} & speaks:
            called = (node.func for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call))
            assert not any(isinstance(each, ast.Name) and each.id == "print" for each in called), name


DEPRECATED = re.compile(r"is deprecated since \d+\.\d+ and goes in \d+\.\d+; write \S")


def test_what_is_deprecated_says_what_to_write() -> None:
    """Expected, as the manual promises: the message has this form, here of an example, and in all sources."""

    @deprecated("vt.old is deprecated since 0.2 and goes in 0.3; write vt.new")
    def old() -> int:
        return 3

    with pytest.warns(DeprecationWarning, match=DEPRECATED):
        assert old() == 3
    for path in Path(vt.__file__).parent.rglob("*.py"):
        for message in re.findall(r'@deprecated\("([^"]*)"\)', path.read_text(encoding="utf-8")):
            assert DEPRECATED.search(message), path


def test_every_public_name_is_there() -> None:
    for name in vt.__all__:
        assert getattr(vt, name) is not None
