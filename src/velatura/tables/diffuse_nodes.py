"""Light by parts of the directions in a medium, and its scattering by rough interfaces, for diffuse light.

Light of direction theta in a medium of index n, relative to that outside, has the tangential momentum p = n sin(theta),
which Snell's law leaves alone: up to p = 1 it may leave a smooth stack, beyond it is trapped. A function of direction
is a polynomial in p^2 on the one side, and one in the cosine on the other, known by its values at Gauss's nodes for
projected solid angle. A distribution of light is known by its means of the Lagrange polynomials of these nodes, its
parts; some may be negative.

entering    over cosine, roughness and n: of light that comes in from outside, the part in each node below
returning   over roughness and n: of light from each node below, the part in each node that comes back from outside
passing     over roughness, n above and n below over n above: from each node above, the part in each node below
staying     likewise: the part in each node above, of what is reflected
"""

from __future__ import annotations

from collections.abc import Sequence

from velatura import ops
from velatura.ops import Value
from velatura.tables import coordinates
from velatura.tables.store import Table, Tables

# Nodes and weights on [0, 1]: of Gauss and Legendre in p^2, of Gauss and Jacobi, for the weight 2c, in the cosine over
# that at p = 1
OPEN = (0.1127016653792583, 0.5, 0.8872983346207417)
OPEN_WEIGHTS = (5 / 18, 8 / 18, 5 / 18)
TRAPPED = (0.1397598643437806, 0.4164095676310831, 0.7231569863618761, 0.9428958038854822)
TRAPPED_WEIGHTS = (0.0623619419000162, 0.2596950952164651, 0.4069291360205424, 0.2710138268629762)
COUNT = len(OPEN) + len(TRAPPED)


def node_cosines(n: Value) -> list[Value]:
    """Cosines of the nodes in a medium of index n."""
    edge = edge_cosine(n)
    return [*(ops.sqrt(1 - p2 / (n * n)) for p2 in OPEN), *(edge * c for c in TRAPPED)]


def even(n: Value) -> list[Value]:
    """Parts of light that comes evenly from all directions; their sum is 1."""
    share = ops.minimum(1 / (n * n), 1.0)
    return [*(share * w for w in OPEN_WEIGHTS), *((1 - share) * w for w in TRAPPED_WEIGHTS)]


def edge_cosine(n: Value) -> Value:
    """Cosine at p = 1."""
    return ops.sqrt(1 - 1 / (n * n))


def entering(tables: Tables, cos_theta: Value, alpha: Value, n: Value) -> list[Value]:
    """Parts of the light that comes in; their sum is 1."""
    return ops.interpolate(tables.entering, cos_theta, coordinates.from_roughness(alpha), coordinates.from_index(n))


def returning(tables: Tables, alpha: Value, n: Value) -> list[list[Value]]:
    """Parts of the light from each node that the first interface sends back."""
    return _rows(ops.interpolate(tables.returning, coordinates.from_roughness(alpha), coordinates.from_index(n)))


def between(table: Table, alpha: Value, n: Value, ratio: Value) -> list[list[Value]]:
    """Parts of the light from each node on one side of an interface, `passing` or `staying`.

    n is the index on that side, `ratio` the other one over it.
    """
    place = coordinates.from_roughness(alpha), coordinates.from_index(n), coordinates.from_ratio(ratio)
    return _rows(ops.interpolate(table, *place))


def _rows(channels: Sequence[Value]) -> list[list[Value]]:
    return [list(channels[k * COUNT : (k + 1) * COUNT]) for k in range(COUNT)]
