"""What the editor's page asks, without a server: the session, shaders, objects, texts, and the files of a folder."""

from __future__ import annotations

import base64
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from velatura import lobes, tables
from velatura.editor import bundle, library, shading
from velatura.editor.folder import Conflict, Folder
from velatura.editor.messages import admitted, document, material_of
from velatura.editor.service import VERBS
from velatura.errors import InvalidInput, MissingTool
from velatura.exports import FORMATS, export
from velatura.model import MODELS
from velatura.model.rough_interface import KEPT
from velatura.scenes import OBJECTS
from velatura.shader.lookups.columns import SolvedContents, SolvedLookUp
from velatura.stack import Film, Interface, Stack, loads, preset, presets
from velatura.stack.layers import LAYERS, entry_name
from velatura.stack.schema import parameters

COAT: dict[str, Any] = {
    "name": "Coat",
    "layers": [{"interface": {"eta": 1.5, "alpha": 0.1}}, {"interface": {"conductor": "Au"}}],
}
MATT: dict[str, Any] = {"name": "Matt", "layers": [{"diffuse": {"albedo": [0.2, 0.5, 0.3]}}]}
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory that is empty."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def decoded(array: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(array["data"]), array["dtype"]).reshape(array["shape"])


def changed(**keys: Any) -> dict[str, Any]:
    """The coat with other keys of its first interface."""
    first, *others = COAT["layers"]
    return {**COAT, "layers": [{"interface": {**first["interface"], **keys}}, *others]}


# Session


@pytest.mark.parametrize("to", [name for name, each in FORMATS.items() if each.is_text])
def test_a_material_is_exported_as_the_command_line_does(to: str) -> None:
    """A coat as code, and what takes no constants, of which much is fitted, of a matt base; `fixed` changes nothing."""
    takes_constants = "constant" in FORMATS[to].options
    material = COAT if takes_constants else MATT
    for fixed in (False, True) if takes_constants else (True,):
        answer = VERBS["export"]({"material": material, "to": to, "fixed": fixed, "model": "realtime"})
        constant = ["all"] if fixed and takes_constants else []
        made = export(Stack.from_dict(material), to, "realtime", constant=constant, folder=".")
        assert answer["text"] == made.text
        assert {ending: decoded(data).tobytes() for ending, data in answer["beside"].items()} == dict(made.beside)
        assert answer["ending"] == FORMATS[to].endings[0]
        assert answer["costs"] == made.costs


def test_a_session_is_json_and_names_all_there_is() -> None:
    session = json.loads(json.dumps(VERBS["session"]({}), allow_nan=False))
    assert [each["name"] for each in session["presets"]] == list(presets())
    assert [each["name"] for each in session["models"]] == [model.name for model in MODELS]
    assert session["objects"] == list(OBJECTS)
    assert session["opened"] is None
    assert {"bk7", "water"} <= set(session["names"]["dielectrics"])
    assert all(len(index["eta"]) == len(index["k"]) == 3 for index in session["names"]["conductors"].values())
    pages = session["names"]["pages"]
    gold, water = pages["main/Au/Johnson"], pages["main/H2O/Hale"]
    assert (gold["title"], gold["opaque"]) == ("Gold (Johnson and Christy 1972)", True)
    assert (water["title"], water["opaque"]) == ("Water (Hale and Querry 1973: Water; 25 °C)", False)
    assert len({page["title"] for page in pages.values()}) == len(pages) == 96


def test_a_new_layer_of_every_kind_is_as_declared() -> None:
    layers = VERBS["session"]({})["layers"]
    assert list(layers) == list(LAYERS)
    for name, layer in layers.items():
        assert layer["title"] == LAYERS[name].title
        made = LAYERS[name].from_dict(layer["fresh"])
        assert entry_name(made) == name and made.kind == next(iter(LAYERS[name].lacks))
    assert layers["interface"]["fresh"] == {"eta": 1.5, "alpha": 0.1}


def test_parameters_are_those_that_are_declared() -> None:
    schema = VERBS["session"]({})["schema"]
    assert [*schema["interface"]] == list(parameters(Interface))
    assert [*schema["film"]] == list(parameters(Film))
    assert (schema["interface"]["films"]["kind"], schema["interface"]["films"]["most"]) == ("films", 8)
    alpha = schema["interface"]["alpha"]
    assert (alpha["kind"], alpha["low"], alpha["high"], alpha["default"], alpha["texturable"]) == (
        "pair",
        0,
        1,
        0,
        True,
    )
    assert schema["interface"]["rotation"]["unit"] == "degrees"
    assert (schema["interface"]["rotation"]["low"], schema["interface"]["eta"]["high"]) == (-1e9, 1e4)
    assert schema["medium"]["g"]["strict"] and schema["interface"]["eta"]["default"] is None
    assert "mirror" in schema["interface"]["conductor"]["options"]


