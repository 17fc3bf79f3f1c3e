"""Light of a solved side that is too wide for lobes: what lobes leave to waves of the azimuth, and how it is drawn.

In every direction waves take as much of the light as they have the shape of (`velatura.model.solved.lobes.wide`). The
first interface, which reflects as one facet does, keeps its lobe. Samples are those of all lobes still, and of what is
diffuse, shared anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from velatura import ops
from velatura.model.solved import sample_allocation
from velatura.model.solved.bsdf import SideView
from velatura.model.solved.columns import Columns
from velatura.model.solved.energies.energies import INCIDENCES, Energies
from velatura.model.solved.grid import Folded, Listed
from velatura.model.solved.lobes import wide
from velatura.model.solved.transmission import direct, forward, internal_reflections
from velatura.model.solved.transmission.combined import Parts
from velatura.model.solved.transmission.direct import Transmission
from velatura.optics.ggx import Direction
from velatura.renderer import low_discrepancy

Array = NDArray[np.floating]
View = Callable[[NDArray[np.integer]], tuple[SideView, Direction]]

EVENLY = 144  # directions of each side at which samples are looked at
STEEP = 0.1  # sine of light below which samples crowd less
CROWDED_MOST = 0.8  # share of the momentum of light, about which samples crowd
FORWARD = np.linspace(0, CROWDED_MOST, 17)


def cosines(folded: Folded | Listed) -> Array:
    """Cosines of light at which its waves are known: first the one from which these are extended to the normal."""
    return np.concatenate([[np.sqrt(1 - wide.STEEP**2)], folded.at_cosines[2]])


def columns(
    found: Columns,
    share: float,
    of_straight: float,
    inner: Sequence[bool],
    light: Energies,
    transmission: Transmission,
    folded: Folded | Listed,
) -> tuple[Columns, Array]:
    """Columns of a side of which waves have a share of the light at most, and what they have (M,), of what is reflected
    or of what passes, whichever is more. Numbers are known where waves have nothing, too. Of what goes straight through
    waves have the share `of_straight` that they have of all that passes.

    `inner` says of each lobe whether it is of another interface than the first. `light` is known at `cosines` after
    `INCIDENCES`, and its `passing` has that share of what goes straight through.
    """
    assert found.passes and found.passed is not None
    beyond, passing = (ops.mean(each)[..., len(INCIDENCES) :] for each in (light.beyond, light.passing))
    z = cosines(folded)
    wi = np.sqrt(1 - z * z), 0 * z, z
    bound = float(ops.mean(internal_reflections.bound(transmission)))
    reflected, back = wide.fit(light.nodes, beyond, 1.0, wi[0])
    passed, through = wide.fit(light.nodes, passing, bound, internal_reflections.seen_below(transmission, wi)[0])
    back, through = (share * folded.around(each) for each in (back, through))
    handed = sum((energy for energy, each in zip(found.energies, inner) if each), 0 * found.rest)
    energy = found.passed
    if of_straight < 1:
        kept = (1 - of_straight) * found.passes.straight
        energy = np.maximum(energy - kept * direct.integrals(transmission, folded.directions)[0], 0)
    crowded = folded.around(_forward(passed, internal_reflections.seen_below(transmission, folded.at_cosines)))
    narrowed = replace(
        found,
        passes=replace(found.passes, narrow=1 - through, faceted=1 - of_straight * through, forward=through * crowded),
        narrow=1 - back,
        wide_reflected=[found.rest + handed, *folded.around(reflected)],
        wide_passed=[energy, *folded.around(passed)],
    )
    return narrowed, np.maximum(back, through)


def none(found: Columns) -> Columns:
    """Columns of a side without such light, in the declaration of sides that have some."""
    assert found.passes
    nothing, whole = [0 * found.rest, *[0 * found.chance] * wide.COUNT], 0 * found.chance + 1
    passes = replace(found.passes, forward=0 * found.chance, narrow=whole, faceted=whole)
    return replace(found, passes=passes, narrow=whole, wide_reflected=nothing, wide_passed=nothing)


def _forward(numbers: Array, i: Direction) -> Array:
    """Shares (M,) of the momentum of light from directions i (M,), about which samples have the same mean momentum as
    light that passes by numbers (COUNT, M)."""
    x, y, z = low_discrepancy.even_in_projection(EVENLY)
    length = np.hypot(i[0], i[1])
    lit = wide.density([*numbers[..., None]], (length[:, None], 0 * x, i[2][:, None]), (x, y, z))
    known = [forward.moved(float(share), (-1.0, 0.0, 0.0), (x, y, z))[0].mean() for share in FORWARD]
    shares = np.interp((lit * -x).mean(axis=-1), known, FORWARD) / np.maximum(length, STEEP)
    return np.minimum(shares, CROWDED_MOST)


def shared(found: Columns, shares: Array, view: View, folded: Folded | Listed) -> Columns:
    """Columns with samples of what passes, and of the remainder, shared anew, lobes included, as far as light is wide,
    by `shares` (M,); what light from directions sees is in `view`."""
    passes = found.passes
    assert passes
    # Azimuths hardly matter where light is wide
    cosine = folded.around(np.arange(float(len(folded.at_cosines[2])))).astype(int)
    first = np.unique(cosine, return_index=True)[1]
    x, y, z = (np.tile(each, len(first)) for each in low_discrepancy.even_in_projection(EVENLY))
    of, i = view(np.repeat(first, EVENLY))
    assert of.columns.passes and of.transmission
    alone = {name: row[:, None] for name, row in zip(Parts.CHANCES, np.eye(len(Parts.CHANCES)))}
    each = replace(of, columns=replace(of.columns, passes=replace(of.columns.passes, **alone)))
    parts = [of.part(k, i, (x, y, z)) for k in range(len(of.chances))]
    through, passed = each.through(i, (x, y, -z))
    # On the side of the light are samples of what passes that facets reflect
    mirrored = alone["of_straight"] * direct.eval_pdf(of.transmission, i, (x, y, z))[1]
    values = sum(value for value, _ in parts), through
    kept = sum(chance * density for chance, (_, density) in zip(of.columns.chances, parts)), 0 * z
    densities = [*((density, 0 * z) for _, density in parts), *zip(mirrored, passed)]

    def both(above: Array, below: Array) -> Array:
        return np.concatenate([np.reshape(values, (len(first), -1)) for values in (above, below)], axis=-1)

    wanted = both(*(np.reshape(value, (-1, len(z))).max(axis=0) for value in values))
    # Lobes may have more samples, not less: they may be narrower than directions are dense
    others = [found.chance, *(getattr(passes, name) for name in Parts.CHANCES)]
    before = np.array([*(0 * chance for chance in found.chances), *others])
    each_side = np.array([both(*density) for density in densities])
    after = sample_allocation.evened(wanted, both(*kept), each_side, before[:, first])
    after = ops.divide(after, after.sum(axis=0))[:, cosine] * before.sum(axis=0)
    of_lobes, (chance, *passing) = np.split(before + shares * (after - before), [len(found.chances)])
    chances = [own + more for own, more in zip(found.chances, of_lobes)]
    return replace(found, chances=chances, chance=chance, passes=replace(passes, **dict(zip(Parts.CHANCES, passing))))
