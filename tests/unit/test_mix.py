"""Mixtures as they are described: files, flat names, weights, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import velatura as vt
from velatura.stack import Part, addressed, dumps, json_schema, loads, single
from velatura.stack.mix import DEEPEST, MOST

GOLD = "bare-gold"  # a preset
PAINT = vt.Stack([vt.Interface(eta=1.5, alpha=0.1), vt.Diffuse(albedo=[0.5, 0.1, 0.1])], name="paint")
METAL = vt.Stack([vt.Interface(conductor="Al", alpha=[0.1, 0.3])])
WORN = vt.Mix([(0.7, PAINT), (None, METAL)], name="Worn paint", source="chosen by eye")
DUSTY = vt.Mix([(0.2, vt.Stack([vt.Diffuse(albedo=0.4)])), (0.1, "bare-gold"), (None, WORN)])


@pytest.mark.parametrize("mix", [WORN, DUSTY], ids=["one", "nested"])
@pytest.mark.parametrize("format", ["yaml", "json"])
def test_a_mixture_reads_back_what_it_writes(mix: vt.Mix, format: str, tmp_path: Path) -> None:
    assert vt.Mix.from_dict(mix.to_dict()) == mix
    assert loads(dumps(mix, format), f"mix.{format}") == mix
    vt.save(mix, tmp_path / f"mix.{format}")
    assert vt.load(tmp_path / f"mix.{format}") == mix
    assert vt.Mix.from_flat({**mix.flat(), "name": mix.name, "source": mix.source}) == _renamed(mix)


def _renamed(mix: vt.Mix) -> vt.Mix:
    """The mixture without names of its parts, which flat values do not hold."""

    def bare(material: Any) -> Any:
        if isinstance(material, vt.Mix):
            return vt.Mix(
                [
                    Part(**{**dict(part), "material": bare(part.material)})
                    if part.weight is not None
                    else Part(material=bare(part.material))
                    for part in material.mix
                ]
            )
        return material.replace(name="", source="")

    return bare(mix).replace(name=mix.name, source=mix.source)


def test_a_file_names_its_parts_by_presets_and_by_paths_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "parts"
    folder.mkdir()
    vt.save(METAL, folder / "metal.yaml")
    inner = {"mix": [{"weight": 0.25, "material": "metal.yaml"}, {"material": "bare-gold"}]}
    (folder / "inner.yaml").write_text(yaml.dump(inner))
    outer = {"mix": [{"weight": 0.5, "material": "parts/inner.yaml"}, {"material": PAINT.to_dict()}]}
    (tmp_path / "outer.yaml").write_text(yaml.dump(outer))
    mix = vt.load(tmp_path / "outer.yaml")
    assert [stack for _, stack in mix.leaves()] == [METAL, vt.preset("bare-gold"), PAINT]
    assert [share for share, _ in mix.weighted("")] == [0.125, 0.375, 0.5]


def test_the_last_weight_is_what_the_others_leave() -> None:
    thirds = vt.Mix([(1 / 3, PAINT), (1 / 3, METAL), (1 / 3, PAINT)])
    assert thirds == vt.Mix([(1 / 3, PAINT), (1 / 3, METAL), (None, PAINT)])
    assert thirds.mix[-1].weight is None
    assert [share for share, _ in thirds.weighted("")] == pytest.approx([1 / 3] * 3, abs=1e-12)
    assert [share for share, _ in vt.Mix([(1, PAINT), (0, METAL)]).weighted("")] == [1.0, 0.0]
    assert [share for share, _ in vt.Mix([(None, PAINT)]).weighted("")] == [1.0]


def test_weights_beyond_one_are_divided_by_their_sum() -> None:
    mix = vt.Mix([(0.0, PAINT), (0.0, METAL), (None, PAINT)])
    weights = {"part0_weight": np.array([0.75, 0.3]), "part1_weight": np.array([0.75, 0.3])}
    assert np.allclose(mix.shares(weights), [[0.5, 0.3], [0.5, 0.3], [0.0, 0.4]])


def test_flat_names_reach_every_value() -> None:
    flat = DUSTY.flat()
    assert flat["part0_weight"] == 0.2 and flat["part2_part0_weight"] == 0.7
    assert "part2_weight" not in flat and "part2_part1_weight" not in flat
    assert flat["part2_part1_layer0_alpha_v"] == 0.3
    changed = DUSTY.replace(part0_weight=0.4, part2_part0_layer0_alpha=0.25, name="Dusty")
    assert changed.flat()["part0_weight"] == 0.4
    assert changed.flat()["part2_part0_layer0_alpha_u"] == changed.flat()["part2_part0_layer0_alpha_v"] == 0.25
    assert (changed.name, DUSTY.name) == ("Dusty", "")
    for name in flat:
        assert [address.name for address in addressed(name)] == [name]
    assert [address.name for address in addressed("part1_layer0_alpha")] == [
        "part1_layer0_alpha_u",
        "part1_layer0_alpha_v",
    ]
    assert addressed("part0_xyzzy") == ()


def test_a_texture_weighs_a_part(tmp_path: Path) -> None:
    picture = tmp_path / "mask.png"
    picture.write_bytes(b"\x89PNG")
    (tmp_path / "worn.yaml").write_text(
        "mix:\n- weight: {texture: mask.png}\n  material: bare-gold\n- material: coated-gold\n", encoding="utf-8"
    )
    mix = vt.load(tmp_path / "worn.yaml")
    assert isinstance(mix, vt.Mix) and mix.mix[0].weight == vt.Texture(texture=picture, channel="r")
    with pytest.raises(vt.InvalidInput, match=r"^part0_weight: is a texture, and lobes are of one point$"):
        mix.weighted("lobes are of one point")
    (tmp_path / "copies").mkdir()
    vt.save(mix, tmp_path / "copies" / "worn.yaml")
    assert "texture: ../mask.png" in (tmp_path / "copies" / "worn.yaml").read_text()
    assert vt.load(tmp_path / "copies" / "worn.yaml") == mix


REFUSED: dict[str, tuple[Any, str]] = {
    "no parts": ([], "mix: must hold at least one part"),
    "no list": (GOLD, "mix: must be a list of parts, got 'bare-gold'"),
    "unknown key": (
        [{"wieght": 0.5, "material": GOLD}],
        "mix: part 0: unknown key 'wieght' (did you mean weight?)",
    ),
    "no material": ([{"weight": 0.5}, {"material": GOLD}], "mix: part 0: material: missing"),
    "another type": (
        [(0.5, 3), (None, GOLD)],
        "mix: part 0: material: must be a material: its keys, a file, or the name of a preset, got 3",
    ),
    "below 0": ([(-0.1, GOLD), (None, GOLD)], "mix: part 0: weight: must lie in 0 to 1, got -0.1"),
    "no weight": (
        [(None, GOLD), (None, GOLD)],
        "mix: part 0: weight: missing, which only the last part may leave out",
    ),
    "too little": (
        [(0.2, GOLD), (0.7, GOLD)],
        "mix: weights must sum to 1, got 0.9; or leave out the last one",
    ),
    "too much": (
        [(0.8, GOLD), (0.7, GOLD), (None, GOLD)],
        "mix: weights must sum to 1 at most, got 1.5",
    ),
    "a layer": (
        [(0.5, {"layers": [{"interface": {"eta": -1}}]}), (None, GOLD)],
        "mix: part 0: material: layer 0 (interface): eta: must lie in 0.001 to 1e4, got -1",
    ),
    "within": (
        [(0.5, GOLD), (None, {"mix": [(1.5, GOLD), (None, GOLD)]})],
        "mix: part 1: material: mix: part 0: weight: must lie in 0 to 1, got 1.5",
    ),
    "exteriors": (
        [(0.5, PAINT), (None, PAINT.replace(exterior=1.33))],
        "part 1: exterior: must be that of all parts, 1, got 1.33",
    ),
    "many": (
        [(0, GOLD)] * MOST + [(None, GOLD)],
        f"mix: must hold at most {MOST} stacks, got {MOST + 1}",
    ),
    "a hostile name": (
        [(0.5, "no\nsuch\x1b[31m"), (None, GOLD)],
        "mix: part 0: material: unknown preset 'no\\nsuch\\x1b[31m' (`velatura presets`",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_mixture_is_refused_in_one_line(case: str) -> None:
    parts, line = REFUSED[case]
    with pytest.raises(vt.InvalidInput) as caught:
        vt.Mix(parts)
    message = str(caught.value)
    assert "\n" not in message and (message == line or (case == "a hostile name" and message.startswith(line)))


def test_a_texture_leaves_the_last_weight_out(tmp_path: Path) -> None:
    (tmp_path / "mask.png").write_bytes(b"")
    mask = {"texture": str(tmp_path / "mask.png")}
    for weights in ((mask, 0.5), (0.5, mask)):
        with pytest.raises(vt.InvalidInput, match="part 1: weight: must be left out beside textures"):
            vt.Mix([(weight, PAINT) for weight in weights])
    with pytest.raises(vt.InvalidInput, match="part 0: weight: channel: must be one of r, g, b, a for a single number"):
        vt.Mix([({**mask, "channel": "rgb"}, PAINT), (None, PAINT)])


def test_a_file_that_is_part_of_itself_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "snake.yaml"
    path.write_text("mix:\n- {weight: 0.5, material: snake.yaml}\n- {material: bare-gold}\n", encoding="utf-8")
    with pytest.raises(vt.InvalidInput) as caught:
        vt.load(path)
    assert str(caught.value).startswith(f"{path}: ") and f"holds mixtures more than {DEEPEST} deep, or itself" in str(
        caught.value
    )
    deep: Any = PAINT
    for _ in range(DEEPEST):
        deep = vt.Mix([(None, deep)])
    with pytest.raises(vt.InvalidInput, match="deep, or itself"):
        vt.Mix([(None, deep)])


def test_names_of_parts_that_are_not_there_are_refused() -> None:
    for values, line in (
        ({"part5_layer0_eta": 1.4}, "part5_layer0_eta: the last part is part 1"),
        ({"part1_weight": 0.3}, "part 1: weight: is what the other parts leave; change theirs"),
        ({"part0_layer7_eta": 1.4}, "part 0: layer7_eta: the last layer is layer 1"),
        ({"layer0_eta": 1.4}, "unknown parameter 'layer0_eta' (did you mean part1_layer0_eta?)"),
        ({"part0_weight": 2}, "weight: must lie in 0 to 1, got 2"),
    ):
        with pytest.raises(vt.InvalidInput) as caught:
            WORN.replace(**values)
        assert line in str(caught.value)
    for values in ({"part0_" * 500 + "layer0_eta": 1.4}, {"part1_layer0_eta": 1.4}, {"part0_weight": 0.5}):
        with pytest.raises(vt.InvalidInput):
            vt.Mix.from_flat(values)
    assert addressed("part0_" * 500 + "layer0_eta") == ()


def test_the_schema_knows_mixtures() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    for mix in (WORN, DUSTY):
        assert validator.is_valid(json.loads(dumps(mix, "json")))
    assert validator.is_valid({"mix": [{"weight": 0.5, "material": "bare-gold"}, {"material": "parts/metal.yaml"}]})
    assert not validator.is_valid({"mix": [{"weight": 1.5, "material": "bare-gold"}]})
    assert not validator.is_valid({"mix": []})


def test_what_takes_a_single_stack_refuses_a_mixture_in_one_line() -> None:
    with pytest.raises(vt.InvalidInput, match=r"^the inverse: takes a single stack, not a mixture$"):
        single(WORN, "the inverse")
    with pytest.raises(vt.InvalidInput, match=r"^the inverse: takes a single stack, not a mixture$"):
        vt.inverse.coat(WORN)
    assert single("bare-gold", "") == vt.preset("bare-gold")


def test_every_stack_is_changed_where_it_is() -> None:
    named = DUSTY.each(lambda path, stack: stack.replace(name="/".join(map(str, path))))
    assert [stack.name for _, stack in named.leaves()] == ["0", "1", "2/0", "2/1"]
    assert named.each(lambda path, stack: stack) == named and named.weighted("")[1][0] == 0.1


# Lobes ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [model.name for model in vt.MODELS])
def test_lobes_are_those_of_the_parts_with_energies_times_their_shares(model: str) -> None:
    glass = vt.Stack([vt.Interface(eta=1.5, alpha=0.2)])
    mix = vt.Mix([(0.3, PAINT), (0.25, glass), (None, vt.Mix([(0.4, METAL), (None, glass)]))])
    cosines = [1.0, 0.4]
    found, parts = vt.lobes(mix, cosines, model=model), [vt.lobes(s, cosines, model=model) for _, s in mix.leaves()]
    shares = [0.3, 0.25, (1 - 0.55) * 0.4, (1 - 0.55) * 0.6]
    assert np.allclose(shares, [share for share, _ in mix.weighted("")], rtol=0, atol=1e-15)
    lobes = [(share, part, k) for share, part in zip(shares, parts) for k in range(len(part.energy))]
    assert len(found.energy) == len(lobes) and len(found.transmitted) == 2
    for k, (share, part, own) in enumerate(lobes):
        assert np.allclose(found.energy[k], share * part.energy[own], rtol=1e-14, atol=0)
        assert np.array_equal(found.alpha[k], part.alpha[own], equal_nan=True)
        assert np.array_equal(found.covariance[k], part.covariance[own], equal_nan=True)
    for name in ("remainder", "passed", "absorbed"):
        each = [share * getattr(part, name) for share, part in zip(shares, parts)]
        assert np.allclose(getattr(found, name), np.sum(each, axis=0), rtol=1e-14, atol=0)
    assert np.allclose(sum(found.energy) + found.remainder + found.passed + found.absorbed, 1, atol=1e-6)


def test_lobes_on_the_command_line_are_named_by_their_parts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from velatura.cli import lobes

    vt.save(WORN, tmp_path / "worn.yaml")
    lobes.lobes(str(tmp_path / "worn.yaml"), cos="1,0.5", settings=["part0_weight=0.2", "part1_layer0_alpha=0.2"])
    text = capsys.readouterr().out
    assert "part0 R1" in text and "part1 R1" in text and "remainder" in text
    lobes.lobes(str(tmp_path / "worn.yaml"), settings=["part0_weight=0.2"], as_json=True)
    found = json.loads(capsys.readouterr().out)
    assert found["transmitted"] == [] and len(found["reflected"]) == 2
    assert np.allclose(np.array(found["reflected"][1]["energy"]).T, 0.8 * vt.lobes(METAL, 1.0).energy[0])


def test_a_part_that_covers_one_of_an_object_is_kept_and_found() -> None:
    """Expected: by its name; other names have the last part, and without a name, or a part that covers, shares hold."""
    plain = vt.Mix([(0.25, GOLD), (None, PAINT)])
    mix = vt.Mix.from_dict(
        {"mix": [{"weight": 0.25, "material": GOLD, "covers": "Foot"}, {"material": PAINT, "covers": "Shade"}]}
    )
    again = vt.Mix.from_dict(mix.to_dict()).replace(part0_weight=0.5, part0_layer0_alpha=0.3)
    assert [part.covers for part in again.mix] == ["Foot", "Shade"]
    foot, shade = (part.material for part in again.mix)
    assert [again.covering(name) for name in ("Foot", "Shade", "Bulb", "")] == [foot, shade, shade, again]
    assert plain.covering("Foot") is plain
    with pytest.raises(vt.InvalidInput, match="part 0: covers: must be text"):
        vt.Mix.from_dict({"mix": [{"weight": 0.25, "material": GOLD, "covers": 3}, {"material": PAINT}]})