def test_every_preset_can_be_sent_back() -> None:
    for each in VERBS["session"]({})["presets"]:
        assert material_of({"material": each["material"]}) == preset(each["name"])


def test_models_offer_switches_that_they_take() -> None:
    for model in VERBS["session"]({})["models"]:
        named = next(m for m in MODELS if m.name == model["name"])
        for switch, values in model["switches"].items():
            assert model["defaults"][switch] in values
            for value in values:
                named.with_switches(**{switch: value})


# Shaders


def shader(material: dict[str, Any], **more: Any) -> dict[str, Any]:
    return VERBS["shader"]({"material": material, **more})


def test_no_change_of_a_value_changes_the_code() -> None:
    """Not to a smooth interface, an index of one, a named index, or a measured metal."""
    key = shader(COAT)["key"]
    for keys in ({"alpha": 0.0}, {"alpha": 1.0}, {"eta": 1.0}, {"eta": "bk7"}, {"eta": [1.4, 1.5, 1.6]}):
        assert shader(changed(**keys))["key"] == key
    assert shader({**COAT, "name": "Another", "exterior": 1.33})["key"] == key


def test_no_change_of_a_value_changes_the_code_of_a_stretched_interface() -> None:
    """Not to equal roughnesses, nor to a rotation where there was none."""
    key = shader(changed(alpha=[0.1, 0.3]))["key"]
    for keys in ({"alpha": [0.2, 0.2]}, {"alpha": [0.1, 0.3], "rotation": 0}, {"alpha": [0.1, 0.3], "rotation": 20}):
        assert shader(changed(**keys))["key"] == key


def test_layers_models_and_textures_change_the_code(here: Path) -> None:
    (here / "wood.png").write_bytes(PIXEL)
    texture = {"texture": "wood.png", "encoding": "srgb"}
    base = COAT["layers"][1]
    materials = [COAT, changed(alpha=[0.1, 0.2]), changed(alpha=texture), {**COAT, "layers": [base]}]
    keys = [shader(material)["key"] for material in materials] + [shader(COAT, model="belcour2018")["key"]]
    assert len(set(keys)) == len(keys)
    (image,) = shader(changed(alpha=texture))["maps"]
    assert (image["texture"], image["encoding"]) == ("wood.png", "srgb")
    assert image["sampler"] in shader(changed(alpha=texture))["text"]


def test_values_are_those_of_the_material() -> None:
    made = shader(changed(eta=[1.4, 1.5, 1.6], alpha=0.25), model="belcour2018")
    assert set(made["values"]) == set(made["uniforms"])
    assert made["values"]["layer0_eta"] == [1.4, 1.5, 1.6]
    assert made["values"]["layer0_alpha_u"] == 0.25
    assert made["uniforms"]["layer0_alpha_u"] == "layer0.alpha_u"
    (stack,) = made["parts"]
    assert (stack["transmitted"], stack["base"], stack["thin"]) == (False, False, False)


def test_what_is_solved_comes_with_the_code_and_by_itself() -> None:
    """Coarse for what moves: nearly the same, for the same code."""
    made = shader(COAT)
    (stack,) = made["parts"]
    assert (stack["baked"], stack["solved"], made["tables"]) == (None, True, None)
    assert stack["shares"] == ["reflected[0].chance", "reflected[1].chance", "remainder_chance"]
    assert stack["shown"] == ["reflected[0]", "reflected[1]", "remainder"]
    crossed = [changed(alpha=[0.1, 0.3])["layers"][0], {"interface": {"conductor": "Au", "alpha": [0.3, 0.1]}}]
    assert "reflected[2].chance" in shader({"layers": crossed})["parts"][0]["shares"]  # the tail of the metal's lobe
    values = VERBS["values"]({"material": COAT})
    assert values == {key: made[key] for key in ("values", "films", "solution")}
    coarse = VERBS["values"]({"material": COAT, "coarse": True})
    fine, quick = (decoded(each["solution"]["texels"]) for each in (values, coarse))
    assert fine.shape == quick.shape
    assert 0 < np.abs(fine[4:] - quick[4:]).max() < 0.05  # energies
    assert decoded(made["solution"]["remainder"]).shape == (8, 3)
    assert VERBS["values"]({"material": COAT, "model": "belcour2018"})["solution"] is None
    with pytest.raises(InvalidInput, match="coarse: must be true or false"):
        VERBS["values"]({"material": COAT, "coarse": 1})


