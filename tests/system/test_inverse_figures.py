"""The figures of Bati et al. 2021: their numbers against those of the paper."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from velatura.figures import (
    bati2021,
    bati2021_04,
    bati2021_05,
    bati2021_06,
    bati2021_07,
    bati2021_08,
    bati2021_09,
    bati2021_11,
    bati2021_12,
    bati2021_14,
    bati2021_15,
    bati2021_16,
    bati2021_17,
    bati2021_23,
    bati2021_25,
    canvas,
    looks,
)

pytestmark = pytest.mark.usefixtures("one_thread")

ROWS = bati2021.FIGURES


def names(row: looks.Looks) -> list[str]:
    """The stacks that the panels of a figure show."""
    return [panel.names[0] for panel in row.panels]


def drawn(module: Any, numbers: dict[str, Any], folder: Path) -> None:
    """The numbers are plain, and there is a picture of them."""
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    module.draw(numbers, folder / "figure.png")
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_classes_of_smooth_pairs(tmp_path: Path) -> None:
    """Figure 7. Expected: classes grow with energy and with the index above; the slab lies on its bound; what the
    model finds within bounds is the closed curve."""
    found = bati2021_07.compute(count=20)
    assert found["deviation"] < 1e-6
    first = found["cases"][0]
    inside = np.concatenate(first["inside"])
    assert inside.min() > 1 - 1e-9
    assert inside[:, 0].max() <= 2.2643
    root = (1 + 0.15**0.5) / (1 - 0.15**0.5)
    assert np.allclose(first["points"]["matched above"][0], (1, root))
    slab = first["points"]["slab"][0]
    assert np.allclose(np.cosh(np.log(slab[0])), 1 / 0.85) and slab[1] == 1
    for part, key in (("b", "energy"), ("c", "eta_0")):
        cases = sorted((case for case in found["cases"] if case["part"] == part), key=lambda case: case[key])
        width = [np.max(case["curve"], axis=0)[0] for case in cases]
        assert width == sorted(width)
    drawn(bati2021_07, found, tmp_path)


def test_the_order_of_lobes_shows_at_the_edge(tmp_path: Path) -> None:
    """Figure 17. Expected: the same energies head-on; at grazing angles a tint that depends on the order."""
    found = bati2021_17.compute(size=16, spp=2, members=9)
    blue, red = (found[order] for order in bati2021_17.ORDERS)
    assert np.allclose(blue["energy"][0], red["energy"][0], atol=1e-6)
    assert np.allclose(blue["energy"][0], np.add([0.025, 0.045, 0.05], [0.052, 0.025, 0.025]), atol=1e-6)
    assert blue["grazing"] <= blue["most"] < 0.8
    assert red["grazing"] >= red["least"] > 1.1
    # No interface of the stacks that are shown vanishes
    for order in (blue, red):
        eta = [1.0, *(layer["interface"]["eta"] for layer in order["stack"]["layers"] if "interface" in layer)]
        assert np.abs(np.diff(np.log(eta))).min() > 0.02
    drawn(bati2021_17, found, tmp_path)


def test_lobes_obtained_are_those_expected(tmp_path: Path) -> None:
    """Figure 25. Expected: no difference, conductors included; the walk agrees on energies within 5 %."""
    found = bati2021_25.compute(targets=("15 c", "16"), paths=20_000)
    assert found["energy_error"] < 1e-6
    assert found["variance_error"] < 1e-6
    for row in found["rows"]:
        energy = row["energy"]
        assert np.allclose(energy["walk"], energy["expected"], rtol=0.05)
    drawn(bati2021_25, found, tmp_path)


def test_one_interface_has_two_roots_or_a_curve(tmp_path: Path) -> None:
    """Figure 4. Expected: what is inverted reflects what was asked for; the lower root from (1+r)/(1-r) on, r^2 = R."""
    found = bati2021_04.compute(count=31)
    assert found["deviation"] < 1e-8
    eta_0 = np.array(found["eta_0"])
    for case in found["dielectrics"]:
        root = case["reflectance"] ** 0.5
        bound = (1 + root) / (1 - root)
        assert [eta is not None for eta in case["rarer"]] == (eta_0 >= bound).tolist()
        assert [eta is not None for eta in case["denser"]] == (eta_0 * bound <= 4).tolist()
    for case in found["conductors"]:
        r = case["reflectance"]
        bounds = (1 - r) / (1 + r), (1 + r + (6 * r - 1 - r * r) ** 0.5) / (2 * (1 - r))
        assert np.allclose(np.array(case["eta"])[[0, -1]] / case["eta_0"], bounds)
        assert case["k"][-1] == pytest.approx(case["eta"][-1])
    drawn(bati2021_04, found, tmp_path)


def test_fresnel_is_close_where_the_paper_says_so(tmp_path: Path) -> None:
    """Figure 6: a good approximation above 1 for low roughness, not below 1 for an alpha above .1."""
    found = bati2021_06.compute(alphas=(0.01, 0.1, 0.2), count=60)
    low, middle, high = found["rough"]
    assert low["denser"] < 1e-3 and middle["denser"] < 0.02
    assert high["rarer"] > 0.3 and high["rarer"] > 5 * high["denser"]
    drawn(bati2021_06, found, tmp_path)


def test_the_slab_gains_most_at_grazing_angles(tmp_path: Path) -> None:
    """Figure 8. Expected: nothing is gained head-on; no physical pair gains as much as the slab."""
    found = bati2021_08.compute(count=45)
    gain = {point["name"]: np.array(point["gain"]) for point in found["points"]}
    assert all(abs(values[0]) < 1e-9 for values in gain.values())
    assert max(gain, key=lambda name: gain[name].max()) == "slab"
    assert min(values.min() for values in gain.values()) < -0.03
    drawn(bati2021_08, found, tmp_path)


def test_first_indices_of_smooth_pairs(tmp_path: Path) -> None:
    """Figure 9: the listed sets, which the depths over both indices bear out."""
    found = bati2021_09.compute(count=60)
    listed = [[[1, 2.264]], [[1, 1.1791], [2.4488, 3.4221]], [[3.3367, 4]]]
    for case, spans in zip(found["classes"], listed):
        assert np.allclose(case["eta_1"], spans, atol=5e-4)
        some = np.any(np.array(case["depth"], float) >= 0, axis=1)
        inside = np.any(
            [(np.array(found["eta"]) >= a) & (np.array(found["eta"]) <= b) for a, b in case["eta_1"]], axis=0
        )
        assert np.count_nonzero(some != inside) <= 2  # where a grid misses the tip of a class
    drawn(bati2021_09, found, tmp_path)


def test_rough_classes_end(tmp_path: Path) -> None:
    """Figure 11: the known end at an alpha of .01; the rougher the pair, the later it comes."""
    found = bati2021_11.compute(count=20)
    ends = [row["ends"][-1][1] for row in found["classes"]]
    assert ends[0] == pytest.approx(2.0786, abs=2e-3)
    assert ends == sorted(ends)
    drawn(bati2021_11, found, tmp_path)


def test_colours_have_part_of_their_classes_in_common(tmp_path: Path) -> None:
    """Figure 12: the listed set."""
    found = bati2021_12.compute(count=40)
    assert np.allclose(found["eta_1"], [[1, 1.79958], [2.11396, 2.57927]], atol=1e-4)
    assert 0 < found["share"] < min(channel["share"] for channel in found["channels"])
    # The curve of green leaves the bounds, and comes back as another one
    steps = [np.hypot(*np.diff(curve, axis=0).T) for curve in bati2021_12.members().boundary(channel=1)]
    assert len(steps) == 3 and max(step.max() for step in steps) < 0.2
    drawn(bati2021_12, found, tmp_path)


# Pictures. What they are of is tested without rendering, which costs most; one is rendered.


@pytest.fixture
def unlit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every picture is black."""
    monkeypatch.setattr(canvas, "pictures", lambda *args, **options: np.zeros((2, 4, 4, 3)))


