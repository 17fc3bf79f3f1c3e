"""How far the default model is from truths of others: tables and solvers of media, `tmm`, Mitsuba, random walks.

    python benchmarks/validation.py [--parts media films interfaces walks] [--folder docs/explanation]

- media: shares of light of `tests/shared/radiative_transfer.json`, which has their sources, less those of the model,
  semi-infinite media at depths 100, 10^4 and 10^6; and radiances of van de Hulst's slab;
- films: smooth stacks of films and thick media against `tmm`, at one wavelength: random ones, s and p apart, as films
  are computed; as the model adds them up, at the normal, and at a slant, where it leaves polarisation out;
- interfaces: values and densities of one interface, on which light meets one facet, against Mitsuba's BSDFs at nodes
  that are fine about the mirror direction; smooth ones against its functions of Fresnel's equations;
- walks: scores of both editions of the benchmark.

With FOLDER, numbers of the parts are written to its `validation.json`, with the date, the commit and the versions that
they are of, and all that it has is drawn into `validation.webp`: the page *Validation* of the manual prints them.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator, Mapping
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))

import bench
import radiative_transfer as known
from mixed_films import Mixed, light_of, random_mixed
from rows import parsed, row

import velatura as vt
from velatura import benchmark, files, kernel
from velatura.benchmark.candidates import Pairs, probe_of
from velatura.figures import canvas
from velatura.model.solved.energies.energies import energies
from velatura.model.solved.lobes.widths import nearly_straight
from velatura.optics.films import OpticalFilm
from velatura.stack import Interface, Material, Named, Stack, rgb

Array = NDArray[np.floating]

NAME = "validation"
PACKAGES = ("velatura", "mitsuba", "numpy", "tmm")

# Media ---------------------------------------------------------------------------------------------------------------

#: Sources of a truth by what it is called.
TRUTHS = {
    "van de Hulst's tables, Giovanelli": ("hulst_iad", "hulst_flick", "hulst_flick2", "wang"),
    "DISORT 4.0.99": ("disort",),
    "PythonicDISORT 1.8, 64 streams": ("disort64", "phases, mie"),
    "Sweigart's table of Rayleigh scattering": ("rayleigh",),
    "iadpython 0.5.3, 48 nodes": ("iadpython48",),
    "Chandrasekhar's H function": ("chandrasekhar",),
    "random walk in NumPy": ("walk",),
}
BRIGHT = 0.02  # share of light from which on relative errors are counted


def media() -> dict[str, Any]:
    """Errors of energies by truth, and of all: how many `numbers`, `mean` and `worst`, absolute, and `relative`, the
    worst; `points` of known shares and errors; and `radiance`, the worst relative error of values."""
    rows = [each for table in known.TABLES for each in known.rows(table)]
    points: dict[str, list[list[float]]] = {name: [] for name in TRUTHS}
    for each in rows:
        (name,) = (name for name, sources in TRUTHS.items() if each.source in sources)
        points[name] += np.stack([each.known, each.errors], axis=1).tolist()
    truths = [{"name": name, **_errors(found)} for name, found in points.items()]
    truths.append({"name": "all", **_errors([pair for found in points.values() for pair in found])})
    radiance = {part: float(np.abs(errors).max()) for part, errors in known.radiances("forward").items()}
    for each in truths:
        row("media", each["name"], each["mean"], "", f"worst {each['worst']:.2g}, {each['numbers']} numbers")
    row("media", "van de Hulst's radiances", list(radiance.values()), "", "worst, reflected and passed")
    return {"truths": truths, "points": points, "radiance": radiance}


def _errors(points: list[list[float]]) -> dict[str, Any]:
    truth, error = np.abs(np.array(points)).T
    relative = (error / np.maximum(truth, BRIGHT))[truth > BRIGHT]
    worst = {"mean": float(error.mean()), "worst": float(error.max()), "relative": float(relative.max())}
    return {"numbers": len(error), **worst}


# Films ---------------------------------------------------------------------------------------------------------------

RANDOM, OF_MODEL = 1000, 100  # stacks
SLANTS = np.linspace(1.0, 0.05, 39)  # cosines
#: Stacks of the picture, at 550 nm: indices of media, and films (index, extinction, nm) on interfaces.
SHOWN: dict[str, tuple[tuple[complex, ...], tuple[tuple[tuple[float, float, float], ...], ...]]] = {
    "oxide, 120 nm, on titanium": ((1.0, 2.5 + 3.4j), (((2.44, 0.0, 120.0),),)),
    "the same under varnish": ((1.0, 1.5, 2.5 + 3.4j), ((), ((2.44, 0.0, 120.0),))),
    "pane, 100 nm of magnesium fluoride": ((1.0, 1.52, 1.0), (((1.38, 0.0, 100.0),), ((1.38, 0.0, 100.0),))),
}
GREEN = 550.0  # nm


def films() -> dict[str, Any]:
    """The worst errors: of `films`, s and p of random stacks; of the model at the `normal`; and of it at a `slant`, in
    the mean and at most, from the mean of s and p. `shown` has reflectances over `cosines` of stacks of the picture."""
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of tmm, where nothing passes
    rng = np.random.default_rng(0)
    drawn = [random_mixed(rng) for _ in range(RANDOM)]
    alone = max(np.abs(np.subtract(m.summed(kind, c), m.exact(kind, c))).max() for m, c in drawn for kind in "sp")
    normal = [abs(reflected(m, np.ones(1))[0] - m.exact("s", 1.0)[0]) for m, _ in drawn[:OF_MODEL]]
    slant = [abs(reflected(m, np.array([c]))[0] - _unpolarised(m, c)) for m, c in drawn[:OF_MODEL]]
    shown = []
    for name, (indices, each) in SHOWN.items():
        on_it = tuple(tuple(OpticalFilm(*film) for film in films) for films in each)
        mixed = Mixed(tuple(map(complex, indices)), (0.0,) * len(indices), on_it, GREEN)
        ours, theirs = reflected(mixed, SLANTS), np.array([_unpolarised(mixed, c) for c in SLANTS])
        worst = float(np.abs(ours - theirs).max())
        shown.append({"name": name, "ours": ours.tolist(), "tmm": theirs.tolist(), "worst": worst})
    found = {"stacks": RANDOM, "films": float(alone), "of_model": OF_MODEL, "normal": float(max(normal))}
    found |= {"slant": {"mean": float(np.mean(slant)), "most": float(max(slant))}}
    row("films", "s and p, worst", found["films"], "", f"{RANDOM} stacks")
    row("films", "the model at the normal, worst", found["normal"], "", f"{OF_MODEL} stacks")
    row("films", "the model at a slant, mean", found["slant"]["mean"], "", f"worst {found['slant']['most']:.2g}")
    return {**found, "cosines": SLANTS.tolist(), "shown": shown}


def reflected(mixed: Mixed, cosines: Array) -> Array:
    """Light that the model reflects (N,)."""
    with light_of(mixed.wavelength_nm):
        found = energies(Material.of(mixed.stack), cosines, 0 * cosines, None, nearly_straight)
    return np.asarray(((found.lobes + found.veils).sum(axis=0) + found.rest)[0])


def _unpolarised(mixed: Mixed, cosine: float) -> float:
    return (mixed.exact("s", cosine)[0] + mixed.exact("p", cosine)[0]) / 2


# Interfaces ----------------------------------------------------------------------------------------------------------

GLASS = 1.5
METAL: dict[str, Any] = {"eta": rgb(Named("Au", "eta")), "k": rgb(Named("Au", "k"))}
ALPHAS: tuple[Any, ...] = (0.05, 0.1, 0.3, 0.6)
BRUSHED = (0.4, 0.1)
COSINES = (0.98, 0.8, 0.5, 0.25, 0.1)
MOMENTA = (0.3, 0.7, 0.9, 0.98, 1.05, 1.2, 1.4)  # n sin from inside
ALONG = tuple(np.linspace(0, GLASS - 0.02, 38).tolist())  # of the picture
SHOWN_ALPHAS = (0.05, 0.1, 0.3)
FAINT = 0.02  # share of light from which on shapes are compared
#: Interfaces and directions (not normalised) of Mitsuba's own tests of these plugins.
TESTED: tuple[tuple[str, dict[str, Any], tuple[tuple[float, float, float], ...]], ...] = (
    (
        "roughdielectric",
        {"eta": GLASS, "alpha": 0.5},
        ((0.8, 0.3, 0.05), (0.5, 0, 0.5), (0.5, 0.5, 0.001), (0.2, -0.6, -0.5), (0.8, 0.3, -0.05)),
    ),
    ("roughconductor", {**METAL, "alpha": (0.2, 0.05)}, ((1, 1, 1),)),
)
LEAST = 1e-4  # 1/sr, from which on single values are
#: Whether light comes from inside, and the side that it leaves to, as the page has it.
WAYS = {
    (False, "reflected"): "reflected",
    (False, "transmitted"): "passed",
    (True, "reflected"): "reflected inside",
    (True, "transmitted"): "passed from inside",
}


def interfaces() -> dict[str, Any]:
    """`rows` by plugin, roughness and side: total `variation` of values, in the mean over directions of incidence and
    the `worst`, the worst error of the `energy`, and total variation of the `density`. `smooth` has the worst errors of
    smooth interfaces; `inside`, see `_inside`."""
    kernel.mitsuba("llvm_ad_rgb")
    vt.register()
    rows = []
    for alpha in (*ALPHAS, BRUSHED):
        rows += list(_compared("roughconductor", _case(Interface(**METAL, alpha=alpha), COSINES)))
    for alpha in ALPHAS:
        inside = [-np.sqrt(1 - (p / GLASS) ** 2) for p in MOMENTA]
        rows += list(_compared("roughdielectric", _case(Interface(eta=GLASS, alpha=alpha), (*COSINES, *inside))))
    for plugin, values, directions in TESTED:
        rows += list(_compared(f"Mitsuba's tests, {plugin}", _lit(Interface(**values), np.array(directions))))
    for each in rows:
        remark = f"worst {each['worst']:.2g}; energy {each['energy']:.2g}; density {each['density']:.2g}"
        row("interfaces", each["name"], each["variation"], "", remark)
    momenta = np.array(ALONG)
    found = {str(alpha): _inside(alpha, momenta) for alpha in SHOWN_ALPHAS}
    for name, each in found.items():
        row("interfaces", f"from inside, alpha {name}, energy", each["energy"], "", f"times {each['scale']:.3g}")
        row("interfaces", f"from inside, alpha {name}, value", each["value"], "", f"n sin {each['value_at']:.2f}")
    return {"rows": rows, "inside": {"momenta": ALONG, **found}, "smooth": _smooth()}


def _case(interface: Interface, cosines: Any) -> benchmark.Case:
    z = np.array(cosines)
    azimuth = 0.5 * isinstance(interface.alpha, tuple)
    sine = np.sqrt(1 - z * z)
    return _lit(interface, np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z], axis=1))


def _lit(interface: Interface, directions: Array) -> benchmark.Case:
    incident = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return benchmark.Case("interface", "one interface", False, Stack([interface]), incident)


def _queried(case: benchmark.Case, pairs: Pairs) -> list[Any]:
    """Values and densities of ours and of Mitsuba's, each times the solid angles (keys, nodes)."""
    names, count = ("velatura", "rough-interface"), len(pairs.keys)
    bsdfs = [benchmark.entrant(name)(case) for name in names]
    probes = [probe_of(kernel.load_dict(bsdf) if isinstance(bsdf, Mapping) else bsdf) for bsdf in bsdfs]
    weight = pairs.weight.reshape(count, -1)
    found = []
    for probe in probes:
        value, pdf = probe.eval_pdf(pairs.wi, pairs.wo)
        found.append((value.reshape(count, -1, 3) * weight[..., None], pdf.reshape(count, -1) * weight))
    return found