def test_a_mixture_is_drawn_by_parts() -> None:
    """Each with its own solution, or what works out its lobes; masks are in the code, shares are values."""
    rest = {"material": {"layers": [{"diffuse": {"albedo": 0.2}}]}}
    inner = {"mix": [{"weight": 0.25, "material": COAT}, rest]}
    made = shader({"mix": [{"weight": 0.5, "material": changed(alpha=[0.1, 0.3])}, {"material": inner}]})
    assert [part["prefix"] for part in made["parts"]] == ["part0_", "part1_part0_", "part1_part1_"]
    assert [part["share"] for part in made["parts"]] == ["part0_share", "part1_part0_share", "part1_part1_share"]
    assert [(part["solved"], bool(part["baked"])) for part in made["parts"]] == [
        (True, False),
        (True, False),
        (False, True),
    ]
    height, width = made["texels"]
    texels = [decoded(made["solution"][f"{prefix}texels"]) for prefix in ("part0_", "part1_part0_")]
    assert [part["line"] for part in made["parts"]] == [0, len(texels[0]), len(texels[0]) + len(texels[1])]
    assert width == max(each.shape[1] for each in texels) and height > made["parts"][-1]["line"]
    own = shader(COAT)
    np.testing.assert_array_equal(texels[1], decoded(own["solution"]["texels"]))
    assert made["values"]["part0_weight"] == 0.5 and made["values"]["part1_part0_weight"] == 0.25
    assert made["values"]["part1_part0_layer0_eta"] == own["values"]["layer0_eta"]
    other = {"mix": [{"weight": 0.1, "material": changed(alpha=[0.2, 0.2])}, {"material": inner}]}
    assert shader(other)["key"] == made["key"]  # that is drawn by values alone
    assert made["closed_form"] is False


