"""Every way to write a material wrongly gets one line that names file, layer, key and what is allowed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
import yaml

from velatura.errors import InvalidInput, LawBroken, MissingTool, NoSolution, VelaturaError
from velatura.stack import Diffuse, Interface, Medium, Named, Stack, Texture, load, loads, preset, save

COAT = "layers:\n  - interface: {eta: 1.5}\n"


def one_layer(keys: str) -> str:
    return f"layers: [{{interface: {{{keys}}}}}]"


def doubled(times: int) -> str:
    """Lines that each name the one before eight times."""
    return "".join(f"a{i + 1}: &a{i + 1} [{', '.join([f'*a{i}'] * 8)}]\n" for i in range(times))


def over_diffuse(keys: str) -> str:
    return f"layers: [{{medium: {{{keys}}}}}, {{diffuse: {{}}}}]"


VALUES = {
    # Numbers
    one_layer("eta: 1.5, alpha: -0.1"): "layer 0 (interface): alpha: must lie in 0 to 1, got -0.1",
    one_layer("eta: 1.5, alpha: [0.1, 1.5]"): "layer 0 (interface): alpha: must lie in 0 to 1, got 1.5",
    one_layer("eta: 1.5, alpha: rough"): (
        "layer 0 (interface): alpha: must be a number, [u, v] or a texture, and lie in 0 to 1, got 'rough'"
    ),
    one_layer("eta: 1.5, alpha: [1, 2, 3]"): (
        "layer 0 (interface): alpha: must be a number, [u, v] or a texture, and lie in 0 to 1, got [1, 2, 3]"
    ),
    one_layer("eta: 1.5, alpha: true"): (
        "layer 0 (interface): alpha: must be a number, [u, v] or a texture, and lie in 0 to 1, got True"
    ),
    one_layer(
        "eta: 1.5, rotation: left"
    ): "layer 0 (interface): rotation: must be a number, a brushing or a texture, and lie in -1e9 to 1e9, got 'left'",
    one_layer("eta: 1.5, rotation: "): "layer 0 (interface): rotation: has no value",
    one_layer("eta: 0"): "layer 0 (interface): eta: must lie in 0.001 to 1e4, got 0",
    one_layer("eta: -1.5"): "layer 0 (interface): eta: must lie in 0.001 to 1e4, got -1.5",
    one_layer("eta: .nan"): "layer 0 (interface): eta: must be finite, got nan",
    one_layer("eta: [1.5, .inf, 1]"): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: [1.5, 1]"): (
        "layer 0 (interface): eta: must be a number, [r, g, b], a name, a page of refractiveindex.info, "
        "a spectrum or a texture, and lie in 0.001 to 1e4, got [1.5, 1]"
    ),
    one_layer(f"eta: 0x{'f' * 5000}"): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: 1, k: -1"): "layer 0 (interface): k: must lie in 0 to 1e4, got -1",
    over_diffuse("depth: -1"): "layer 0 (medium): depth: must lie in 0 to 1e9, got -1",
    over_diffuse("depth: [1, 2, 3]"): (
        "layer 0 (medium): depth: must be a number or a texture, and lie in 0 to 1e9, got [1, 2, 3]"
    ),
    over_diffuse("sigma_a: [1, -1, 2]"): "layer 0 (medium): sigma_a: must lie in 0 to 1e9, got -1",
    over_diffuse("g: 1"): "layer 0 (medium): g: must lie in -1 to 1, both excluded, got 1",
    over_diffuse("g: -0.999999999"): (
        "layer 0 (medium): g: must lie in -1 to 1, both excluded, got -0.999999999"  # in single precision it is -1
    ),
    "layers: [{diffuse: {albedo: 1.5}}]": "layer 0 (diffuse): albedo: must lie in 0 to 1, got 1.5",
    "exterior: 0\n" + COAT: "exterior: must lie in 0.001 to 1e4, got 0",
    "exterior: {texture: a.png}\n"
    + COAT: "exterior: must be a number, and lie in 0.001 to 1e4, got {'texture': 'a.png'}",
    one_layer("eta: 1.0e+39"): "layer 0 (interface): eta: must lie in 0.001 to 1e4, got 1e+39",
    one_layer("eta: 1e-4"): "layer 0 (interface): eta: must lie in 0.001 to 1e4, got 0.0001",
    one_layer("eta: 1.5, rotation: 2e9"): "layer 0 (interface): rotation: must lie in -1e9 to 1e9, got 2000000000.0",
    over_diffuse("depth: 1e300"): "layer 0 (medium): depth: must lie in 0 to 1e9, got 1e+300",
    # Names
    one_layer("eta: bk8"): "layer 0 (interface): eta: unknown name 'bk8' (did you mean bk7?)",
    one_layer("eta: Au"): "layer 0 (interface): eta: Au is a metal; write conductor: Au",
    one_layer("conductor: gould"): "layer 0 (interface): conductor: unknown metal 'gould' (did you mean gold?)",
    one_layer("conductor: au"): "layer 0 (interface): conductor: unknown metal 'au' (did you mean Au?)",
    one_layer("conductor: xyzzy"): (
        "layer 0 (interface): conductor: unknown metal 'xyzzy' (`velatura schema` lists all; or write eta and k)"
    ),
    one_layer("conductor: bk7"): "layer 0 (interface): conductor: bk7 is a dielectric; write eta: bk7",
    one_layer("conductor: 3"): "layer 0 (interface): conductor: must be the name of a metal, got 3",
    # What belongs together
    one_layer("alpha: 0.1"): "layer 0 (interface): eta: missing; write eta, or eta and k, or conductor",
    "layers: [{interface: }]": "layer 0 (interface): eta: missing; write eta, or eta and k, or conductor",
    one_layer("k: 1"): "layer 0 (interface): eta: missing; write eta, or eta and k, or conductor",
    one_layer("k: 1, conductor: Au"): (
        "layer 0 (interface): k: not together with conductor; write conductor, or eta and k"
    ),
    one_layer("eta: 1, conductor: Au"): (
        "layer 0 (interface): eta: not together with conductor; write conductor, or eta and k"
    ),
    # Keys
    one_layer("eta: 1.5, alhpa: 0.1"): "layer 0 (interface): unknown key 'alhpa' (did you mean alpha?)",
    one_layer("eta: 1.5, gloss: 1"): (
        "layer 0 (interface): unknown key 'gloss' (known: eta, k, conductor, alpha, rotation, films)"
    ),
    "nmae: x\n" + COAT: "unknown key 'nmae' (did you mean name?)",
    "1: x\n" + COAT: "unknown key '1' (known: name, source, exterior, thin, layers)",
    "name: 3\n" + COAT: "name: must be text (in quotes), got 3",
    "thin: 1\n" + COAT: "thin: must be true or false, got 1",
    # Textures
    one_layer("eta: 1.5, alpha: {textur: a.png}"): (
        "layer 0 (interface): alpha: unknown key 'textur' (did you mean texture?)"
    ),
    one_layer("eta: 1.5, alpha: {scale: 2}"): "layer 0 (interface): alpha: texture: missing",
    one_layer("eta: 1.5, alpha: {texture: 3}"): (
        "layer 0 (interface): alpha: texture: must be the path of a file, got 3"
    ),
    one_layer("eta: 1.5, alpha: {texture: here.png, channel: rgb}"): (
        "layer 0 (interface): alpha: channel: must be one of r, g, b, a for a single number, got 'rgb'"
    ),
    one_layer("eta: 1.5, alpha: {texture: here.png, channel: x}"): (
        "layer 0 (interface): alpha: channel: must be one of r, g, b, a, rgb, got 'x'"
    ),
    one_layer("eta: 1.5, alpha: {texture: here.png, encoding: gamma}"): (
        "layer 0 (interface): alpha: encoding: must be one of linear, srgb, got 'gamma'"
    ),
    # Layers
    "layers: []": "layers: must hold at least one layer",
    "layers:": "layers: has no value",
    "name: x": "layers: must hold at least one layer",
    "layers: 3": "layers: must be a list of layers, got 3",
    "layers: {diffuse: 1}": "layers: must be a list of layers, got {'diffuse': 1}",
    "layers: [interface]": "layer 0: must be one of interface, medium, diffuse with its keys, got 'interface'",
    "layers: [{}]": "layer 0: must be one of interface, medium, diffuse with its keys, got {}",
    "layers: [{interfaces: {eta: 1}}]": "layer 0: unknown layer 'interfaces' (did you mean interface?)",
    "layers: [{interface: 3}]": "layer 0 (interface): must hold keys and values, got 3",
    "layers:\n  - interface:\n    eta: 1.5": (
        "layer 0: must hold one of interface, medium, diffuse alone, got interface, eta; check the indent"
    ),
    COAT + "  - medium: {}": "layer 1 (medium): an interface or a diffuse base must lie below a medium",
    "layers: [{interface: {conductor: Au}}, {medium: {}}]": (
        "layer 1 (medium): nothing may lie below layer 0 (conductor), which is opaque"
    ),
    "layers: [{interface: {eta: 1.5, k: 0}}, {interface: {eta: 1.5}}]": (
        "layer 1 (interface): nothing may lie below layer 0 (conductor), which is opaque"
    ),
    "layers: [{interface: {conductor: mirror}}, {diffuse: {}}]": (
        "layer 1 (diffuse): nothing may lie below layer 0 (mirror), which is opaque"
    ),
    "layers: [{diffuse: {}}, {interface: {eta: 1.5}}]": (
        "layer 1 (interface): nothing may lie below layer 0 (diffuse), which is opaque"
    ),
    "thin: true\nlayers: [{diffuse: {}}]": "thin: only for a stack that ends in a dielectric interface",
    # The text itself
    "": "must hold the keys of a material, layers above all, got nothing",
    "- 1": "must hold the keys of a material, layers above all, got [1]",
    "layers: [": "line 1: is not valid YAML: expected the node content, but found '<stream end>'",
    "name: a: b\n" + COAT: "line 1: is not valid YAML: mapping values are not allowed here",
    COAT + "layers: []": "line 3: key 'layers' appears twice",
    "layers:\n  - interface:\n      eta: 1.5\n      eta: 1.6": "line 4: key 'eta' appears twice",
    "name: x\n---\nname: y": "line 2: is not valid YAML: but found another document",
    "name: \x00": "is not valid YAML: special characters are not allowed",
    "source: !!timestamp foo": "line 1: a value must have no tag, got 'tag:yaml.org,2002:timestamp'",
    "name: x\nthin: !!bool maybe": "line 2: a value must have no tag, got 'tag:yaml.org,2002:bool'",
    "layers: !!python/object/apply:os.system [ls]": (
        "line 1: a value must have no tag, got 'tag:yaml.org,2002:python/object/apply:os.system'"
    ),
    "layers: ! []": "line 1: a value must have no tag, got '!'",
    "layers: !x {}": "line 1: a value must have no tag, got '!x'",
    "? [1]\n: x": "line 1: is not valid YAML: found unhashable key",
    "name: &a [*a]\n" + COAT: "holds more than 100000 values once its aliases are written out",
    "a0: &a0 [1]\n" + doubled(12) + COAT: "holds more than 100000 values once its aliases are written out",
    "[" * 600: "is nested too deeply",
    # Numbers of any length, of which some would take quadratic time
    one_layer("eta: " + "9" * 5000): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: " + "9" * 5000 + ".5"): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: 0x" + "f" * 5000): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: " + "1:" * 500_000 + "1"): "layer 0 (interface): eta: must be finite, got inf",
    one_layer("eta: " + "1:" * 500_000 + "1.5"): "layer 0 (interface): eta: must be finite, got inf",
}


@pytest.mark.parametrize("text, message", VALUES.items(), ids=list(map(str, range(len(VALUES)))))
def test_a_wrong_file_gets_one_line(text: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here.png").touch()
    Path("coated.yaml").write_text(text)
    with pytest.raises(InvalidInput) as caught:
        load("coated.yaml")
    assert str(caught.value) == f"coated.yaml: {message}"


def test_a_layer_further_down_is_named_by_its_number() -> None:
    text = COAT + "  - medium: {}\n  - interface: {conductor: Au, alpha: -0.1}"
    with pytest.raises(InvalidInput) as caught:
        loads(text, name="coated.yaml")
    assert str(caught.value) == "coated.yaml: layer 2 (interface): alpha: must lie in 0 to 1, got -0.1"


@pytest.mark.parametrize(
    "text, message",
    [
        ('{"layers": 1, "layers": 2}', "key 'layers' appears twice"),
        ('{"layers":\n nix}', "line 2: is not valid JSON: Expecting value"),
        ('{"layers": [{"interface": {"eta": NaN}}]}', "layer 0 (interface): eta: must be finite, got nan"),
        ('{"name": "\\ud800", "layers": [{"diffuse": {}}]}', "name: must be text (in quotes), got '\\ud800'"),
        ("[" * 100_000, "is nested too deeply"),
        (
            '{"layers": [{"interface": {"eta": %s}}]}' % ("9" * 5000),
            "layer 0 (interface): eta: must be finite, got inf",
        ),
        (
            '{"layers": [{"interface": {"eta": -%s}}]}' % ("9" * 400),
            "layer 0 (interface): eta: must be finite, got -inf",
        ),
        ("[" + "1, " * 2_000_001 + "1]", "holds more than 2000000 values, with all that it is read with"),
    ],
)
def test_a_wrong_json_file_gets_one_line(text: str, message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        loads(text, name="m.json")
    assert str(caught.value) == f"m.json: {message}"


@pytest.mark.parametrize("name", ["loop.png", "x" * 5000 + ".png", "folder.png", "pipe.png", "a\0.png", "\ud800.png"])
def test_a_texture_that_is_no_file_gets_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.symlink("loop.png", "loop.png")
    os.mkfifo("pipe.png")
    Path("folder.png").mkdir()
    with pytest.raises(InvalidInput, match=r"^m\.json: layer 0 .*: texture: ") as caught:
        loads(json.dumps({"layers": [{"interface": {"eta": 1.5, "alpha": {"texture": name}}}]}), name="m.json")
    assert "\n" not in str(caught.value)


def test_a_missing_texture_is_named(tmp_path: Path) -> None:
    material = tmp_path / "m.yaml"
    material.write_text(one_layer("eta: 1.5, alpha: {texture: maps/no.png}"))
    with pytest.raises(InvalidInput) as caught:
        load(material)
    path = tmp_path.resolve() / "maps" / "no.png"
    assert str(caught.value) == f"{material}: layer 0 (interface): alpha: texture: file not found: {path}"


@pytest.mark.parametrize(
    "path, message",
    [
        ("none.yaml", "none.yaml: file not found"),
        ("folder", "folder: is a folder, not a material file"),
        ("folder.yaml", "folder.yaml: is a folder, not a material file"),
        ("latin.yaml", "latin.yaml: is not UTF-8 text (byte 6)"),
        (
            "notes.txt",
            "notes.txt: a material file ends in .yaml, .yml, .json, .mtlx, .gltf, .glb, .xml, .usda, .usd, .usdc",
        ),
        (
            "coated-gild",
            "unknown preset 'coated-gild' (did you mean coated-gold?); a material file ends in .yaml, .yml, .json, "
            ".mtlx, .gltf, .glb, .xml, .usda, .usd, .usdc",
        ),
        ("x\0.yaml", "x\\x00.yaml: cannot be read: embedded null byte"),
        ("x" * 300 + ".yaml", "x" * 300 + ".yaml: cannot be read: file name too long"),
    ],
)
def test_a_path_that_is_no_material_gets_one_line(
    path: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("folder.yaml").mkdir()
    Path("latin.yaml").write_bytes("name: \xe9\n".encode("latin-1"))
    with pytest.raises(InvalidInput) as caught:
        load(path)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "path, message",
    [
        ("none/m.yaml", "none/m.yaml: there is no folder none"),
        ("m.txt", "m.txt: a material file ends in .yaml, .yml, .json"),
        ("folder.yaml", "folder.yaml: cannot be written: is a directory"),
        ("x" * 300 + ".yaml", "x" * 300 + ".yaml: cannot be written: file name too long"),
    ],
)
def test_a_path_that_cannot_be_written_gets_one_line(
    path: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder.yaml").mkdir()
    with pytest.raises(InvalidInput) as caught:
        save(preset("furnace"), path)
    assert str(caught.value) == message
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder.yaml"]


@pytest.mark.parametrize(
    "values, message",
    [
        (
            {"layer0_etta": 1},
            "layer0_etta: layer 0 (dielectric) has no etta, only eta, alpha, alpha_u, alpha_v, rotation, films",
        ),
        (
            {"layer0_k": 1},
            "layer0_k: layer 0 (dielectric) has no k, only eta, alpha, alpha_u, alpha_v, rotation, films",
        ),
        (
            {"layer1_eta": 1},
            "layer1_eta: layer 1 (medium) has no eta, only depth, sigma_a, sigma_s, g, phase, pigments",
        ),
        ({"layer3_eta": 1}, "layer3_eta: the last layer is layer 2"),
        ({"layer_0_eta": 1}, "unknown parameter 'layer_0_eta' (did you mean layer0_eta?)"),
        ({"exteror": 1}, "unknown parameter 'exteror' (did you mean exterior?)"),
        ({"layer0_alpha": -1}, "layer 0 (interface): alpha: must lie in 0 to 1, got -1"),
        ({"layer0_alpha_v": 2}, "layer 0 (interface): alpha: must lie in 0 to 1, got 2"),
        ({"layer2_conductor": "Gold"}, "layer 2 (interface): conductor: unknown metal 'Gold' (did you mean gold?)"),
        (
            {"layer2_eta": Named("Au", "k")},
            "layer 2 (interface): eta: must be a number, [r, g, b], a name, a page of refractiveindex.info, "
            "a spectrum or a texture, and lie in 0.001 to 1e4, got Named(name='Au', part='k')",
        ),
        ({"thin": True}, "thin: only for a stack that ends in a dielectric interface"),
    ],
)
def test_a_wrong_change_gets_one_line(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        preset("coated-gold").replace(**values)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "kinds, values, message",
    [
        (None, {}, "layers: must hold at least one layer"),
        (None, {"layer1_eta": 1.5}, "layer 0: no value is given, but there are values of layer 1"),
        (None, {"layer0_alpha": 0.1}, "layer 0 (interface): eta: missing; write eta, or eta and k, or conductor"),
        (
            None,
            {"layer0_eta": 1.5, "layer0_alpha_u": 0.1},
            "layer 0: alpha_u and alpha_v only together; alpha is for both",
        ),
        (
            None,
            {"layer0_eta": 1.5, "layer0_depth": 1},
            "layer0_depth: layer 0 (dielectric) has no depth, only eta, alpha, alpha_u, alpha_v, rotation, films",
        ),
        (["conductor"], {"layer0_eta": 1.5}, "layer 0: the values are those of a dielectric, not of a conductor"),
        (["dielectric"], {"layer0_eta": 1.5, "layer1_eta": 1}, "layer1_eta: the last layer is layer 0"),
        (["metal"], {}, "unknown kind of layer 'metal' (known: dielectric, conductor, mirror, medium, diffuse)"),
    ],
)
def test_wrong_flat_values_get_one_line(kinds: Any, values: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        Stack.from_flat(kinds, values)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "model, fields, message",
    [
        (Interface, {"eta": 1.5, "alpha": 2}, "alpha: must lie in 0 to 1, got 2"),
        (Interface, {"ior": 1.5}, "unknown key 'ior' (known: eta, k, conductor, alpha, rotation, films)"),
        (
            Medium,
            {"g": "forward"},
            "g: must be a number or a texture, and lie in -1 to 1, both excluded, got 'forward'",
        ),
        (Diffuse, {"albedo": -1}, "albedo: must lie in 0 to 1, got -1"),
        (Texture, {"scale": 1}, "texture: missing"),
        (Stack, {"layers": []}, "layers: must hold at least one layer"),
        (Stack, {"layers": [Medium()]}, "layer 0 (medium): an interface or a diffuse base must lie below a medium"),
    ],
)
def test_models_built_in_python_say_the_same(model: Any, fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        model(**fields)
    assert str(caught.value) == message


def test_errors_carry_their_exit_status() -> None:
    statuses = {VelaturaError: 1, InvalidInput: 2, NoSolution: 3, LawBroken: 1, MissingTool: 1}
    assert {error: error.exit_status for error in statuses} == statuses
    assert issubclass(InvalidInput, ValueError)


def test_values_are_counted_while_they_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: a refusal although the text goes on, and is no YAML there."""
    monkeypatch.setattr("velatura.stack.text._MOST", 10)
    with pytest.raises(InvalidInput, match=r"^material\.yaml: holds more than 10 values$"):
        loads("[" + "1, " * 20 + "{{{")