def _compared(plugin: str, case: benchmark.Case) -> Iterator[dict[str, Any]]:
    pairs = Pairs.of(case)
    (ours, our_density), (theirs, density) = _queried(case, pairs)
    (interface,) = Material.of(case.stack).interfaces
    alpha = " by ".join(f"{x:g}".lstrip("0") for x in dict.fromkeys((interface.alpha_u, interface.alpha_v)))
    below = np.array([case.incident[direction][2] < 0 for direction, _ in pairs.keys])
    for (inside, side), words in WAYS.items():
        kept = (below == inside) & np.array([each == side for _, each in pairs.keys])
        lit = kept & (theirs.sum(axis=(1, 2)) > 3 * FAINT)
        if not lit.any():
            continue
        shape = _variation(ours[lit].mean(axis=-1), theirs[lit].mean(axis=-1))
        yield {
            "name": f"{plugin}, alpha {alpha}, {words}",
            "variation": float(shape.mean()),
            "worst": float(shape.max()),
            "energy": float(np.abs((ours - theirs)[kept].sum(axis=1)).max()),
            "density": float(_variation(our_density[lit], density[lit]).mean()),
        }


def _variation(ours: Array, theirs: Array) -> Array:
    """Total variation of values (keys, nodes)."""
    return np.asarray(0.5 * np.abs(ours - theirs).sum(axis=1) / theirs.sum(axis=1))


