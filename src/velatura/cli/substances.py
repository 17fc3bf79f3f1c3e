"""`velatura substances`: the measured indices that a material may name."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.cli import options
from velatura.errors import InvalidInput

if TYPE_CHECKING:
    from velatura.stack import Measured
    from velatura.stack.substances import Entry


def substances(
    word: Annotated[
        str | None, typer.Argument(metavar="[WORD]", help="A part of a name or of a source: gold, Palik, steel.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """List indices by name, and pages of refractiveindex.info.

    Each with the range of its wavelengths and its source, and metals with the colour of a bare mirror along the normal,
    in sRGB. Names such as Au stand in a material file as conductor or eta, pages such as main/Au/Johnson in eta:
    {refractiveindex: PAGE}. VELATURA_REFRACTIVEINDEX may name the folder of a copy of that database, in all of which
    WORD is then searched.
    """
    rows = [*_named(word or ""), *pages(word or "")]
    if as_json:
        print(json.dumps(rows, ensure_ascii=False))
        return
    width = max((len(row["name"]) for row in rows), default=0)
    for row in rows:
        nm = "-".join(f"{end:.0f}" for end in row["range_nm"])
        source = "; ".join(filter(None, (row["substance"], row["source"])))
        print(f"{row['name']:{width}}  {nm:>10} nm  {row['colour'] or '':7}  {source}")


def _named(word: str) -> Iterator[dict[str, Any]]:
    """The names that need no page."""
    from velatura.stack import Named, names, spectra, spectrum

    metals, dielectrics = names()
    for name in (*metals, *dielectrics):
        if name in spectra.ALIASES:
            continue
        others = ", ".join(alias for alias, target in spectra.ALIASES.items() if target == name)
        eta, source = Named(name, "eta"), spectra.source(name)
        if word.lower() in f"{name} {others} {source}".lower():
            wavelengths_nm = spectrum(eta)[0]
            colour = _mirror(eta, Named(name, "k")) if name in metals else None
            yield _row(name, others, (wavelengths_nm[0], wavelengths_nm[-1]), source, colour)


def pages(word: str = "") -> Iterator[dict[str, Any]]:
    """The pages of the package; those of a copy, too, where a word is searched."""
    from velatura.stack import substances

    entries = substances.entries() if word else substances.catalog(substances.PACKAGED)
    for name, entry in entries.items():
        if word.lower() in f"{name} {entry.book} {entry.title}".lower():
            try:
                yield _page(name, entry)
            except InvalidInput as error:  # the others can be read
                yield _row(name, entry.book, (), str(error), None)


def _page(name: str, entry: Entry) -> dict[str, Any]:
    from velatura.stack import Substance, substances

    page, eta = substances.page(name), Substance(refractiveindex=name)
    curve = page.n or page.k
    assert curve
    colour = _mirror(eta, eta.of("k")) if page.n and page.opaque else None
    return _row(name, entry.book, [um * 1e3 for um in curve.range_um], entry.title, colour)


def _row(name: str, substance: str, range_nm: Sequence[float], source: str, colour: str | None) -> dict[str, Any]:
    nm = [round(float(end), 3) for end in range_nm]
    return {"name": name, "substance": substance, "range_nm": nm, "source": source, "colour": colour}


def _mirror(eta: Measured, k: Measured) -> str:
    """The colour of a bare mirror along the normal, under D65, as #rrggbb of sRGB."""
    import numpy as np

    from velatura.optics import fresnel
    from velatura.scenes.views import srgb_curve
    from velatura.stack import spectrum, srgb_weights

    wavelengths_nm, weights = srgb_weights()
    index = (np.interp(wavelengths_nm, *spectrum(part)) for part in (eta, k))
    linear = weights @ fresnel.conductor(1.0, *index)
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in srgb_curve(linear).tolist())
