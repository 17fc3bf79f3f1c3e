"""Stacks as models: what they hold, their files, and their flat names."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import velatura.stack.io as stack_io
from velatura.errors import InvalidInput
from velatura.stack import (
    Diffuse,
    Interface,
    Medium,
    Named,
    Spectrum,
    Stack,
    Substance,
    Texture,
    dumps,
    json_schema,
    load,
    loads,
    names,
    parameter_table,
    preset,
    presets,
    save,
    substances,
)

COATED_GOLD = """
name: Coated brushed gold
layers:
  - interface: {eta: 1.5, alpha: 0.05}
  - medium: {depth: 1.0, sigma_a: [0.1, 0.5, 2.0]}
  - interface: {conductor: Au, alpha: [0.1, 0.3], rotation: 30}
"""


# What it holds -------------------------------------------------------------------------------------------------------


def test_a_file_is_the_stack_that_python_builds() -> None:
    built = Stack(
        [
            Interface(eta=1.5, alpha=0.05),
            Medium(depth=1, sigma_a=(0.1, 0.5, 2.0)),
            Interface(conductor="Au", alpha=(0.1, 0.3), rotation=30),
        ],
        name="Coated brushed gold",
    )
    assert loads(COATED_GOLD) == built
    assert built.kinds == ("dielectric", "medium", "conductor")
    assert built.interfaces == (built.layers[0], built.layers[2])
    assert not built.transmits
    assert not built.thin
    assert built.exterior == 1.0


def test_stacks_are_frozen_and_hashable() -> None:
    stack = loads(COATED_GOLD)
    with pytest.raises(InvalidInput, match=r"^\w+: a \w+ is never changed; make another one with that value$"):
        stack.name = "other"
    assert hash(stack) == hash(loads(COATED_GOLD))


@pytest.mark.parametrize(
    "interface, kind, opaque",
    [
        (Interface(eta=1.5), "dielectric", False),
        (Interface(eta="bk7"), "dielectric", False),
        (Interface(eta=0.2, k=3.9), "conductor", True),
        (Interface(eta=1.5, k=0), "conductor", True),
        (Interface(conductor="gold"), "conductor", True),
        (Interface(conductor="mirror"), "mirror", True),
    ],
)
def test_k_or_conductor_makes_an_interface_opaque(interface: Interface, kind: str, opaque: bool) -> None:
    assert (interface.kind, interface.opaque) == (kind, opaque)
    assert Stack([interface]).transmits is not opaque


def test_numbers_come_in_any_type_and_leave_as_floats() -> None:
    fields = {"eta": np.float32(1.5), "k": np.array([1, 2, 3]), "alpha": [np.float64(0.25), 0]}
    assert Interface(**fields) == Interface(eta=1.5, k=(1.0, 2.0, 3.0), alpha=(0.25, 0.0))
    assert Interface(eta=1.5, alpha=(0.1, 0.1)) == Interface(eta=1.5, alpha=0.1)


def test_layers_may_be_mappings() -> None:
    assert Stack([{"interface": {"eta": 1.5}}, {"diffuse": None}]) == Stack([Interface(eta=1.5), Diffuse()])


def test_a_medium_may_lie_on_top() -> None:
    assert Stack([Medium(sigma_s=1), Interface(conductor="Au")]).kinds == ("medium", "conductor")


# Flat names ----------------------------------------------------------------------------------------------------------


def test_flat_names() -> None:
    assert loads(COATED_GOLD).flat() == {
        "exterior": 1.0,
        "layer0_eta": 1.5,
        "layer0_alpha_u": 0.05,
        "layer0_alpha_v": 0.05,
        "layer0_rotation": 0.0,
        "layer1_depth": 1.0,
        "layer1_sigma_a": (0.1, 0.5, 2.0),
        "layer1_sigma_s": 0.0,
        "layer1_g": 0.0,
        "layer2_eta": Named("Au", "eta"),
        "layer2_k": Named("Au", "k"),
        "layer2_alpha_u": 0.1,
        "layer2_alpha_v": 0.3,
        "layer2_rotation": 30.0,
    }
    mirror = Stack([Interface(conductor="mirror")])
    assert set(mirror.flat()) == {"exterior", "layer0_alpha_u", "layer0_alpha_v", "layer0_rotation"}
    assert Stack([Diffuse(albedo=(0.1, 0.2, 0.3))]).flat()["layer0_albedo"] == (0.1, 0.2, 0.3)


def test_kinds_are_read_off_flat_names() -> None:
    values = {
        "layer0_eta": 1.5,
        "layer0_alpha": 0.1,
        "layer1_sigma_a": [1, 2, 3],
        "layer2_conductor": "mirror",
        "exterior": 1.33,
        "name": "x",
    }
    assert Stack.from_flat(None, values) == Stack(
        [Interface(eta=1.5, alpha=0.1), Medium(sigma_a=(1, 2, 3)), Interface(conductor="mirror")],
        exterior=1.33,
        name="x",
    )
    assert Stack.from_flat(None, {"layer0_eta": 0.2, "layer0_k": 3}).kinds == ("conductor",)
    assert Stack.from_flat(None, {"layer0_eta": 1.5, "layer1_albedo": 0.2}).kinds == ("dielectric", "diffuse")


def test_replace_changes_only_what_is_named() -> None:
    stack = loads(COATED_GOLD)
    changed = stack.replace(layer0_alpha=0.2, layer1_sigma_a=(0.1, 0.2, 0.3), layer2_alpha_v=0.5, exterior=1.33)
    expected = {
        **stack.flat(),
        "layer0_alpha_u": 0.2,
        "layer0_alpha_v": 0.2,
        "layer1_sigma_a": (0.1, 0.2, 0.3),
        "layer2_alpha_v": 0.5,
        "exterior": 1.33,
    }
    assert changed.flat() == expected
    assert changed.name == stack.name
    assert stack.replace() == stack


def test_replace_swaps_metals_and_parts_of_metals() -> None:
    stack = loads(COATED_GOLD)
    copper = stack.replace(layer2_conductor="Cu")
    assert copper.interfaces[1] == Interface(conductor="Cu", alpha=(0.1, 0.3), rotation=30)
    mixed = stack.replace(layer2_eta=0.2)
    assert mixed.flat()["layer2_eta"] == 0.2
    assert mixed.flat()["layer2_k"] == Named("Au", "k")
    assert loads(dumps(mixed)) == mixed
    assert mixed.replace(layer2_eta=Named("Au", "eta")) == stack
    assert mixed.replace(layer2_conductor="mirror").kinds[-1] == "mirror"


# Textures ------------------------------------------------------------------------------------------------------------


def test_textures_are_relative_to_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("materials", "maps"):
        (tmp_path / folder).mkdir()
    image = tmp_path / "maps" / "scratches.png"
    image.touch()
    (tmp_path / "materials" / "m.yaml").write_text(
        "layers:\n"
        "  - interface: {eta: 1.5, alpha: {texture: ../maps/scratches.png, channel: g, scale: 0.5}}\n"
        "  - medium: {sigma_a: {texture: ../maps/scratches.png, encoding: srgb}}\n"
        "  - interface: {conductor: Au, alpha: [{texture: ../maps/scratches.png}, 0.2]}\n"
    )
    monkeypatch.chdir(tmp_path)
    stack = load("materials/m.yaml")

    # Absolute in memory, with the channel that the parameter needs
    values = stack.flat()
    roughness = Texture(texture=image, channel="g", scale=0.5)
    assert values["layer0_alpha_u"] == values["layer0_alpha_v"] == roughness
    assert values["layer1_sigma_a"] == Texture(texture=image, channel="rgb", encoding="srgb")
    assert stack.interfaces[1].alpha == (Texture(texture=image, channel="r"), 0.2)

    # Relative again in the files
    save(stack, "materials/again.yaml")
    save(stack, "beside.json")
    assert "texture: ../maps/scratches.png" in Path("materials/again.yaml").read_text()
    assert '"texture": "maps/scratches.png"' in Path("beside.json").read_text()
    assert load("materials/again.yaml") == load("beside.json") == stack
    assert loads(dumps(stack)) == stack
    assert Stack.from_flat(stack.kinds, stack.flat()) == stack


@pytest.mark.parametrize("axes", ["uv", "vu"])
def test_one_axis_is_changed_and_the_other_kept(axes: str) -> None:
    changed, kept = (f"layer0_alpha_{axis}" for axis in axes)
    brushed = Stack([Interface(conductor="Au", alpha=(0.1, 0.3))])
    values = brushed.replace(**{changed: 0.5}).flat()
    assert (values[changed], values[kept]) == (0.5, brushed.flat()[kept])


# Files ---------------------------------------------------------------------------------------------------------------


def test_yaml_is_written_as_one_would_write_it() -> None:
    assert dumps(loads(COATED_GOLD)) == (
        "name: Coated brushed gold\n"
        "layers:\n"
        "- interface: {eta: 1.5, alpha: 0.05}\n"
        "- medium: {sigma_a: [0.1, 0.5, 2.0]}\n"
        "- interface: {conductor: Au, alpha: [0.1, 0.3], rotation: 30.0}\n"
    )


def test_exponents_are_numbers_as_in_yaml_1_2() -> None:
    stack = loads("layers: [{medium: {sigma_a: [1e-3, 2.5E2, .5e1]}}, {diffuse: {}}]")
    assert stack.flat()["layer0_sigma_a"] == (1e-3, 250.0, 5.0)
    for name in ("1e5", "1e5 nits", "no", "2020-01-01"):
        assert loads(dumps(Stack([Diffuse()], name=name))).name == name
    assert loads("name: 1e5 nits\nlayers: [{diffuse: {}}]").name == "1e5 nits"


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_bytes(b"\xef\xbb\xbflayers: [{diffuse: {}}]")
    assert load(tmp_path / "m.yaml") == Stack([Diffuse()])


def test_an_unknown_format_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"^unknown format 'yml' \(did you mean yaml\?\)$"):
        dumps(preset("furnace"), "yml")


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.yaml"
    path.write_text("old")

    def fail(*_: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(stack_io.os, "replace", fail)
    with pytest.raises(InvalidInput) as caught:
        save(preset("furnace"), path)
    assert str(caught.value) == f"{path}: cannot be written: permission denied"
    assert os.listdir(tmp_path) == ["m.yaml"]
    assert path.read_text() == "old"


@pytest.mark.parametrize(("given", "kept"), [(1e9, 280.0), (-750, -30.0), (360, 0.0), (-30.5, -30.5)])
def test_an_angle_is_kept_within_a_turn(given: float, kept: float, tmp_path: Path) -> None:
    """Rationale: in single precision 1e9 degrees are 64 apart from the next number."""
    (tmp_path / "a.png").touch()
    turned = {"texture": str(tmp_path / "a.png"), "offset": given}
    brushed = {"brushing": "radial", "offset": given}
    stack = Stack([{"interface": {"eta": 1.5, "rotation": each}} for each in (given, turned, brushed)])
    plain, image, field = (interface.rotation for interface in stack.interfaces)
    assert [plain, image.offset, field.offset] == [kept] * 3  # type: ignore[union-attr]


finite = st.floats(-1e9, 1e9)
indices = st.floats(1e-3, 1e4)
extinctions = st.floats(0, 1e4)
not_negative = st.floats(0, 1e9)
unit = st.floats(0, 1)


def colours(numbers: st.SearchStrategy[float]) -> st.SearchStrategy[Any]:
    return numbers | st.tuples(numbers, numbers, numbers)


@st.composite
def stacks(draw: st.DrawFn, image: Path, table: Path) -> Stack:
    channels = st.sampled_from("rgba")
    textures = st.builds(
        Texture, texture=st.just(image), channel=channels, scale=finite, offset=finite, encoding=st.just("srgb")
    )
    spectra = st.builds(Spectrum, spectrum=st.just(table))
    metals, dielectrics = (st.sampled_from(group) for group in names())
    surface = {"alpha": unit | st.tuples(unit | textures, unit) | textures, "rotation": finite | textures}
    pages = st.builds(Substance, refractiveindex=st.sampled_from(substances.names()))
    glasses, opaque = pages.filter(lambda page: not page.opaque), pages.filter(lambda page: page.opaque)
    dielectric = st.builds(Interface, eta=colours(indices) | dielectrics | spectra | glasses | textures, **surface)
    conductor = st.builds(Interface, eta=colours(indices), k=colours(extinctions) | opaque | textures, **surface)
    conductor |= st.builds(Interface, eta=opaque, **surface)
    named = st.builds(Interface, conductor=metals | st.just("mirror"), **surface)
    medium = st.builds(
        Medium,
        depth=not_negative | textures,
        sigma_a=colours(not_negative) | spectra | textures,
        sigma_s=colours(not_negative),
        g=st.floats(-1, 1, exclude_min=True, exclude_max=True, width=32),
    )
    diffuse = st.builds(Diffuse, albedo=colours(unit) | textures)

    layers: list[Any] = []
    for _ in range(draw(st.integers(0, 3))):
        layers += [draw(medium)] * draw(st.booleans()) + [draw(dielectric)]
    layers += [draw(medium)] * draw(st.booleans()) + [draw(dielectric | conductor | named | diffuse)]
    line = st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"], exclude_characters="\ufffe\uffff")
    transmits = layers[-1].kind == "dielectric"
    name, source = draw(st.text(line)), draw(st.text(line | st.sampled_from("\n\t")))
    return Stack(layers, name=name, source=source, exterior=draw(indices), thin=transmits and draw(st.booleans()))


@settings(max_examples=30, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_files_and_flat_names_give_the_same_stack_back(data: st.DataObject, tmp_path_factory: Any) -> None:
    image = tmp_path_factory.getbasetemp() / "image.png"
    image.touch()
    table = image.with_name("table.spd")
    table.write_text("400 1.5\n700 1.6\n")
    stack = data.draw(stacks(image, table))
    assert loads(dumps(stack)) == stack
    assert loads(dumps(stack, "json"), name="m.json") == stack
    options = {"name": stack.name, "source": stack.source, "thin": stack.thin}
    assert Stack.from_flat(stack.kinds, {**stack.flat(), **options}) == stack
    assert stack.replace(**stack.flat()) == stack
    if "mirror" not in stack.kinds:
        assert Stack.from_flat(None, {**stack.flat(), **options}) == stack


# Presets -------------------------------------------------------------------------------------------------------------


def test_there_are_presets() -> None:
    wanted = {
        "coated-gold",
        "frosted-metal",
        "furnace",
        "furnace-rough",
        "tinted-varnish-on-copper",
        "coloured-absorbing-coat",
        "three-dielectrics-over-metal",
        "scattering-medium-over-gold",
    }
    assert wanted <= set(presets())
    assert len(presets()) >= 18


@pytest.mark.parametrize("name", presets())
def test_a_preset_has_a_name_and_a_source_and_survives_files(name: str, tmp_path: Path) -> None:
    stack = load(name)
    assert stack == preset(name)
    assert stack.name
    assert stack.source
    assert "\n" not in stack.source
    for extension in ("yaml", "json"):
        save(stack, tmp_path / f"m.{extension}")
        assert load(tmp_path / f"m.{extension}") == stack


def test_the_numbers_of_the_papers() -> None:
    # Belcour 2018, figures 13, 12 and 14
    assert preset("frosted-metal").layers == (
        Interface(eta=1.49, alpha=0.1),
        Interface(eta=1, k=(1, 0.1, 0.1), alpha=0.001),
    )
    furnace = preset("furnace")
    assert [layer.eta for layer in furnace.interfaces[:5]] == [1.3, 1.0, 1.3, 1.0, 1.3]
    assert furnace.kinds[5] == "mirror"
    assert furnace.replace(**{f"layer{i}_alpha": 0.1 for i in range(5)}).layers == preset("furnace-rough").layers
    medium = preset("scattering-medium-over-gold").layers[0]
    assert isinstance(medium, Medium)
    assert (medium.g, medium.sigma_a, medium.sigma_s) == (0.7, 0.0, 1.0)


# The declarations ----------------------------------------------------------------------------------------------------


def test_the_schema_knows_every_key_and_range() -> None:
    schema = json_schema()
    stack = schema["$defs"]["stack"]
    layers = {
        entry: keys["properties"]
        for option in stack["properties"]["layers"]["items"]["oneOf"]
        for entry, keys in option["properties"].items()
    }
    assert {entry: set(keys) for entry, keys in layers.items()} == {
        "interface": {"eta", "k", "conductor", "alpha", "rotation", "films"},
        "medium": {"depth", "sigma_a", "sigma_s", "g", "phase", "pigments"},
        "diffuse": {"albedo"},
    }
    assert set(stack["properties"]) == {"name", "source", "exterior", "thin", "layers"}
    assert layers["interface"]["alpha"]["anyOf"][0] == {"type": "number", "minimum": 0, "maximum": 1}
    assert layers["interface"]["eta"]["anyOf"][0] == {"type": "number", "minimum": 1e-3, "maximum": 1e4}
    assert layers["medium"]["g"]["anyOf"][0] == {"type": "number", "exclusiveMinimum": -1, "exclusiveMaximum": 1}
    assert layers["medium"]["depth"]["anyOf"][0] == {"type": "number", "minimum": 0, "maximum": 1e9}
    assert layers["interface"]["rotation"]["anyOf"][0] == {"type": "number", "minimum": -1e9, "maximum": 1e9}
    assert {"$ref": "#/$defs/texture"} in layers["medium"]["sigma_a"]["anyOf"]
    assert {"$ref": "#/$defs/spectrum"} in layers["medium"]["sigma_a"]["anyOf"]
    assert {"$ref": "#/$defs/spectrum"} not in layers["medium"]["depth"]["anyOf"]
    assert schema["$defs"]["spectrum"]["required"] == ["spectrum"]
    assert "mirror" in layers["interface"]["conductor"]["enum"]
    assert schema["$defs"]["texture"]["required"] == ["texture"]
    assert schema["$defs"]["film"]["required"] == ["eta", "thickness_nm"]
    assert layers["interface"]["films"]["items"] == {"$ref": "#/$defs/film"}
    json.dumps(schema)


def test_the_table_has_a_row_for_every_key() -> None:
    table = parameter_table()
    rows = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in table.splitlines()]
    assert all(len(row) == len(rows[0]) for row in rows)
    assert ["interface", "`alpha`", "a number, [u, v]", "", "[0, 1]", "0", "yes", "yes"] in [row[:8] for row in rows]
    keys = {(row[0], row[1].strip("`")) for row in rows[2:]}
    assert len(keys) == len(rows) - 2
    assert {("material", "exterior"), ("medium", "g"), ("diffuse", "albedo"), ("texture", "encoding")} <= keys


def test_presets_are_plain_yaml() -> None:
    stacks = presets(mixtures=False)
    for name in presets():
        fields = yaml.safe_load((Path(str(stack_io._PRESETS)) / f"{name}.yaml").read_text())
        assert set(fields) <= {"name", "source", "exterior", "thin", "layers" if name in stacks else "mix"}


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = (
        "import sys, velatura.stack as s; s.preset('coated-gold').flat(); "
        "print([m for m in ('mitsuba', 'drjit', 'numpy', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={"PYTHONPATH": path_()})
    assert result.stdout == "[]\n", result.stderr


def path_() -> str:
    return os.pathsep.join(entry for entry in sys.path if entry)