def _inside(alpha: float, momenta: Array) -> dict[str, Any]:
    """Light that glass passes from inside: energies, ours and Mitsuba's, over n sin, and the worst difference,
    `energy`; the `scale` of most values over Mitsuba's and of a single one, `value`, farthest from 1, where, and as a
    share of the greatest one there; and how far the former is from 1 `within` the critical angle."""
    case = _case(Interface(eta=GLASS, alpha=alpha), -np.sqrt(1 - (momenta / GLASS) ** 2))
    pairs = Pairs.of(case)
    (ours, _), (theirs, _) = _queried(case, pairs)
    passed = np.array([side == "transmitted" for _, side in pairs.keys])
    ours, theirs = ours[passed].mean(axis=-1), theirs[passed].mean(axis=-1)
    values = theirs / pairs.weight.reshape(len(pairs.keys), -1)[passed]
    bright = values > LEAST
    ratio = np.where(bright, ours / np.where(bright, theirs, 1.0), np.nan)
    usual = np.nanmedian(ratio, axis=1)
    farthest = np.unravel_index(np.nanargmax(np.abs(np.log(ratio))), ratio.shape)
    energies = ours.sum(axis=1), theirs.sum(axis=1)
    return {
        "ours": energies[0].tolist(),
        "mitsuba": energies[1].tolist(),
        "energy": float(np.abs(np.subtract(*energies)).max()),
        "scale": float(usual[np.abs(np.log(usual)).argmax()]),
        "scale_at": float(momenta[np.abs(np.log(usual)).argmax()]),
        "scale_within": float(np.abs(usual[momenta < 1] - 1).max()),
        "value": float(ratio[farthest]),
        "value_at": float(momenta[farthest[0]]),
        "value_of_peak": float(values[farthest] / values[farthest[0]].max()),
    }


