"""How far the colours of coated metals in RGB variants are from those of the whole spectrum, in percent.

    python benchmarks/metals.py [--metals Cu Au TiN alloy] [--coats 7] [--walks 0]

Metals of alpha .1 to .4, bare and below smooth and rough coats of index 1.33 to 1.8, at cosines .9 to .2. Expected
energies are those at 95 wavelengths, each solved by itself, in linear sRGB (CIE 1931, D65). They stand against those of
the metal by its name, by one eta and one k a channel, and, with as many `--walks` from each direction, random walks:
those in RGB, and those of single wavelengths. `alloy` is a table, halfway between copper and gold, in place of brass.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rows import parsed, row

import velatura as vt
from velatura.reference import statistics
from velatura.stack import Interface, Measured, MeasuredIndex, Spectrum, Stack, rgb, spectrum, srgb_weights

Array = NDArray[np.floating]
Coat = tuple[float, float] | None  # index and alpha

METALS = ("Cu", "Au", "TiN", "alloy")
ALPHAS = (0.1, 0.2, 0.4)
COATS = (None, (1.33, 0.0), (1.33, 0.2), (1.5, 0.0), (1.5, 0.3), (1.8, 0.0), (1.8, 0.3))
COSINES = (0.9, 0.7, 0.45, 0.2)
WALKED = ((1.5, 0.3), (1.8, 0.0))  # coats
NM, WEIGHTS = srgb_weights()


def index(metal: str, folder: Path) -> dict[str, Any]:
    """Keys of an interface of that metal."""
    if metal != "alloy":
        return {"conductor": metal}
    both = [Interface(conductor=name).measured for name in ("Cu", "Au")]
    found = {}
    for part in ("eta", "k"):
        values = np.mean([np.interp(NM, *spectrum(getattr(each, part))) for each in both], axis=0)
        file = folder / f"{part}.spd"
        file.write_text("\n".join(f"{nm} {value}" for nm, value in zip(NM, values)), encoding="utf-8")
        found[part] = Spectrum(spectrum=file)
    return found


def coated(coat: Coat, **metal: Any) -> Stack:
    above = [Interface(eta=coat[0], alpha=coat[1])] if coat else []
    return Stack([*above, Interface(**metal)])


def solved(stack: Stack) -> Array:
    """Light that it reflects, (3, cosines)."""
    found = vt.lobes(stack, COSINES)
    return np.asarray(sum(found.energy) + found.remainder)


def walked(stack: Stack, paths: int, seed: int) -> tuple[Array, Array]:
    """The same by walks, and its standard error."""
    found = statistics(stack, COSINES, paths=paths, seed=seed, microsurface=True)
    assert found.standard_error
    return np.sum(found.energy, axis=0), np.sqrt(np.sum(np.square(found.standard_error.energy), axis=0))


def by_wavelength(coat: Coat, alpha: float, measured: MeasuredIndex) -> Iterator[Stack]:
    """Stacks whose channels are three wavelengths each, the last one repeated."""
    eta, k = (np.interp(NM, *spectrum(part)) for part in (measured.eta, measured.k))
    for start in range(0, len(NM), 3):
        three = np.minimum(np.arange(start, start + 3), len(NM) - 1)
        yield coated(coat, eta=tuple(eta[three]), k=tuple(k[three]), alpha=alpha)


def joined(found: list[Array]) -> Array:
    """Light of all wavelengths as channels."""
    return np.asarray(WEIGHTS @ np.concatenate(found)[: len(NM)])


def report(name: str, errors: list[Array], remark: str = "") -> None:
    """A row of relative errors (3, cosines) of several stacks, with the worst one of each channel."""
    percent = 100 * np.abs(errors)
    worst = ", ".join(f"{channel} {x:.2g}" for channel, x in zip(("red", "green", "blue"), percent.max(axis=(0, 2))))
    row("metals", name, percent.ravel().tolist(), "%", f"worst {worst}{remark}")


def main() -> None:
    options = parsed(
        __doc__,
        metals=list(METALS),
        coats=(len(COATS), "of the list, from none on"),
        walks=(0, "paths from each direction"),
    )
    with tempfile.TemporaryDirectory() as folder:
        for metal in options.metals:
            measure(metal, index(metal, Path(folder)), COATS[: options.coats], options.walks)


def measure(metal: str, keys: dict[str, Any], coats: Sequence[Coat], paths: int) -> None:
    measured = Interface(**keys).measured
    assert measured
    parts: dict[str, Measured] = vars(measured)
    plain = {part: rgb(each) for part, each in parts.items()}
    whole: dict[str, list[Array]] = {"by its spectrum": [], "by one eta and k a channel": []}
    for coat in coats:
        for alpha in ALPHAS:
            expected = joined([solved(stack) for stack in by_wavelength(coat, alpha, measured)])
            for found, of in zip(whole.values(), (keys, plain)):
                found.append(solved(coated(coat, **of, alpha=alpha)) / expected - 1)
    for name, errors in whole.items():
        for what, chosen in (("bare", errors[: len(ALPHAS)]), ("coated", errors[len(ALPHAS) :])):
            report(f"{metal}, {what}, {name}", chosen)
    if not paths:
        return
    against: dict[str, list[Array]] = {"walk in RGB": [], "model": []}
    noise = 0.0
    for coat in WALKED:
        for alpha in (ALPHAS[0], ALPHAS[-1]):
            stack, stacks = coated(coat, **keys, alpha=alpha), by_wavelength(coat, alpha, measured)
            expected = joined([walked(each, paths // 4, seed)[0] for seed, each in enumerate(stacks, start=1)])
            in_rgb, error = walked(stack, paths, 0)
            noise = max(noise, float((error / in_rgb).max()))
            against["walk in RGB"].append(in_rgb / expected - 1)
            against["model"].append(solved(stack) / expected - 1)
    for name, errors in against.items():
        report(f"{metal}, {name} over walks of wavelengths", errors, f"; standard error {100 * noise:.2g} at most")


if __name__ == "__main__":
    main()
