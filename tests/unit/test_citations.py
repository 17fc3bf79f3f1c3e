"""What the source cites: `Author Year`, by the keys of references.bib, and of some papers every equation."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

from velatura import __version__, citations
from velatura.model import MODELS

ROOT = Path(__file__).parents[2]

# One author, two, or several, and a year; lines are joined before they are searched
CITATION = re.compile(r"\b([A-Z][a-zà-ÿ]+)(?:(?: and | & )[A-Z][a-zà-ÿ]+| et al\.)? \(?((?:19|20)\d\d)\b")
PARTS = re.compile(CITATION.pattern + r", (Eq|Algorithm)s?\.? (\d+(?:(?:-|, | and )\d+)*)")
OURS = re.compile(r"model\.md, Eq\. (\d+)")
UNNAMED = re.compile(r"\bEqs?\. \d")

#: What the papers print under the numbers that are cited, and where: each compared with the print when it was put here.
PRINTED = {
    "belcour2018": {
        "Eq 2": ("directional albedo", {"tables/build/quadrature", "tables/build/single_scattering", "tables/fetch"}),
        "Eq 5": ("reflection adds a variance", {"editor/validations"}),
        "Eq 6": ("variance of a roughness, f", {"model/roughness_maps"}),
        "Eq 7": ("reflection: energy", {"model/papers/operators"}),
        "Eq 8": ("reflection: mean", {"model/papers/operators"}),
        "Eq 9": ("reflection: variance", {"model/papers/operators"}),
        "Eq 10": ("scale of a roughness", {"model/papers/operators", "editor/validations", "figures/belcour2018_07"}),
        "Eq 11": ("refraction: energy", {"model/papers/operators"}),
        "Eq 12": ("refraction: mean", {"model/papers/operators"}),
        "Eq 13": ("refraction: variance", {"model/papers/operators"}),
        "Eq 15": ("absorption: energy", {"model/papers/operators", "editor/validations"}),
        "Eq 16": ("absorption: mean", {"model/papers/operators", "editor/validations"}),
        "Eq 17": ("absorption: variance", {"model/papers/operators", "editor/validations"}),
        "Eq 21": ("width of forward scattering", {"model/papers/operators", "editor/validations"}),
        "Eq 22": ("forward scattering: energy", {"model/papers/operators"}),
        "Eq 23": ("forward scattering: mean", {"model/papers/operators"}),
        "Eq 24": ("forward scattering: variance", {"model/papers/operators"}),
        "Eq 28": ("adding: reflectance from above", {"model/papers/adding"}),
        "Eq 29": ("adding: transmittance upwards", {"model/papers/adding"}),
        "Eq 30": ("adding: reflectance from below", {"model/papers/adding"}),
        "Eq 31": ("adding: transmittance downwards", {"model/papers/adding"}),
        "Eq 33": ("total internal reflection: integral over a lobe", {"editor/validations"}),
        "Eq 34": ("total internal reflection: reflectance", {"model/papers/adding"}),
        "Eq 35": ("total internal reflection: transmittance", {"model/papers/adding"}),
        "Eq 38": ("adding: variance of the reflection from above", {"model/papers/adding"}),
        "Eq 39": ("sum of lobes", {"model/papers/mixture"}),
        "Eq 40": ("choice of a lobe by its energy", {"model/papers/mixture"}),
        "Eq 49": ("adding: variance of the transmission downwards", {"model/papers/adding"}),
        "Eq 50": ("adding: variance of the transmission upwards", {"model/papers/adding"}),
        "Eq 51": ("adding: variance of the reflection from below", {"model/papers/adding"}),
    },
    "yamaguchi2019": {
        "Eq 1": ("reflection", {"model/papers/adding", "model/variance"}),
        "Eq 2": ("refraction", {"model/papers/adding", "model/variance"}),
        "Eq 4": ("Jacobian, reflected", {"model/variance", "figures/yamaguchi2019_02", "figures/yamaguchi2019_03"}),
        "Eq 5": ("Jacobian, refracted", {"model/variance", "figures/yamaguchi2019_03"}),
    },
    "bati2021": {
        "Eq 1": ("Fresnel reflectance at normal incidence", {"optics/fresnel", "inverse/lobes/interface"}),
        "Eq 6": ("variances of one interface", {"model/papers/operators"}),
        "Eq 7": ("index of a dielectric", {"inverse/lobes/interface"}),
        "Eq 8": ("k of a conductor", {"inverse/lobes/interface"}),
        "Eq 9": ("largest eta of a conductor", {"inverse/lobes/interface", "programs/metals"}),
        "Eq 10": ("smallest eta of a conductor", {"inverse/lobes/interface"}),
        "Eq 11": ("attenuated reflectance below one interface", {"inverse/lobes/interface", "figures/bati2021_09"}),
        "Eq 12": ("N1, first indices of a pair", {"inverse/lobes/equivalence"}),
        "Eq 13": ("optical depth between two interfaces", {"inverse/lobes/interface"}),
        "Eq 14": ("N2, second indices of a pair", {"inverse/lobes/equivalence"}),
        "Eq 15": ("variance of a reflection below one interface", {"inverse/lobes/interface"}),
        "Eq 16": ("T0, optical depths above a pair", {"inverse/lobes/equivalence"}),
        "Eq 18": ("attenuated reflectance below a stack", {"inverse/lobes/interface"}),
        "Eq 19": ("variance of a reflection below a stack", {"inverse/lobes/interface"}),
        "Eq 20": ("energy that is left to the lower interface of a pair", {"inverse/lobes/pair"}),
        "Algorithm 1": ("class of a pair", {"inverse/lobes/pair"}),
        "Algorithm 2": ("several lobes, from the top", {"inverse/lobes/stacks"}),
        "Algorithm 3": ("demands on what lies below a stack", {"inverse/lobes/interface"}),
        "Algorithm 4": ("one more interface", {"inverse/lobes/interface"}),
        "Algorithm 5": ("a pair of interfaces", {"inverse/lobes/interface", "inverse/lobes/pair"}),
    },
}

#: The equations of docs/explanation/model.md, and the files below model/solved that compute them.
MODEL = {
    1: ("cosine in a medium", {"transmission/direct"}),
    2: ("energy of an interface", {"energies/adding"}),
    3: ("light let out, and thrown back", {"energies/adding"}),
    4: ("repeated events", {"energies/interfaces"}),
    5: ("refracted lobe", {"lobes/refracted_lobe"}),
    6: ("width of a lobe", {"lobes/widths"}),
    7: ("width of a veil", {"lobes/widths"}),
    8: ("remainder", {"lobes/remainder"}),
    9: ("direct transmission", {"transmission/direct"}),
    10: ("diffuse transmission", {"transmission/internal_reflections"}),
    11: ("medium on top", {"lobes/top_medium"}),
    12: ("light through a medium alone", {"lobes/top_medium"}),
    13: ("waves of wide light", {"lobes/wide"}),
}


def source() -> dict[str, str]:
    """Text by file of the package, every run of white space and comment signs as one space."""
    package = ROOT / "src/velatura"
    files = [path for path in package.rglob("*.py") if "node_modules" not in path.parts]
    return {str(p.relative_to(package)): re.sub(r"\s+(#\s+)?", " ", p.read_text(encoding="utf-8")) for p in files}


def key(author: str, year: str) -> str:
    letters = unicodedata.normalize("NFKD", author).encode("ascii", "ignore").decode()
    return letters.lower() + year


def numbers(listed: str) -> list[int]:
    """Of `1-3, 5 and 7` every number."""
    found: list[int] = []
    for span in re.split(", | and ", listed):
        first, *last = map(int, span.split("-"))
        found += range(first, (last or [first])[0] + 1)
    return found


def test_every_citation_has_an_entry() -> None:
    entries = set(re.findall(r"^@\w+\{(\w+),", citations.bibliography(), re.MULTILINE))
    cited = {(key(m[1], m[2]), file) for file, text in source().items() for m in CITATION.finditer(text)}
    assert len({found for found, _ in cited}) > 10
    assert sorted(pair for pair in cited if pair[0] not in entries) == []


def test_equations_are_those_that_were_read_in_print() -> None:
    found: dict[str, dict[str, set[str]]] = {paper: {} for paper in PRINTED}
    for file, text in source().items():
        for citation in PARTS.finditer(text):
            paper = key(citation[1], citation[2])
            if paper in found:
                for number in numbers(citation[4]):
                    found[paper].setdefault(f"{citation[3]} {number}", set()).add(file.removesuffix(".py"))
    for paper, parts in PRINTED.items():
        assert found[paper] == {part: files for part, (_, files) in parts.items()}


def test_equations_name_their_paper() -> None:
    """No `Eq. 5` alone, for which a reader would have to look further up."""
    for file, text in source().items():
        assert not UNNAMED.search(OURS.sub("", PARTS.sub("", text))), file


def test_every_equation_of_the_default_model_is_at_its_line() -> None:
    """The numbers of docs/explanation/model.md, each in the file that computes it."""
    page = (ROOT / "docs/explanation/model.md").read_text(encoding="utf-8")
    tags = {int(number) for number in re.findall(r"\\tag\{(\d+)\}", page)}
    found: dict[int, set[str]] = {}
    for file, text in source().items():
        for number in OURS.findall(text):
            found.setdefault(int(number), set()).add(file.removesuffix(".py"))
    rooms = {number: {f"model/solved/{name}" for name in files} for number, (_, files) in MODEL.items()}
    assert found == rooms and set(found) == tags


def test_every_model_has_its_papers_and_every_picture_its_programs() -> None:
    for model in [*(model.name for model in MODELS), *citations.PAPERS]:
        found = citations.entries([model])
        assert list(found)[-2:] == ["velatura", "mitsuba3"]
        assert {*found} >= {*citations.PAPERS.get(model, (model,))}
        assert all(entry.count("{") == entry.count("}") for entry in found.values())
    assert list(citations.entries(["bati2021", "realtime", "belcour2018"]))[:3] == [
        "bati2021",
        "belcour2018",
        "weier2020",
    ]
    assert f"version = {{{__version__}}}" in citations.entries()["velatura"]


def test_text_of_an_entry_has_accents_and_no_tex() -> None:
    """Every entry of the file; two as a bibliography prints them."""
    everything = re.findall(r"^@\w+\{\w+,\n.*?^\}", citations.bibliography(), re.MULTILINE | re.DOTALL)
    for entry in everything:
        assert not re.search(r"[{}\\]|--|  ", citations.text(entry)), citations.text(entry)
    assert len(everything) == citations.bibliography().count("\n@")
    assert citations.text(citations.entries(["bati2021"])["bati2021"]) == (
        "Bati, Mégane; Barla, Pascal; Pacanowski, Romain (2021). An Inverse Method for the Exploration of Layered "
        "Material Appearance. ACM Transactions on Graphics 40(4), 176:1–176:15. https://hal.inria.fr/hal-03255469"
    )
    assert "Guo, Yu; Hašan, Miloš; Zhao, Shuang (2018). " in citations.text(citations.entries(["reference"])["guo2018"])