def _smooth() -> dict[str, float]:
    """The worst errors of reflectances of smooth glass, from either side, and of gold."""
    mi = kernel.mitsuba()
    cosines = np.linspace(0.02, 1.0, 50)
    at = mi.Float(cosines)
    found = {}
    for name, n_1, n_2 in (("glass", 1.0, GLASS), ("glass, from inside", GLASS, 1.0)):
        ours = vt.lobes(Stack([Interface(eta=n_2, alpha=0)], exterior=n_1), cosines).energy[0][0]
        found[name] = float(np.abs(ours - np.array(mi.fresnel(at, n_2 / n_1)[0])).max())
    gold = vt.lobes(Stack([Interface(**METAL, alpha=0)]), cosines).energy[0]
    theirs = [np.array(mi.fresnel_conductor(at, mi.Complex2f(*index))) for index in zip(METAL["eta"], METAL["k"])]
    found["gold"] = float(np.abs(gold - np.array(theirs)).max())
    for name, worst in found.items():
        row("interfaces", f"smooth: {name}, worst", worst, "")
    return found


# Walks ---------------------------------------------------------------------------------------------------------------


def walks() -> dict[str, Any]:
    """Scores of the default model by kind of stacks, and of all, of each edition of the benchmark."""
    found: dict[str, Any] = {}
    for number in benchmark.EDITIONS:
        scores = benchmark.score(benchmark.entrant("velatura"), "velatura", edition=number)
        kinds = []
        for kind in (*scores.asked, None):
            each = scores.summary(kind)
            kept = {key: each[key] for key in ("records", "variation", "albedo", "worst_albedo")}
            kinds.append({"name": kind or f"all of edition {number}", **kept, "noise": each["floor"]})
            remark = f"noise {each['floor']:.2g}; albedo {kept['albedo']:.2g}, worst {kept['worst_albedo']:.2g}"
            row("walks", kinds[-1]["name"], kept["variation"], "", remark)
        found[str(number)] = kinds
    return found


# The page ------------------------------------------------------------------------------------------------------------