def lobe(numbers: dict[str, Any], name: str, n: int) -> tuple[Any, float]:
    """Energy (rgb) and variance of a stack's n-th lobe head-on."""
    look = next(look for look in numbers["looks"] if look["name"] == name)
    return np.array(look["energies"][n][0]), look["variances"][n][0]


def test_two_stacks_share_a_sphere() -> None:
    """Expected: the left half is that of the first picture, the right half that of the second."""
    seen = {"left": np.zeros((4, 4, 3)), "right": np.ones((4, 4, 3))}
    assert (looks.halves(looks.Panel("", ("left", "right")), seen)[..., 0] == [0, 0, 1, 1]).all()


def test_members_of_a_class_differ_at_grazing_angles(unlit: None, tmp_path: Path) -> None:
    """Figures 5, 10, 15 and 16. Expected: alike head-on; at grazing angles as captioned."""
    found, at = bati2021_05.compute(), looks.COSINES.index(0.2)
    for a, b in (("a denser", "a rarer"), ("b grey", "b green edge"), ("c grey", "c green edge")):
        assert np.allclose(looks.energy(found, a), looks.energy(found, b), atol=1e-6)
    air, coated = (looks.energy(found, f"{part} green edge", at) for part in "bc")
    assert air[1] / air[0] > 1.3 > 1.1 > coated[1] / coated[0] > 1.01
    # (d): below the coat Fresnel is the same, and only up to 41.8 degrees is reached
    (_, in_air), (above, in_coat) = (bati2021_05.below(look) for look in found["looks"] if "green edge" in look["name"])
    assert above == 1.5 and np.allclose(in_air, in_coat, atol=1e-6)
    assert in_coat[41] < 0.65 < in_coat[60]
    drawn(bati2021_05, found, tmp_path)

    found = ROWS["bati2021-10"].compute()
    # The tables know Fresnel, of which the closed forms are, to 1e-5
    assert all(np.allclose(look["energy"][0], 0.15, atol=1e-4) for look in found["looks"])
    assert looks.energy(found, "a slab", at)[0] > 1.2 * looks.energy(found, "a one interface", at)[0]
    for part in "bc":
        assert looks.energy(found, f"{part} absorbing", at)[0] < 0.95 * looks.energy(found, f"{part} clear", at)[0]

    found = bati2021_15.compute()
    for name in ("15 a", "15 b", "15 c"):
        low, high = (looks.energy(found, f"{name}, {depth}", at) for depth in ("low", "high"))
        assert np.all(high < low)
    low, high = (looks.energy(found, f"15 b, {depth}", looks.COSINES.index(0.4)) for depth in ("low", "high"))
    assert low[2] / low[0] > 1.1 * high[2] / high[0]

    found = bati2021_16.compute()
    assert all(np.allclose(look["energy"][0], 0.45, atol=1e-6) for look in found["looks"])
    pink = {name: red / green for name in bati2021_16.CHOICES for red, green, _ in [looks.energy(found, name, at)]}
    assert pink["reference"] == pytest.approx(1) and pink["a"] == pytest.approx(1)
    assert pink["c"] > pink["b"] > 1.05
    drawn(bati2021_16, found, tmp_path)
    # On the chart: without absorption the effective index gives the pair its energy, in closed form
    coat, metal = looks.interfaces(found["looks"][0])
    index, y = bati2021_16.effective(coat["eta"], metal["eta"], metal["k"]), 2 / (1 - 0.45)
    assert np.cosh(np.log(coat["eta"])) + np.cosh(np.log(index / coat["eta"])) == pytest.approx(y, abs=0.01)


