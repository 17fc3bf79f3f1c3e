"""Pages of the refractiveindex.info database: their values against other evaluations, and files of strangers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import velatura as vt
from velatura import citations
from velatura.errors import InvalidInput
from velatura.stack import dumps, json_schema, load, loads, names, rgb, save, spectra, spectrum, substances

GOLD = {"refractiveindex": "main/Au/Johnson"}
PAGE = """
REFERENCES: A. Author. <a href="https://doi.org/10.1000/x_1"><i>J. &amp; Co</i> <b>5</b>, 1 (2001)</a>
DATA:
  - type: tabulated nk
    data: |
        0.40 1.5 0.2
        0.70 1.7 0.4
"""


# Values --------------------------------------------------------------------------------------------------------------


def as_documented(block: dict[str, Any], um: np.ndarray) -> dict[str, np.ndarray]:
    """The values of a block of data, by tables and the formulas of the database's "Dispersion formulas" with the
    coefficients C1, C2, ... that these have."""
    kind = block["type"]
    if kind.startswith("tabulated"):
        rows = np.array([line.split() for line in block["data"].splitlines()], float)
        rows = rows[rows[:, 0].argsort(kind="stable")]
        return {part: np.interp(um, rows[:, 0], rows[:, i]) for i, part in enumerate(kind.split()[1], start=1)}
    c = np.array([0.0, *map(float, block["coefficients"].split()), *[0.0] * 24])
    pairs = range(2, 18, 2)
    n: Any = None
    n2: Any = None
    match kind:
        case "formula 1":
            n2 = 1 + c[1] + sum(c[i] * um**2 / (um**2 - c[i + 1] ** 2) for i in pairs)
        case "formula 2":
            n2 = 1 + c[1] + sum(c[i] * um**2 / (um**2 - c[i + 1]) for i in pairs)
        case "formula 3":
            n2 = c[1] + sum(c[i] * um ** c[i + 1] for i in pairs)
        case "formula 4":
            n2 = c[1] + c[2] * um ** c[3] / (um**2 - c[4] ** c[5]) + c[6] * um ** c[7] / (um**2 - c[8] ** c[9])
            n2 = n2 + sum(c[i] * um ** c[i + 1] for i in range(10, 18, 2))
        case "formula 5":
            n = c[1] + sum(c[i] * um ** c[i + 1] for i in pairs)
        case "formula 6":
            n = 1 + c[1] + sum(c[i] / (c[i + 1] - um**-2) for i in pairs)
    return {"n": n if n2 is None else np.sqrt(n2)}


def test_pages_have_the_values_of_their_files() -> None:
    """Rationale: all pages of the package, at 20 wavelengths of each part. Expected: n and k of a plain evaluation."""
    assert len(substances.names()) > 80
    for name in substances.names():
        fields = yaml.safe_load(substances.entry(name).path.read_text(encoding="utf-8"))
        page = substances.page(name)
        for part, curve in (("n", page.n), ("k", page.k)):
            if curve is None:
                continue
            um = np.linspace(*curve.range_um, 22)[1:-1]
            found = [curve.at(each) for each in um]
            blocks = [as_documented(block, um) for block in fields["DATA"]]
            expected = next(values[part] for values in reversed(blocks) if part in values)
            np.testing.assert_allclose(found, expected, atol=1e-6, err_msg=name)


@pytest.mark.parametrize(
    ("formula", "coefficients", "um", "n"),  # by the package refractiveindex 1.3.1
    [
        (7, "3.41983 0.159906 -0.123109 1.26878E-6 -1.95104E-9", 6.734957142857, 3.423351098277812),  # Si, Edwards
        (8, "0.452505 0.09939 0.070537 -0.000150", 0.578333333333, 2.261829153101941),  # AgBr, Schroter
        (8, "0.48484 0.10279 0.090000 -0.0047896", 0.592380952381, 2.4339366431832636),  # TlBr, Schroter
        (9, "2.51527 0.0240 0.0300 0.020 1.52 0.8771", 0.444761904762, 1.627178413843332),  # urea, Rosker
    ],
)
def test_rare_formulas_have_the_values_of_another_program(formula: int, coefficients: str, um: float, n: float) -> None:
    assert substances.FORMULAS[formula](tuple(map(float, coefficients.split())), um) == pytest.approx(n, abs=1e-6)


def test_a_spectrum_is_the_page_at_all_wavelengths() -> None:
    """Expected: between the wavelengths of a formula straight lines differ by less than 1e-6; a table has its own rows,
    and beyond the ends the last value holds."""
    for name in ("main/ZnS/Debenham", "popular_glass/SF11/SCHOTT", "main/TiO2/Devore-o"):
        curve = substances.page(name).n
        assert curve
        nm = np.linspace(max(360, curve.range_um[0] * 1e3), 830, 1001)
        expected = [curve.at(each * 1e-3) for each in nm]
        index = vt.Substance(refractiveindex=name)
        np.testing.assert_allclose(np.interp(nm, *spectrum(index)), expected, atol=1e-6)
    nm, k = spectrum(vt.Substance(**GOLD).of("k"))
    assert (nm.min(), nm.max(), k[np.argmin(abs(nm - 495.9))]) == pytest.approx((354.2, 892.0, 1.833))
    nm = spectrum(vt.Substance(refractiveindex="organic/polylactic_acid/Bodurov"))[0]
    assert (nm[0], nm[-1]) == pytest.approx((405, 635))


# Materials -----------------------------------------------------------------------------------------------------------


def test_a_page_with_k_is_a_metal_and_behaves_as_tables_do(tmp_path: Path) -> None:
    """Expected: the colour and the lobes of tables of the same numbers, coated as well; glass is a dielectric, though
    its page has a k, of absorption along centimetres."""
    metal = loads(f"layers: [{{interface: {{eta: {json.dumps(GOLD)}, alpha: 0.2}}}}]").layers[0]
    assert isinstance(metal, vt.Interface) and metal.kind == "conductor" and metal.measured
    tables = {}
    for part in ("eta", "k"):
        path = tmp_path / f"{part}.txt"
        table = vt.Substance(**GOLD).of(part).table()
        path.write_text("\n".join(f"{nm!r} {value!r}" for nm, value in zip(*table)))
        tables[part] = vt.Spectrum(spectrum=path)
        assert rgb(tables[part]) == rgb(getattr(metal, part))
    glass = vt.Interface(eta=vt.Substance(refractiveindex="popular_glass/BK7/SCHOTT"), alpha=0.1)
    assert glass.kind == "dielectric" and rgb(glass.eta) == pytest.approx(rgb(spectra.Named("bk7", "eta")), abs=1e-6)
    found = vt.lobes(vt.Stack([glass, metal]), 0.6)
    expected = vt.lobes(vt.Stack([glass, vt.Interface(**tables, alpha=0.2)]), 0.6)
    np.testing.assert_allclose(found.energy, expected.energy, rtol=1e-12)


def test_a_page_replaces_a_whole_index() -> None:
    """Expected: of any metal another one, with the k of its page, unless that is given as well; of a metal glass."""
    gold = vt.Stack([vt.Interface(eta=vt.Substance(**GOLD))])
    steel = vt.Substance(refractiveindex="other/stainless_steel/Karlsson-austenitic")
    for stack in (gold, vt.Stack([vt.Interface(conductor="Au")]), vt.Stack([vt.Interface(eta=0.2, k=3.0)])):
        assert stack.replace(layer0_eta=steel) == vt.Stack([vt.Interface(eta=steel)])
        assert stack.replace(layer0_eta=steel, layer0_k=2.0) == vt.Stack([vt.Interface(eta=steel, k=2.0)])
    assert gold.replace(layer0_eta={"refractiveindex": "main/SiO2/Malitson"}).kinds == ("dielectric",)
    assert gold.replace(layer0_conductor="Au") == vt.Stack([vt.Interface(conductor="Au")])


def test_a_page_stays_with_its_material(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: names as they are, paths relative to the material file; the same stack from all that is written."""
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages/own.yml").write_text(PAGE)
    (tmp_path / "m.yaml").write_text(
        "layers: [{interface: {eta: {refractiveindex: main/SiO2/Malitson}}},"
        "{interface: {eta: {refractiveindex: pages/own.yml}}}]"
    )
    monkeypatch.chdir(tmp_path / "pages")
    stack = load("../m.yaml")
    assert stack.kinds == ("dielectric", "conductor")
    for name in ("again.json", "again.yaml"):
        save(stack, tmp_path / name)
        assert load(tmp_path / name) == stack == loads(dumps(stack)) == stack.replace(**stack.flat())
    assert "{refractiveindex: pages/own.yml}" in (tmp_path / "again.yaml").read_text()
    assert vt.Stack.from_flat(None, stack.flat()) == vt.Stack.from_flat(stack.kinds, stack.flat()) == stack
    (tmp_path / "pages/own.yml").write_text(PAGE.replace("0.4\n", "0.5\n"))
    assert load("../m.yaml") != stack
    film = vt.Film(eta=vt.Substance(refractiveindex="main/TiO2/Devore-o"), thickness_nm=60)
    assert vt.Film.from_dict(film.to_dict()) == film


