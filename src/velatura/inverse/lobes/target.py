"""Targets: lobes from the top, each by its energy and its blur, and the constraints on the answer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import model_validator

from velatura.errors import InvalidInput, within
from velatura.inverse.wishes import KINDS, Available, Body, FilmColour, Grazing, MixtureColour, Passed, Wish, Wished
from velatura.model.roughness_maps import MAPS, RoughnessMap
from velatura.model.variance import Covariance, Isotropic, PerAxis, Roughness, Variance
from velatura.stack import RGB, Mix, Stack, io
from velatura.stack.mix import Described
from velatura.stack.schema import Parameter, Record, Taken, by_default, show
from velatura.stack.values import (
    INDEX_HIGH,
    INDEX_LOW,
    Choice,
    Colour,
    Film,
    Films,
    NumberLike,
    NumbersLike,
    Pair,
    Scalar,
    Text,
    Whole,
)

BLUR = MAPS["belcour"]  # in whose space a target's variance is given
KEPT = 1e-6  # by which what is fixed may be missed
ROUND = 1e-6  # difference of roughnesses of a lobe that has no axes
FURTHER = (*KINDS, "available", "thinnest")  # keys that ask for more than lobes
LEAST = 1e-4  # energy or variance below which targets do not differ
MOST_INTERFACES = 3  # of a lobe


@dataclass(frozen=True)
class Count(Whole):
    """One of few whole numbers."""

    @property
    def values(self) -> str:
        *others, last = map(str, range(self.low, self.high + 1))
        return f"{', '.join(others)} or {last}"


@dataclass(frozen=True)
class Entries(Parameter):
    """A list with a value or null for each interface of a lobe."""

    entry: Parameter = field(default_factory=lambda: Scalar(""))

    @property
    def values(self) -> str:
        return f"a list that holds for each interface null or {self.entry.values}"

    def check(self, value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise self.refuse(value)
        return tuple(None if entry is None else self.entry.check(entry) for entry in value)


@dataclass(frozen=True)
class Start(Parameter):
    """A material, or the name of a preset; no file, since a target may be a stranger's."""

    @property
    def values(self) -> str:
        return "a material, or the name of a preset"

    def check(self, value: Any) -> Described:
        if not isinstance(value, Stack | Mix | Mapping | str):
            raise self.refuse(value)
        try:
            return io.preset(value) if isinstance(value, str) else io.load(value)
        except InvalidInput as error:
            raise ValueError(str(error)) from None


def _number(doc: str, low: float = 0.0, **options: Any) -> Scalar:
    return Scalar(doc, low=low, texturable=False, differentiable=False, **options)


def _pair(doc: str, **options: Any) -> Pair:
    return Pair(doc, low=0.0, texturable=False, differentiable=False, **options)


def _colour(doc: str, low: float = 0.0, **options: Any) -> Colour:
    return Colour(doc, low=low, texturable=False, differentiable=False, **options)


class Fixed(Record):
    """Parameters that are held fixed: an entry for each interface of the lobe, from the top, null where free."""

    holds = "keys and lists"

    eta: Annotated[tuple[Any, ...], Entries("absolute indices", entry=_colour("", INDEX_LOW, high=INDEX_HIGH))] = ()
    k: Annotated[tuple[Any, ...], Entries("absolute extinctions", entry=_colour("", high=INDEX_HIGH))] = ()
    alpha: Annotated[tuple[Any, ...], Entries("GGX roughnesses", entry=_number("", high=1.0))] = ()
    tau: Annotated[tuple[Any, ...], Entries("optical depths of the media above", entry=_colour(""))] = ()
    films: Annotated[tuple[Any, ...], Entries("thin films, each interface's from the top", entry=Films(""))] = ()

    def films_of(self, interface: int) -> tuple[Film, ...]:
        """The thin films on an interface of the lobe, from the top."""
        found: tuple[Film, ...] = self.of("films", interface) or ()
        return found

    @property
    def films_alone(self) -> Fixed:
        """The films, with nothing else fixed."""
        return Fixed(films=self.films)

    def kept(self, interface: int, part: Any) -> bool:
        """Whether an interface with the medium above it (`Layers`) has what is fixed of an interface of the lobe."""
        has = {"eta": part.eta, "k": part.kappa, "alpha": part.roughness[:2], "tau": part.tau}
        asked = {key: self.of(key, interface) for key in has}
        apart = [np.abs(np.ravel(has[key]) - np.ravel(x)).max() for key, x in asked.items() if x is not None]
        return self.of("films", interface) in (None, part.films) and all(x <= KEPT for x in apart)

    def of(self, key: str, interface: int) -> Any:
        """The value that an interface of the lobe must keep, None where it is free."""
        entries = getattr(self, key)
        return entries[interface] if entries else None