def test_a_coat_that_keeps_what_is_below(unlit: None, tmp_path: Path) -> None:
    """Figure 14. Expected: the kept lobes are the bare ones; a naive coat blurs (a), and splits the lobe of (b)."""
    found = bati2021_14.compute()
    for name, count in (("14 a", 1), ("14 b", 2)):
        for n in range(count):
            bare, kept = lobe(found, f"{name}, bare", n), lobe(found, f"{name}, kept", n + 1)
            assert np.allclose(bare[0], kept[0], atol=1e-4) and bare[1] == pytest.approx(kept[1], abs=1e-4)
    assert lobe(found, "14 a, coated", 1)[1] > 1.8 * 0.03
    first, second = (lobe(found, "14 b, coated", n)[1] for n in (1, 2))
    assert first > 1.3 * second
    drawn(bati2021_14, found, tmp_path)


def test_lobes_are_what_was_asked_for(unlit: None, tmp_path: Path) -> None:
    """Figures 18 to 22. Expected: colour, blur and haze as captioned."""
    found = ROWS["bati2021-18"].compute()
    assert np.allclose(looks.energy(found, "18 a, more saturated"), [0.01, 0.06, 0.11], atol=1e-6)
    assert [lobe(found, name, 0)[1] for name in names(ROWS["bati2021-18"])] == pytest.approx(
        [0.05] * 3 + [0, 0.15], abs=1e-6
    )

    found = ROWS["bati2021-19"].compute()
    bases = [look["stack"]["layers"][-1]["interface"] for look in found["looks"]]
    assert all(np.allclose(base["eta"], bases[0]["eta"], atol=1e-6) for base in bases)
    assert [base["alpha"] for base in bases] == sorted(base["alpha"] for base in bases)

    found = ROWS["bati2021-20"].compute()
    upper = {name: sum(lobe(found, name, n)[0] for n in (0, 1)) for name in names(ROWS["bati2021-20"])}
    lower = {name: lobe(found, name, 2)[0] for name in names(ROWS["bati2021-20"])}
    assert np.allclose(upper["20 left"], lower["20 right"], atol=1e-6)
    assert np.allclose(upper["20 right"], lower["20 left"], atol=1e-6)
    for name in names(ROWS["bati2021-20"]):  # what the upper lobe contributes is that lobe
        for n in (0, 1):
            whole, alone = lobe(found, name, n), lobe(found, f"{name}, upper", n)
            assert np.allclose(whole[0], alone[0], atol=1e-9) and whole[1] == pytest.approx(alone[1], abs=1e-9)
    drawn(ROWS["bati2021-20"], found, tmp_path)

    found = ROWS["bati2021-21"].compute()
    for n in (0, 1):
        assert lobe(found, "21 left", n)[1] == pytest.approx(lobe(found, "21 right", 1 - n)[1], abs=1e-6)

    found = ROWS["bati2021-22"].compute()
    top, middle, bottom = (looks.energy(found, name) for name in names(ROWS["bati2021-22"]))
    assert np.allclose(bottom, top + middle - 0.03, atol=1e-6)