PARTS = {"media": media, "films": films, "interfaces": interfaces, "walks": walks}


def circumstances() -> dict[str, str]:
    """The date, the commit, and versions."""
    date = datetime.now(timezone.utc).date().isoformat()
    return {"date": date, "commit": bench.commit(), **{name: metadata.version(name) for name in PACKAGES}}


def write(folder: Path, found: dict[str, Any]) -> None:
    """Add parts to what a folder has, and draw all."""
    path = folder / f"{NAME}.json"
    numbers = (json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}) | found
    with files.whole(path) as unfinished:
        unfinished.write_text(json.dumps(_rounded(numbers), allow_nan=False) + "\n", encoding="utf-8")
    if numbers.keys() >= PARTS.keys():
        draw(numbers, folder / f"{NAME}.webp")


def _rounded(found: Any) -> Any:
    """Plain values of four digits."""
    if isinstance(found, Mapping):
        return {key: _rounded(value) for key, value in found.items()}
    if isinstance(found, list | tuple):
        return [_rounded(value) for value in found]
    return float(f"{found:.4g}") if isinstance(found, float) else found


@canvas.page(12, 9.5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Errors of media; reflectances of films; energies from inside; total variation against walks."""
    (of_media, of_films), (of_glass, of_walks) = figure.subplots(2, 2)
    for name, points in numbers["media"]["points"].items():
        truth, error = np.abs(np.array(points)).T
        of_media.scatter(np.maximum(truth, 1e-3), np.maximum(error, 1e-6), s=9, label=f"{name} ({len(truth)})")
    of_media.axhline(1e-3, color="black", linewidth=0.8)
    of_media.text(1.1e-3, 1.1e-3, "a tenth of a percent of the incident light", fontsize="x-small", va="bottom")
    of_media.set(xscale="log", yscale="log", ylim=(8e-7, 5e-3), xlabel="share of the incident light, by others",
                 ylabel="|error| of the model", title="a. Media: energies")  # fmt: skip
    of_media.legend(fontsize="x-small", loc="lower left")

    cosines = numbers["films"]["cosines"]
    for k, each in enumerate(numbers["films"]["shown"]):
        of_films.plot(cosines, each["ours"], color=f"C{k}", label=each["name"])
        of_films.plot(cosines[::2], each["tmm"][::2], "o", color=f"C{k}", markersize=3)
    of_films.set(xlabel="cosine of incidence", ylabel="reflectance", ylim=(0, 1),
                 title="b. Films at 550 nm: the model (lines), tmm (points)")  # fmt: skip
    of_films.legend(fontsize="x-small", loc="upper right")

    inside = numbers["interfaces"]["inside"]
    for k, alpha in enumerate(SHOWN_ALPHAS):
        of_glass.plot(inside["momenta"], inside[str(alpha)]["ours"], color=f"C{k}", label=f"alpha {alpha:g}")
        of_glass.plot(inside["momenta"], inside[str(alpha)]["mitsuba"], "o", color=f"C{k}", markersize=3)
    of_glass.axvline(1, color="black", linewidth=0.8, linestyle=":")
    of_glass.set(yscale="log", xlabel="n sin, from inside; critical angle at 1", ylabel="passed share of light",
                 title="c. Rough glass from inside: the model (lines), roughdielectric (points)")  # fmt: skip
    of_glass.legend(fontsize="small")

    kinds = [each for number in benchmark.EDITIONS for each in numbers["walks"][str(number)]]
    places = np.arange(len(kinds))[::-1]
    of_walks.barh(places, [each["variation"] for each in kinds], label="the model")
    of_walks.barh(places, [each["noise"] for each in kinds], height=0.35, label="what walks' noise makes of it")
    of_walks.set_yticks(places, [each["name"] for each in kinds], fontsize="xx-small")
    of_walks.set(xlabel="total variation", title="d. Stacks: light by direction, against random walks")
    of_walks.legend(fontsize="small")


def main() -> None:
    options = parsed(__doc__, parts=(list(PARTS), "", list(PARTS)), folder=(Path, "writes the numbers of the manual"))
    if options.folder:
        files.make_folder(options.folder)  # before anything slow begins
    found: dict[str, Any] = {}
    for name in options.parts:
        found[name] = PARTS[name]() | {"measured": circumstances()}
    if options.folder:
        write(options.folder, found)


if __name__ == "__main__":
    main()