@pytest.mark.parametrize(
    ("material", "says"),
    [
        ({"mix": [{"material": "gold.yaml"}]}, "material: part 0: material: must be written out here, got 'gold.yaml'"),
        (
            {"mix": [{"material": {"mix": [{"material": None}]}}]},
            "material: part 0: part 0: material: must be written out",
        ),
        ({"mix": 3}, "material: mix: must be a list of parts, got 3"),
        ({"mix": [{"material": COAT}] * 17}, "material: mix: may be 16 parts at most, got 17"),
        (
            {"mix": [{"material": {"layers": COAT["layers"] * 25}}]},
            "material: part 0: layers: may be 48 at most here, got 50",
        ),
        ({"mix": [{"weight": 2, "material": COAT}, {"material": COAT}]}, "mix: part 0: weight: must lie in 0 to 1"),
    ],
)
def test_mixtures_that_are_none_are_refused(material: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        VERBS["shader"]({"material": material})
    assert str(refused.value).startswith(says)


def test_what_takes_no_mixture_says_so() -> None:
    mix = {"mix": [{"weight": 0.5, "material": COAT}, {"material": COAT}]}
    for verb, body in (("appearance", {}), ("coat", {}), ("film", {"layer": 0, "film": 0, "thickness_nm": 100})):
        with pytest.raises(InvalidInput, match=r"takes a single stack, not a mixture$"):
            VERBS[verb]({"material": mix, **body})
    assert "l.part1_share" in VERBS["export"]({"material": mix, "to": "glsl", "model": "realtime"})["text"]
    assert "mix:" in VERBS["write"]({"material": mix})["text"]
    assert VERBS["read"]({"text": VERBS["write"]({"material": mix})["text"], "file": "a.yaml"})["material"] == mix


def test_what_is_dragged_is_solved_for_light_from_above() -> None:
    """Nearly the same as a whole solution there, which is all that a preview reads; the symmetric form reads both.

    A pane whose light is not wide, since the numbers of waves are no light by themselves.
    """
    stack = document(Stack([Interface(eta=1.5, alpha=0.08), Interface(eta=1.0)]))

    def texels(form: str, coarse: bool) -> np.ndarray:
        question = {"material": stack, "switches": {"form": form}, "coarse": coarse}
        lines = decoded(VERBS["values"](question)["solution"]["texels"])
        return lines.reshape(-1, 2, *lines.shape[1:]).swapaxes(0, 1)  # by side

    for form, alike in (("forward", True), ("symmetric", False)):
        (fine, _), (above, below) = texels(form, False), texels(form, True)
        assert np.mean(np.abs(fine - above)) < 0.05
        assert np.array_equal(above, below) is alike


def test_a_drag_takes_over_the_layers_that_it_leaves_alone() -> None:
    """The same answers as without."""

    def dragged(alpha: float) -> np.ndarray:
        solution = VERBS["values"]({"material": changed(alpha=[alpha, 0.2]), "coarse": True})["solution"]
        return decoded(solution["texels"])

    alphas = (0.1, 0.15)
    answers = [dragged(alpha) for alpha in alphas]
    for alpha, answer in zip(alphas, answers):
        KEPT.clear()
        shading._solution.cache_clear()
        assert dragged(alpha) == pytest.approx(answer, abs=1e-6)


@pytest.mark.parametrize("model", ["velatura", "belcour2018"])
def test_films_are_values(model: str) -> None:
    """Code knows that an interface has films, and no more; their texture comes with the values."""
    film, other = {"eta": 2.0, "thickness_nm": 200}, {"eta": "bk7", "thickness_nm": 900}
    bare, one, two = (shader(changed(films=films), model=model) for films in ([], [film], [other, film]))
    assert bare["films"] is None
    assert bare["key"] != one["key"] == two["key"]
    shapes = {"velatura": {"film0": (257, 3)}, "belcour2018": {"film0_above": (65, 33, 3)}}
    assert {name: decoded(table).shape for name, table in one["films"].items()} == shapes[model]
    (before,), (after,) = (each["films"].values() for each in (one, two))
    assert np.abs(decoded(before) - decoded(after)).max() > 0.1
    values = VERBS["values"]({"material": changed(films=[other, film]), "model": model, "coarse": True})
    (coarse,) = values["films"].values()
    assert np.abs(decoded(coarse) - decoded(after)).mean() < 0.01


def test_a_film_has_its_colours_over_thickness() -> None:
    """At the normal, at even steps from 0, where the interface is bare, to the thickness that is asked for."""
    films = [{"eta": 2.0, "thickness_nm": 0}, {"eta": 1.38, "thickness_nm": 90}]
    nothing = {"eta": 4.0, "thickness_nm": 0}
    question = {"material": changed(films=[nothing, *films]), "layer": 0, "film": 1}
    found = decoded(VERBS["film"]({**question, "thickness_nm": 254})["colours"])
    assert found.shape == (128, 3)

    def seen(thickness_nm: float) -> np.ndarray:
        stack = Stack.from_dict(changed(films=[{**films[0], "thickness_nm": thickness_nm}, films[1]]))
        return np.ravel(lobes(stack, 1.0, model="weier2020").energy[0])

    for k in (0, 1, 60, 127):
        np.testing.assert_allclose(found[k], seen(2.0 * k), atol=1e-5)


def test_tables_are_those_that_are_read(here: Path) -> None:
    """A uniform material is worked out by a tape, which reads tables by name; a textured one by a shader."""
    made = shader(COAT, model="belcour2018")
    baked = made["parts"][0]["baked"]
    assert (made["tables"], made["solution"]) == (None, None)
    for name in baked["tables"]:
        expected = dict(tables.load().items())[name].data
        np.testing.assert_array_equal(decoded(VERBS["table"]({"name": name})["table"]), expected)
    with pytest.raises(InvalidInput, match="did you mean conductor"):
        VERBS["table"]({"name": "conducter"})

    (here / "pixel.png").write_bytes(PIXEL)
    textured = shader(changed(alpha={"texture": "pixel.png"}))
    assert textured["parts"][0]["baked"] is None
    texture = decoded(VERBS["tables"]({"key": textured["tables"]})["texture"])
    assert texture.shape[1:] == (1024, 4)
    assert np.isfinite(texture).all()
    with pytest.raises(InvalidInput, match="unknown table 'nonsense'"):
        VERBS["tables"]({"key": "nonsense"})

    shading._made.cache_clear()  # as when other shaders have taken its place, or after a new start
    np.testing.assert_array_equal(decoded(VERBS["tables"]({"key": textured["tables"]})["texture"]), texture)


def test_a_thickness_from_a_texture_has_a_table(here: Path) -> None:
    """Of the second of two films, whose image the code reads; tables are those that the code looks up."""
    (here / "pixel.png").write_bytes(PIXEL)
    films = [{"eta": 1.4, "thickness_nm": 50}, {"eta": 1.9, "thickness_nm": {"texture": "pixel.png", "scale": 60}}]
    made = shader(changed(films=films))
    (name,) = made["films"]
    number, places = name.split("_by")
    assert [each["sampler"] for each in made["maps"]] == [f"vt_map_layer{number[4:]}_film0_thickness_nm"]
    assert decoded(made["films"][name]).shape == (int(places), 257, 3) and f"vec3 vt_{name}(" in made["text"]


def test_the_names_of_all_tables_make_a_key() -> None:
    everything = ",".join(name for name, _ in tables.load().items())
    assert decoded(VERBS["tables"](admitted({"key": everything}))["texture"]).shape[1:] == (1024, 4)


def test_threads_share_the_code_of_a_pattern() -> None:
    """Query from several threads at once: the same answers, and as many programs as there are patterns."""
    materials = [changed(alpha=[0.1, 0.2]), COAT, {**COAT, "layers": [COAT["layers"][1]]}] * 8
    shading._made.cache_clear()
    with ThreadPoolExecutor(8) as pool:
        keys = [made["key"] for made in pool.map(shader, materials)]
    assert keys == [shader(material)["key"] for material in materials]
    assert shading._made.cache_info().currsize == 3
    assert shading._made.cache_info().maxsize is not None


def test_threads_that_ask_for_the_same_solution_work_it_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    solve, solved = SolvedLookUp.solve, []

    def counted(self: SolvedLookUp, stack: Stack, coarse: bool) -> SolvedContents:
        solved.append(stack)
        time.sleep(0.2)  # the others ask meanwhile
        return solve(self, stack, coarse)

    monkeypatch.setattr(SolvedLookUp, "solve", counted)
    body = {"material": changed(alpha=0.1234), "model": "velatura"}
    with ThreadPoolExecutor(4) as threads:
        first, *others = [each["solution"] for each in threads.map(lambda _: VERBS["shader"](body), range(4))]
    assert len(solved) == 1
    assert all(each == first for each in others)


# Objects, light, texts


@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_is_the_one_that_is_rendered(name: str) -> None:
    answer = VERBS["object"]({"name": name})
    body = answer["parts"][0]
    surface = OBJECTS[name].surface()
    assert [part["role"] for part in answer["parts"]] == ["object", "plinth", "ground"]
    np.testing.assert_array_equal(decoded(body["triangles"]), surface.triangles)
    np.testing.assert_allclose(decoded(body["positions"]), surface.positions, atol=1e-6)
    assert answer["view"]["fov"] == OBJECTS[name].view.fov


def test_a_furnace_is_one_everywhere() -> None:
    assert (decoded(VERBS["environment"]({"name": "furnace"})["picture"]) == 1).all()


def test_a_text_is_read_as_it_was_written(here: Path) -> None:
    (here / "wood.png").write_bytes(PIXEL)
    material = changed(alpha={"texture": "wood.png", "channel": "r"})
    text = VERBS["write"]({"material": material})["text"]
    assert loads(text) == Stack.from_dict(material)
    assert VERBS["read"]({"text": text})["material"] == material


@pytest.mark.parametrize(
    ("verb", "body", "reason"),
    [
        ("read", {"text": "layers: ["}, "is not valid YAML"),
        ("read", {"text": "layers: [{interface: {eta: -1}}]"}, "eta: must lie in 0.001 to 1e4"),
        ("read", {}, "text: must be text, got nothing"),
        ("write", {"material": []}, "material: must be an object"),
        ("shader", {"material": COAT, "model": "velatur"}, "did you mean velatura"),
        ("shader", {"material": COAT, "switches": {"tir": "often"}}, "tir: must be one of"),
        ("export", {"material": COAT, "to": "jsn"}, "did you mean json"),
        ("film", {"material": COAT, "layer": 0, "film": 0, "thickness_nm": 9}, "layer 0: has no film 0"),
        ("film", {"material": COAT, "layer": 7, "film": 0, "thickness_nm": 9}, "layer 7: has no film 0"),
        ("film", {"material": COAT, "layer": 0, "film": 0}, "thickness_nm: must be a number, got nothing"),
        ("object", {"name": "bal"}, "did you mean ball"),
        ("environment", {"name": "moon"}, "unknown environment"),
    ],
)
def test_mistakes_are_reported_in_one_line(verb: str, body: dict[str, Any], reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as refused:
        VERBS[verb](body)
    assert "\n" not in str(refused.value)


# Files


def test_a_material_is_saved_and_opened_again(here: Path) -> None:
    verbs = Folder().verbs
    saved = verbs["save"]({"file": "coat.yaml", "material": COAT, "version": None})
    assert verbs["list"]({}) == {"files": ["coat.yaml"], "textures": [], "kept": {}}
    opened = verbs["open"]({"file": "coat.yaml"})
    assert opened == {"material": COAT, "version": saved["version"]}
    verbs["save"]({"file": "coat.json", "material": COAT, "version": None})
    assert json.loads((here / "coat.json").read_text()) == COAT


def test_the_mask_of_a_preset_is_read_and_saved_beside_the_file(here: Path) -> None:
    folder, material = Folder(), document(preset("worn-painted-steel"))
    mask = material["mix"][0]["weight"]["texture"]
    image = folder.picture(mask).read_bytes()
    for name in (mask.replace("wear.png", "worn-painted-steel.yaml"), "../wear.png", str(here / "wear.png")):
        with pytest.raises(InvalidInput, match=r"must be the plain name|must end in"):
            folder.picture(name)
    folder.verbs["save"]({"file": "worn.yaml", "material": material})
    assert (here / "wear.png").read_bytes() == image
    saved = folder.verbs["open"]({"file": "worn.yaml"})["material"]
    assert saved["mix"][0]["weight"]["texture"] == "wear.png"
    assert saved["mix"][1] == material["mix"][1]


def test_of_two_that_save_the_second_is_told() -> None:
    verbs = Folder().verbs
    verbs["save"]({"file": "coat.yaml", "material": COAT, "version": None})
    version = verbs["open"]({"file": "coat.yaml"})["version"]
    with pytest.raises(Conflict, match="exists already"):
        verbs["save"]({"file": "coat.yaml", "material": COAT, "version": None})
    verbs["save"]({"file": "coat.yaml", "material": changed(alpha=0.3), "version": version})
    with pytest.raises(Conflict, match="has changed"):
        verbs["save"]({"file": "coat.yaml", "material": COAT, "version": version})
    assert verbs["open"]({"file": "coat.yaml"})["material"] == changed(alpha=0.3)
    Path("coat.yaml").unlink()
    with pytest.raises(Conflict, match="been removed"):
        verbs["save"]({"file": "coat.yaml", "material": COAT, "version": version})


def test_what_the_library_keeps_follows_its_file(here: Path) -> None:
    """Expected: through a rename, a removal and back; others' files that are no such thing are nothing kept."""
    verbs = Folder().verbs
    verbs["save"]({"file": "coat.yaml", "material": COAT})
    with pytest.raises(InvalidInput, match="there is no such file"):
        verbs["keep"]({"file": "other.yaml", "tags": ["warm"]})
    assert verbs["keep"]({"file": "coat.yaml", "tags": ["warm", "red", "warm"]}) == {"tags": ["warm", "red"]}
    both = {"tags": ["warm", "red"], "thumbnail": library.JPEG + "AA=="}
    assert verbs["keep"]({"file": "coat.yaml", "thumbnail": both["thumbnail"]}) == both
    verbs["rename"]({"file": "coat.yaml", "name": "lacquer.yaml"})
    assert verbs["list"]({})["kept"] == {"lacquer.yaml": both}
    put = verbs["remove"]({"file": "lacquer.yaml"})["file"]
    verbs["save"]({"file": "lacquer.yaml", "material": COAT})
    assert verbs["list"]({})["kept"] == {}
    verbs["restore"]({"file": put, "name": "back.yaml"})
    assert verbs["list"]({})["kept"] == {"back.yaml": both}
    for text in ('{"tags": "warm"}', '{"tags": [1], "more": 2}', "[", "[" * 10**5, '"' + "a" * library.LARGEST + '"'):
        (here / library.FOLDER / "back.yaml.json").write_text(text)
        assert verbs["list"]({})["kept"] == {}


@pytest.mark.parametrize(
    "kept",
    [
        {"tags": ["a,b"]},
        {"tags": [""]},
        {"tags": ["a"] * 17},
        {"tags": ["\n"]},
        {"tags": "a"},
        {"thumbnail": "PHN2Zz4="},
    ],
)
def test_what_the_library_cannot_keep_is_refused(here: Path, kept: dict[str, Any]) -> None:
    verbs = Folder().verbs
    verbs["save"]({"file": "coat.yaml", "material": COAT})
    with pytest.raises(InvalidInput, match=r"^(tags|thumbnail): must be a"):
        verbs["keep"]({"file": "coat.yaml", **kept})
    assert not (here / library.FOLDER).exists()


@pytest.mark.parametrize(
    "name",
    ["../out.yaml", "/tmp/out.yaml", "..\\out.yaml", ".hidden.yaml", "a/b.yaml", "", "a\x00.yaml", "out.py", ".."],
)
def test_nothing_but_plain_names(here: Path, name: str) -> None:
    bodies: dict[str, Any] = {"save": {"material": COAT, "version": None}, "open": {}, "texture": {"data": ""}}
    for verb, body in bodies.items():
        with pytest.raises(InvalidInput):
            Folder().verbs[verb]({"file": name, **body})
    assert list(here.iterdir()) == [] and not list(here.parent.glob("out.*"))


def test_links_lead_nowhere_else(here: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    outside = tmp_path_factory.mktemp("outside") / "coat.yaml"
    outside.write_text("layers: [{interface: {eta: 1.5}}]")
    (here / "link.yaml").symlink_to(outside)
    (here / "loop.yaml").symlink_to("loop.yaml")
    (here / "folder.yaml").mkdir()
    verbs = Folder().verbs
    assert verbs["list"]({})["files"] == []
    for name in ("link.yaml", "loop.yaml", "folder.yaml"):
        with pytest.raises(InvalidInput):
            verbs["open"]({"file": name})
        with pytest.raises(InvalidInput):
            verbs["save"]({"file": name, "material": COAT, "version": None})
    assert "1.5" in outside.read_text()


def test_a_texture_is_a_picture_and_overwrites_nothing(here: Path) -> None:
    verbs = Folder().verbs
    data = base64.b64encode(PIXEL).decode()
    assert verbs["texture"]({"file": "wood.png", "data": data}) == {"file": "wood.png"}
    assert verbs["texture"]({"file": "wood.png", "data": data}) == {"file": "wood.png"}
    (here / "wood.png").write_bytes(b"another")
    assert verbs["texture"]({"file": "wood.png", "data": data}) == {"file": "wood-2.png"}
    for name in ("text.png", "text.jpg", "text.exr", "text.hdr"):
        with pytest.raises(InvalidInput, match="no picture"):
            verbs["texture"]({"file": name, "data": base64.b64encode(b"not a picture").decode()})
    with pytest.raises(InvalidInput, match="base64"):
        verbs["texture"]({"file": "grain.png", "data": "!"})
    assert sorted(path.name for path in here.iterdir()) == ["wood-2.png", "wood.png"]


def test_what_cannot_be_written_leaves_nothing(here: Path) -> None:
    verbs, name = Folder().verbs, f"{'a' * 250}.yaml"
    version = verbs["save"]({"file": name, "material": COAT, "version": None})["version"]
    (here / name).chmod(0o444)
    before = (here / name).read_bytes()
    with pytest.raises(InvalidInput, match="cannot be written"):
        verbs["save"]({"file": name, "material": COAT, "version": version})
    assert [(path.name, path.read_bytes()) for path in here.iterdir()] == [(name, before)]


def test_a_file_of_the_folder_is_opened_to_be_saved_back(here: Path) -> None:
    (here / "coat.yaml").write_text(VERBS["write"]({"material": COAT})["text"])
    folder = Folder()
    first = folder.first("coat.yaml")
    assert (first["file"], first["version"]) == ("coat.yaml", folder.verbs["open"]({"file": "coat.yaml"})["version"])
    assert folder.first("coated-gold")["file"] is None
    with pytest.raises(InvalidInput, match="did you mean coated-gold"):
        folder.first("coated-gld")


# The page


def test_a_missing_page_is_told_with_what_builds_it(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundle, "STATIC", here)
    assert not bundle.finding().ok
    with pytest.raises(MissingTool, match="pip install"):
        bundle.require()
    for name in ("index.html", "editor.js", "widget.js"):
        (here / name).touch()
    assert bundle.require() == here