class TargetLobe(Record):
    """A lobe: its energy, its blur (`alpha`, or `variance` in the space of Belcour's map), and its interfaces.

    The blur is a number, or two along axes that are turned by `rotation`.
    """

    energy: Annotated[Taken[NumberLike | NumbersLike, float | RGB], _colour("energy at normal incidence")]
    alpha: Annotated[
        Taken[NumberLike | NumbersLike | None, float | tuple[float, float] | None],
        _pair("GGX roughness of the lobe", high=1.0),
    ] = by_default(None)
    variance: Annotated[
        Taken[NumberLike | NumbersLike | None, float | tuple[float, float] | None],
        _pair("variance of the lobe, in place of alpha"),
    ] = by_default(None)
    rotation: Annotated[
        float, _number("turn of its first axis, anticlockwise seen from outside", low=-1e9, unit="degrees")
    ] = 0.0
    interfaces: Annotated[int, Count("interfaces that make the lobe", low=1, high=MOST_INTERFACES)] = 1
    base: Annotated[str, Choice("what its last interface is", options=("dielectric", "conductor", "mirror"))] = (
        "dielectric"
    )
    tint: Annotated[
        float, _number("of a conductor: from the strongest edge tint (0) to the strongest extinction", high=1.0)
    ] = 0.5
    fixed: Fixed = Fixed()

    def __init__(self, /, **fields: Any) -> None:
        kept = fields.get("fixed")
        if kept is not None and not isinstance(kept, Fixed):
            with within("fixed"):
                fields["fixed"] = Fixed.from_dict(kept)
        super().__init__(**fields)

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> TargetLobe:
        if self.alpha is not None and self.variance is not None:
            raise ValueError("variance: not together with alpha; write one of them")
        for key, entries in self.fixed:
            if entries and len(entries) != self.interfaces:
                wanted = f"must hold an entry for each interface, {self.interfaces}, got {len(entries)}"
                raise ValueError(f"fixed: {key}: {wanted}")
        if self.base == "mirror" and self.fixed.of("eta", self.interfaces - 1) is not None:
            raise ValueError("fixed: eta: a mirror has none")
        dielectrics = self.interfaces - (self.base != "dielectric")
        for n in range(self.interfaces if self.base == "mirror" else dielectrics):
            if self.fixed.of("k", n) is not None:
                raise ValueError("fixed: k: only for the last interface of a lobe with base: conductor")
            if isinstance(self.fixed.of("eta", n), tuple):
                raise ValueError("fixed: eta: of a dielectric must be one number for all channels")
        for n in range(self.interfaces):
            self._check_films(n, self.fixed.films_of(n), dielectric=n < dielectrics)
        return self

    def _check_films(self, n: int, films: tuple[Film, ...], dielectric: bool) -> None:
        for m, film in enumerate(films):
            where = f"fixed: films: interface {n}, film {m}"
            if self.base == "mirror" and not dielectric:
                raise ValueError(f"{where}: not on a mirror, which reflects all light")
            if film.varying:
                raise ValueError(f"{where}: {film.varying}: must be no texture, since a lobe is that of one point")

    @property
    def axes(self) -> Roughness:
        """GGX roughness along both axes."""
        given = (self.alpha or 0.0) if self.variance is None else self.variance
        u, v = given if isinstance(given, tuple) else (given, given)
        if self.variance is not None:
            u, v = float(BLUR.roughness(u)), float(BLUR.roughness(v))
        return Roughness(u, v, float(np.radians(self.rotation)))

    @property
    def brushed(self) -> bool:
        """Whether the lobe has two roughnesses."""
        return bool(abs(self.axes.alpha_u - self.axes.alpha_v) > ROUND)

    @property
    def roughness(self) -> float:
        """GGX roughness of the lobe; of one with axes that of their mean variance."""
        u, v, _ = self.axes
        return u if not self.brushed else float(BLUR.roughness((BLUR.variance(u) + BLUR.variance(v)) / 2))

    @property
    def fixes_last(self) -> bool:
        """Whether its last interface, or the medium above that, keeps a value other than its roughness."""
        return any(self.fixed.of(key, self.interfaces - 1) is not None for key in ("eta", "k", "tau"))

    def pinned(self, first: bool) -> bool:
        """Whether more is fixed than a drag keeps anyway: media above the first lobe and of pairs, their index."""
        last = self.interfaces - 1
        pins = [("eta", last), ("k", last), *(("alpha", n) for n in range(self.interfaces))]
        pins += [("tau", last)] if last or not first else []
        return any(self.fixed.of(key, n) is not None for key, n in pins)

    def below(self, count: int, energy: Iterable[float]) -> TargetLobe:
        """The rest of the lobe, with an energy, below the first `count` of its interfaces."""
        fixed = {key: entries[count:] for key, entries in self.fixed}
        left = {"interfaces": self.interfaces - count, "energy": tuple(energy), "fixed": Fixed(**fixed)}
        return self.model_copy(update=left)

    def blur(self, f: RoughnessMap, kind: type[Variance]) -> Variance:
        """The variance of the lobe, (1,) each, of a kind that holds it, in the space of a roughness map."""
        s = kind.of(self.axes, f)
        return kind(*(np.atleast_1d(np.asarray(x, float)) for x in vars(s).values()))

    @property
    def colour(self) -> RGB:
        """Energy of the three channels."""
        return self.energy if isinstance(self.energy, tuple) else (self.energy,) * 3


