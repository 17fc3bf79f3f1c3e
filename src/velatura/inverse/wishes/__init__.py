"""Wishes beyond lobes at normal incidence: each kind a file, and `KINDS`, by their keys in a target."""

from velatura.inverse.wishes.available import Available
from velatura.inverse.wishes.body import Body
from velatura.inverse.wishes.film import FilmColour
from velatura.inverse.wishes.grazing import Grazing
from velatura.inverse.wishes.mixture import MixtureColour
from velatura.inverse.wishes.passed import Passed
from velatura.inverse.wishes.wish import Lacking, Wish, Wished

KINDS: dict[str, type[Wish]] = {
    "grazing": Grazing,
    "passed": Passed,
    "body": Body,
    "film": FilmColour,
    "mixture": MixtureColour,
}

__all__ = [
    "KINDS",
    "Available",
    "Body",
    "FilmColour",
    "Grazing",
    "Lacking",
    "MixtureColour",
    "Passed",
    "Wish",
    "Wished",
]