def test_what_is_transmitted_is_a_by_product(unlit: None, tmp_path: Path) -> None:
    """Figure 23. Expected: the same reflection head-on; less passes where more is absorbed."""
    found = bati2021_23.compute()
    low, high = (found[name] for name in bati2021_23.NAMES.values())
    assert np.allclose(low["reflected"][0], high["reflected"][0], atol=1e-6)
    assert np.all(np.array(high["transmitted"][0]) < 0.8 * np.array(low["transmitted"][0]))
    drawn(bati2021_23, found, tmp_path)


def test_the_gallery_shows_pairs(unlit: None) -> None:
    """Figure 1. Expected: the coat of (c) and the edge of (b) leave the lobes below, and the grey, as they are."""
    found = ROWS["bati2021-01"].compute()
    assert len(found["looks"]) == 8
    assert np.allclose(lobe(found, "c", 0)[0], lobe(found, "c, coated", 1)[0], atol=1e-4)
    assert np.allclose(looks.energy(found, "b"), looks.energy(found, "b, pink edge"), atol=1e-6)


def test_a_diffuse_base_shows_through_the_pair(tmp_path: Path) -> None:
    """Figure 24, rendered. Expected: grey is brighter than black; an orange base looks bluer than its albedo."""
    found = ROWS["bati2021-24"].compute(size=16, spp=4)
    black, grey, orange = (np.mean(picture, axis=(0, 1)) for picture in found["pictures"])
    assert np.all(grey > black)
    plain, *covered = (looks.energy(found, look["name"]) for look in found["looks"])
    assert all(np.all(energy > plain + 0.01) for energy in covered)
    assert np.all(orange < grey + 0.02)
    blue = (orange - black)[2] / (orange - black)[0], 0.1 / 0.5
    assert blue[0] > 2 * blue[1]
    drawn(ROWS["bati2021-24"], found, tmp_path)