class Target(Record):
    """Lobes from the top down, frozen and validated.

    Raises:
        InvalidInput: in one line that names lobe, key and allowed range.
    """

    holds = "the keys of a target, lobes above all"

    name: Annotated[str, Text("name of the material")] = ""
    exterior: Annotated[float, _number("absolute index of refraction above", INDEX_LOW, high=INDEX_HIGH)] = 1.0
    eta_max: Annotated[float, _number("largest index of a dielectric", low=1.0, high=INDEX_HIGH, strict=True)] = 4.0
    channels: Annotated[
        str | None,
        Choice("one variance for all colours or the brightest one's; else the model's", options=("mean", "separate")),
    ] = None
    lobes: tuple[TargetLobe, ...]
    start: Annotated[Stack | Mix | None, Start("material that the search begins with, of as many interfaces")] = None
    grazing: Annotated[tuple[Grazing, ...], Wished("at a second angle", record=Grazing)] = ()
    passed: Annotated[tuple[Passed, ...], Wished("of what passes", record=Passed)] = ()
    body: Annotated[tuple[Body, ...], Wished("of a diffuse base or a medium that scatters", record=Body)] = ()
    film: Annotated[tuple[FilmColour, ...], Wished("of the colour of a film", record=FilmColour, most=1)] = ()
    mixture: Annotated[tuple[MixtureColour, ...], Wished("of the colour of a mixture", record=MixtureColour)] = ()
    available: Annotated[tuple[Any, ...], Available("substances that interfaces may lie above")] = ()
    thinnest: Annotated[float, _number("the least depth of a medium")] = 0.0

    def __init__(self, /, lobes: Iterable[TargetLobe | Mapping[str, Any]] = (), **options: Any) -> None:
        if isinstance(lobes, str | Mapping) or not isinstance(lobes, Iterable):
            raise InvalidInput(f"lobes: must be a list of lobes, got {show(lobes)}")
        super().__init__(lobes=tuple(_lobe(n, entry) for n, entry in enumerate(lobes, 1)), **options)

    @model_validator(mode="after")
    def _lobes_fit_together(self) -> Target:
        if not self.lobes and not (self.beyond_lobes and self.start):
            other = "; without any, write a start" if self.beyond_lobes else f", or {', '.join(FURTHER)} with a start"
            raise ValueError(f"lobes: must hold at least one lobe{other}")
        if isinstance(self.start, Mix) and (self.lobes or self.beyond_lobes != (MixtureColour.key,)):
            raise ValueError(
                "start: the inverse takes a single stack, not a mixture, of which only mixture may be asked"
            )
        for n, lobe in enumerate(self.lobes[:-1], 1):
            if lobe.base != "dielectric":
                raise ValueError(f"lobe {n}: base: only the last lobe may have a {lobe.base}, nothing lies below it")
        for wish in self.grazing if self.lobes else ():
            if wish.lobe is not None and wish.lobe > len(self.lobes):
                raise ValueError(f"grazing: lobe: the target has {len(self.lobes)}, got {wish.lobe}")
        wanted = sum(lobe.interfaces for lobe in self.lobes)
        if self.lobes and isinstance(self.start, Stack) and len(self.start.interfaces) != wanted:
            found = len(self.start.interfaces)
            raise ValueError(f"start: must have as many interfaces as the lobes, {wanted}, got {found}")
        return self

    @property
    def beyond_lobes(self) -> tuple[str, ...]:
        """Keys that ask for more than lobes."""
        return tuple(key for key in FURTHER if getattr(self, key))

    def of_lobes(self) -> Target:
        """This target, which asks for lobes alone. Raises InvalidInput where it asks for more."""
        if self.beyond_lobes:
            raise InvalidInput(
                f"{self.beyond_lobes[0]}: is no wish for lobes; velatura invert and vt.inverse.answer take it"
            )
        return self

    @property
    def nearest(self) -> bool:
        """Whether the nearest stack is the answer, however far: thicknesses and substances have few looks."""
        return bool(self.film or self.available)

    @property
    def further(self) -> tuple[Wish, ...]:
        """Wishes beyond lobes at normal incidence."""
        return tuple(wish for key in KINDS for wish in getattr(self, key))

    @property
    def kind(self) -> type[Variance]:
        """The cheapest kind of variance that holds all lobes."""
        return kind_of(lobe.axes for lobe in self.lobes)

    @property
    def brightness(self) -> float:
        """The energy of all lobes, in the brightest colour."""
        return float(np.sum([lobe.colour for lobe in self.lobes], axis=0).max())

    @property
    def pinned(self) -> bool:
        """Whether more is fixed of any lobe than a drag keeps anyway."""
        return any(lobe.pinned(first=n == 0) for n, lobe in enumerate(self.lobes))

    def kept(self, layers: Iterable[Any]) -> bool:
        """Whether interfaces (`Layers`), from the top, have all values that are fixed."""
        places = ((lobe, n) for lobe in self.lobes for n in range(lobe.interfaces))
        return all(lobe.fixed.kept(n, part) for (lobe, n), part in zip(places, layers))

    @property
    def has_films(self) -> bool:
        """Whether an interface has thin films."""
        return any(lobe.fixed.films_of(n) for lobe in self.lobes for n in range(lobe.interfaces))

    def with_lobe(self, index: int, **changes: Any) -> Target:
        """This target with some values of one lobe changed."""
        lobes = list(self.lobes)
        lobes[index] = lobes[index].model_copy(update=changes)
        return self.model_copy(update={"lobes": tuple(lobes)})

    def freed(self, films: bool = False) -> Target:
        """This target with nothing fixed, or `films` alone."""
        found = self
        for n, lobe in enumerate(self.lobes):
            found = found.with_lobe(n, fixed=lobe.fixed.films_alone if films else Fixed())
        return found

    def with_energy(self, index: int, colour: Iterable[float]) -> Target:
        """This target with another energy of one lobe, a number where it is grey."""
        r, g, b = map(float, colour)
        return self.with_lobe(index, energy=r if r == g == b else (r, g, b))

    def with_variance(self, index: int, variance: float) -> Target:
        """This target with another mean variance of one lobe, whose axes stay in proportion."""
        lobe = self.lobes[index]
        if not lobe.brushed:
            return self.with_lobe(index, alpha=None, variance=variance)
        u, v = (float(BLUR.variance(alpha)) for alpha in lobe.axes[:2])
        scale = 2 * variance / (u + v)
        return self.with_lobe(index, alpha=None, variance=(scale * u, scale * v))

    def with_roughness(self, index: int, roughness: Roughness) -> Target:
        """This target with another roughness of one lobe, whose rotation is in radians."""
        u, v, rotation = (float(np.ravel(x)[0]) for x in roughness)
        if abs(u - v) <= ROUND:
            return self.with_lobe(index, alpha=u if u == v else (u + v) / 2, variance=None, rotation=0.0)
        return self.with_lobe(index, alpha=(u, v), variance=None, rotation=float(np.degrees(rotation)))