def test_a_copy_of_the_database_is_read_where_the_environment_names_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Expected: its pages and those of the package, which it does not replace; also in a repository."""
    data = tmp_path / "database/data/main/Xx/nk"
    data.mkdir(parents=True)
    (data / "Author.yml").write_text(PAGE)
    listed = "".join(
        f"- SHELF: main\n  content: [{{BOOK: {book}, name: X, content: [{{PAGE: {page}, name: Y, data: {file}}}]}}]\n"
        for book, page, file in (
            ("Xx", "Author", "main/Xx/nk/Author.yml"),
            ("Au", "Johnson", "main/Xx/nk/Author.yml"),
            ("Xx", "Gone", "main/Xx/nk/Gone.yml"),
        )
    )
    (tmp_path / "database/catalog-nk.yml").write_text(listed)
    with pytest.raises(InvalidInput, match=r"^unknown page of refractiveindex\.info 'main/Xx/Author' .*"):
        substances.page("main/Xx/Author")
    for folder in (tmp_path, tmp_path / "database"):
        monkeypatch.setenv(substances.COPY, str(folder))
        page = substances.page("main/Xx/Author")
        assert page.n and page.n.at(0.55) == pytest.approx(1.6)
        assert set(substances.names()) < set(substances.entries())
        assert substances.page("main/Au/Johnson").n != page.n
    with pytest.raises(InvalidInput, match=r"^\S*Gone\.yml: file not found$"):
        substances.page("main/Xx/Gone")
    for text, reason in (
        (listed.replace("main/Xx/nk/Gone.yml", "../../../secret.yml"), r"'main/Xx/Gone' lies outside of the database"),
        (listed.replace("main/Xx/nk/Gone.yml", "/secret.yml"), r"'main/Xx/Gone' lies outside of the database"),
        ("- SHELF: main\n  content: [{BOOK: 3}, 4]", "is no catalogue of the refractiveindex.info database"),
    ):
        (tmp_path / "database/catalog-nk.yml").write_text(text)
        with pytest.raises(InvalidInput, match=rf"^VELATURA_REFRACTIVEINDEX: \S*catalog-nk\.yml: {reason}$"):
            substances.page("main/Xx/Author")
    monkeypatch.setenv(substances.COPY, str(tmp_path / "none"))
    with pytest.raises(
        InvalidInput, match=r"^VELATURA_REFRACTIVEINDEX: \S*none/database/catalog-nk.yml: file not found$"
    ):
        substances.page("main/Xx/Author")
    assert substances.page("main/Au/Johnson")


# Strangers -----------------------------------------------------------------------------------------------------------


def formula(number: object, coefficients: object, range_um: object = "0.3 1.0") -> str:
    return f"DATA: [{{type: formula {number}, wavelength_range: {range_um}, coefficients: {coefficients}}}]"


def tabulated(data: str, parts: str = "nk") -> str:
    return f"DATA:\n  - type: tabulated {parts}\n    data: |\n" + "".join(f"      {row}\n" for row in data.split("\n"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("3", "is no page of the refractiveindex.info database: it has no DATA"),
        ("DATA: 3", "is no page of the refractiveindex.info database: it has no DATA"),
        ("DATA: []", "DATA: holds neither n nor k"),
        ("DATA: [3]", "DATA: type: must be tabulated nk, n or k, or formula 1 to 9, got nothing"),
        (formula(10, "1 2 3"), "DATA: type: must be tabulated nk, n or k, or formula 1 to 9, got 'formula 10'"),
        (formula(2, "1 2"), "DATA: coefficients: formula 2 has no 2 of them"),
        (formula(2, "1 " * 4001), "DATA: coefficients: formula 2 has no 4001 of them"),
        (formula(4, "1 2 3"), "DATA: coefficients: formula 4 has no 3 of them"),
        (formula(8, "1 2 3"), "DATA: coefficients: formula 8 has no 3 of them"),
        (formula(2, "1 2 nan"), "DATA: coefficients: must be finite numbers"),
        (formula(2, "1 2 __import__"), "DATA: coefficients: must be finite numbers"),
        (formula(2, "{a: 1}"), "DATA: coefficients: must be finite numbers"),
        (
            formula(2, "0 1 0.01", "1.0 0.3"),
            "DATA: wavelength_range: must be two wavelengths in micrometres, which ascend",
        ),
        (formula(2, "0 1 0.01", "5 9"), "OWN: must hold values at two wavelengths or more of visible light"),
        (formula(2, "0 1 0.01", "0.2 0.36"), "OWN: must hold values at two wavelengths or more of visible light"),
        (formula(2, "-3 1 0.01"), "OWN: formula 2 has no index at 360 nm"),
        (formula(1, "0 1 0.5"), "OWN: formula 1 has no index at 360 nm"),
        (formula(3, "0 1 1e6", "0.3 9"), "OWN: must lie in 0.001 to 1e4, got 0.0"),
        (formula(5, "0 1 -1e6", "0.3 9"), "OWN: formula 5 has no index at 360 nm"),
        (formula(4, "1 1 1 -1 0.5"), "OWN: formula 4 has no index at 360 nm"),
        (tabulated("0.4 1.5 0\n0.5 1.6"), "DATA: data: line 2: must be a wavelength in micrometres and two values"),
        (tabulated("0.4 1.5 0\n-1 1.6 0"), "DATA: data: line 2: must be a wavelength in micrometres and two values"),
        (tabulated("0.4 1.5\n0.5 inf", "n"), "DATA: data: line 2: must be finite numbers"),
        (tabulated("", "n"), "DATA: data: holds no rows"),
        (tabulated("0.4 1.5\n0.5 -1.5", "n"), "OWN: must lie in 0.001 to 1e4, got -1.5"),
        (tabulated("0.55 1.5", "n"), "OWN: must hold values at two wavelengths or more of visible light"),
        (tabulated("0.4 1.5\n0.5 1.5", "k"), "OWN: has no n"),
        ("DATA: !!python/object/apply:os.system [ls]", "line 1: a value must have no tag, got .*"),
        ("a: &a [x, x]\nDATA: &b [*a, *a]\nc: [*b, *d]", ".*found undefined alias.*"),
        ("DATA: &a [*a]", "holds more than 100000 values once its aliases are written out"),
        ("DATA: [", "line 1: is not valid YAML: .*"),
        (b"\xff\xfe\x00", r"is not UTF-8 text \(byte 0\)"),
        ("#" * 2**22 + "#", "is larger than 4 MiB"),
    ],
)
def test_what_is_no_page_is_refused_in_a_line(text: str | bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "own.yml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(InvalidInput) as caught:
        loads("layers: [{interface: {eta: {refractiveindex: own.yml}}}]", folder=tmp_path)
    message = str(caught.value).replace(f"{path}: ", "OWN: ")
    head = "material.yaml: layer 0 (interface): eta: OWN: "
    assert message.startswith(head) and "\n" not in message
    assert re.fullmatch(reason.removeprefix("OWN: "), message.removeprefix(head)), message


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ("eta: {refractiveindex: main/Au/Jonson}", r"eta: .*unknown page .* \(did you mean main/Au/Johnson\?\)"),
        (
            "eta: {refractiveindex: ../../etc/passwd}",
            r"eta: .*unknown page of refractiveindex.info '../../etc/passwd' .*",
        ),
        ("eta: {refractiveindex: ../x.yml}", r"eta: refractiveindex: file not found: \S*x\.yml"),
        ("eta: {refractiveindex: 3}", r"eta: refractiveindex: must be shelf/book/page .* or the path .*, got 3"),
        ("eta: {refractiveindex: main/Au/Johnson, scale: 2}", r"eta: unknown key 'scale' .*"),
        ("eta: 1.5, k: {refractiveindex: main/SiO2/Malitson}", "k: main/SiO2/Malitson: has no k"),
        ("conductor: Au, eta: {refractiveindex: main/Au/Johnson}", "eta: not together with conductor; .*"),
        ("conductor: {refractiveindex: main/Au/Johnson}", r"conductor: must be .*; or write eta: {refractiveindex: .*"),
        ("eta: 1.5, alpha: {refractiveindex: main/Au/Johnson}", r"alpha: unknown key 'refractiveindex' .*"),
    ],
)
def test_a_wrong_page_is_refused_in_a_line(keys: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=rf"^material\.yaml: layer 0 \(interface\): {reason}$"):
        loads(f"layers: [{{interface: {{{keys}}}}}]", folder=tmp_path)


# Lists and sources ---------------------------------------------------------------------------------------------------


def test_every_page_of_the_package_can_be_used_and_cited() -> None:
    """Expected: an index that interfaces take, of a metal with the k of its page, and a reference without marks."""
    kinds = set()
    for name in substances.names():
        kinds.add(vt.Interface(eta=vt.Substance(refractiveindex=name)).kind)
        line = citations.text(citations.entries([name])[name])
        assert not any(mark in line for mark in "<>{}\\\n") and len(line) > len(name) + 40, line
    assert kinds == {"dielectric", "conductor"}


def test_a_page_is_cited_with_its_reference_and_the_database(tmp_path: Path) -> None:
    found = citations.entries(["main/Au/Johnson", "realtime"])
    assert list(found) == ["main/Au/Johnson", "polyanskiy2024", "belcour2018", "weier2020", "velatura", "mitsuba3"]
    assert citations.text(found["main/Au/Johnson"]) == (
        "P. B. Johnson and R. W. Christy. Optical constants of the noble metals. Phys. Rev. B 6, 4370-4379 (1972) "
        "https://doi.org/10.1103/PhysRevB.6.4370 (main/Au/Johnson of refractiveindex.info)"
    )
    path = tmp_path / "own.yml"
    path.write_text(PAGE.replace("Author", r"No\b}{ody_1"))
    entry = citations.entries([str(path)])[str(path)]
    assert r"note         = {A. No b  ody\_1. J. \& Co 5, 1 (2001)}" in entry and entry.count("{") == entry.count("}")
    with pytest.raises(InvalidInput, match=r"^unknown page of refractiveindex\.info 'main/Au/X'"):
        citations.entries(["main/Au/X"])


def test_the_list_has_range_source_and_colour(run: Callable[..., tuple[int, str, str]]) -> None:
    """Expected: of gold the name and the pages, each with the colour of its mirror; nothing of what is unknown."""
    status, out, _ = run("substances", "gold", "--json")
    rows = {row["name"]: row for row in json.loads(out)}
    assert status == 0 and {"Au", "main/Au/Johnson", "main/Au/Rakic-BB", "other/Au-Ag/Rioux-Au50Ag50"} <= set(rows)
    johnson = rows["main/Au/Johnson"]
    assert (johnson["range_nm"], johnson["source"][:16]) == ([187.9, 1937.0], "Johnson and Chri")
    red, green, blue = bytes.fromhex(johnson["colour"][1:])
    assert red == 255 > green > 210 > 170 > blue > 150
    lines = run("substances")[1].splitlines()
    assert len(lines) > 170 and all(" nm " in line for line in lines)
    assert [line.split()[0] for line in run("substances", "STEEL")[1].splitlines()] == [
        "other/stainless_steel/Karlsson-austenitic",
        "other/stainless_steel/Karlsson-ferritic",
    ]
    assert run("substances", "xyzzy")[:2] == (0, "")
    assert "main/Au/Johnson of refractiveindex.info" in run("cite", "main/Au/Johnson", "--format", "text")[1]


def test_names_state_their_source() -> None:
    metals, dielectrics = names()
    assert all(spectra.source(name) for name in (*metals, *dielectrics))
    assert spectra.source("gold") == spectra.source("Au") == "luxpop.com, as Mitsuba 3 carries it: Au"
    assert "Palik" in spectra.source("Cu_palik") and spectra.source("glass") == "Schott, data sheet of N-BK7"
    for part, expected in (("eta", 0.916), ("k", 1.840)):
        copper, palik, gold = (spectrum(spectra.Named(name, part)) for name in ("Cu", "Cu_palik", "Au"))
        nm, expected_copper = (column[(palik[0] > 400) & (palik[0] < 700)] for column in palik)
        np.testing.assert_allclose(np.interp(nm, *copper), expected_copper, atol=0.01)
        assert np.interp(495.94, *gold) == pytest.approx(expected, abs=1e-3)
    layers = json_schema()["$defs"]["stack"]["properties"]["layers"]
    conductor = layers["items"]["oneOf"][0]["properties"]["interface"]["properties"]
    described = dict(zip(conductor["conductor"]["enum"], conductor["conductor"]["enumDescriptions"], strict=True))
    assert described["Au"] == spectra.source("Au")