def test_messages_have_an_end(tmp_path: Path) -> None:
    """Expected: the beginning, which names the file and the key, and the end of a name of 5,000 letters."""
    path = tmp_path / "a.yaml"
    path.write_text(one_layer(f"eta: 1.5, alpha: {{texture: {'n' * 5000}.png}}"))
    with pytest.raises(InvalidInput) as caught:
        load(path)
    message = str(caught.value)
    assert len(message) == 2000 and "nnn...nnn" in message and message.endswith("nnn.png")
    assert message.startswith(f"{path}: layer 0 (interface): alpha: texture: ")


def test_what_a_file_would_hold_is_a_material(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: the stack of the file; paths are relative to the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("wood.png").touch()
    text = one_layer("eta: 1.5, alpha: {texture: wood.png}")
    assert load(json.loads(json.dumps(yaml.safe_load(text)))) == loads(text)
    with pytest.raises(InvalidInput, match=r"^layer 0 \(interface\): alpha: must lie in 0 to 1, got 2$"):
        load({"layers": [{"interface": {"eta": 1.5, "alpha": 2}}]})
    endless: dict[str, Any] = {"layers": []}
    endless["layers"].append(endless)
    with pytest.raises(InvalidInput, match=r"^layer 0: unknown layer 'layers'"):
        load(endless)