def kind_of(roughnesses: Iterable[Roughness]) -> type[Variance]:
    """The cheapest kind of variance that holds all of some roughnesses."""
    turned = [
        abs((u - v) * np.sin(2 * rotation)) > ROUND or np.cos(rotation) ** 2 < 0.5
        for u, v, rotation in roughnesses
        if abs(u - v) > ROUND
    ]
    return (Covariance if any(turned) else PerAxis) if turned else Isotropic


def load_target(path: str | Path) -> Target:
    """The target in a file (.yaml, .yml or .json).

    Raises:
        InvalidInput: no such file, or its content is not a target; one line that names the file.
    """
    fields = io.read(path, "a target file")
    with within(str(path)):
        return _asked(fields)


#: What a user may give for a target: one, the mapping of a target file, its lobes alone, or a file.
TargetLike: TypeAlias = Target | Mapping[str, Any] | Sequence[Mapping[str, Any]] | str | Path


def read(target: TargetLike) -> Target:
    """A target, unchanged, or from a mapping, from its lobes alone, or from a file."""
    if isinstance(target, Target):
        return target
    if isinstance(target, str | Path):
        return load_target(target)
    return _asked(target if isinstance(target, Mapping) else {"lobes": target})


def _asked(fields: Any) -> Target:
    """The target that a user describes, refused if one of its keys would be ignored."""
    target = Target.from_dict(fields)
    for n, lobe in enumerate(target.lobes, 1):
        if lobe.base != "conductor" and "tint" in lobe.model_fields_set:
            raise InvalidInput(f"lobe {n}: tint: only of a lobe with base: conductor")
        if not lobe.brushed and "rotation" in lobe.model_fields_set:
            raise InvalidInput(f"lobe {n}: rotation: only of a lobe with two roughnesses, alpha: [u, v]")
    return target


def _lobe(number: int, entry: Any) -> TargetLobe:
    if isinstance(entry, TargetLobe):
        return entry
    with within(f"lobe {number}"):
        return TargetLobe.from_dict(entry)


def distance(one: Target, other: Target) -> float:
    """Sum of the differences between two targets, of logarithms of their energies and variances."""
    total = 0.0
    for a, b in zip(one.lobes, other.lobes):
        total += float(np.sum(np.abs(np.log(np.maximum(a.colour, LEAST) / np.maximum(b.colour, LEAST)))))
        s_a, s_b = (max(float(BLUR.variance(lobe.roughness)), LEAST) for lobe in (a, b))
        total += abs(float(np.log(s_a / s_b)))
    return total
