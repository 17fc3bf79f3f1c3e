"""Pigments of paint: their coefficients from measured reflectances, and their concentrations for a wished colour.

Both follow light through the stack, by the energies of `velatura`; Kubelka and Munk's theory gives the first guesses.
Reflectances are those of an instrument with an integrating sphere, which sees the paint under `TILT`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from velatura import files, tables
from velatura.errors import InvalidInput, one_line, within
from velatura.optics import kubelka_munk
from velatura.results import Result, Table, cell
from velatura.stack import (
    Address,
    Described,
    Diffuse,
    Interface,
    InterfaceValues,
    Material,
    MaterialLike,
    Measured,
    Medium,
    Mix,
    Pigment,
    Spectrum,
    Stack,
    load,
    single,
    spectrum,
    srgb_weights,
)
from velatura.stack.pigments import COLUMNS, absorption, scattering
from velatura.stack.schema import show
from velatura.stack.spectra import lab
from velatura.stack.tables import read

Array = NDArray[np.floating]

TILT = 8.0  # degrees, of instruments whose sphere takes in what the surface reflects (CIE 15, geometry di:8)
READING = 1e-3  # standard error of a reading, of which intervals are reported
HIDDEN = 3.0  # depth of a film of which nothing shows through, in lengths of diffusion
RANGE = 1e-5, 1e5  # of K and S times the depth of a film
STEP = 1e-3  # of logarithms, and relative to concentrations, for derivatives
TRIED = 25  # mixtures of a search, beside those of slopes: further ones lie along a valley of like mixtures
MEASURED = "wavelength_nm", "black", "white"  # columns of a file
VISIBLE_NM = 380.0, 730.0  # of which colours are made
PULL = 1e-3  # towards the first guess, in units of colour difference: decides what the wish leaves open
SAME = 1e-6  # half the square of a colour difference that is none
FIRM = 1e4  # on the sum of concentrations
SPECTRAL = 100.0  # of reflectances over wavelength, so that 1 is about one unit of colour difference
SHOWN = 16  # wavelengths that are printed at most
NONE = np.zeros(0)  # directions at which the remainder, which has no lobe, is known


# What an instrument sees ---------------------------------------------------------------------------------------------


def at_wavelengths(stack: Stack, nm: Array) -> Material:
    """The values of a stack at wavelengths (N,): numbers, and colours of shape (N, 1), or (1, 1) where all are alike.

    Raises:
        InvalidInput: a texture, or [r, g, b], which has no wavelengths.
    """

    def value(address: Address, described: Any) -> Any:
        if isinstance(described, Measured):
            return np.interp(nm, *spectrum(described))[:, None]
        plain = address.plain(described, "a paint is the same at all points")
        if isinstance(plain, tuple):
            raise InvalidInput(f"{address.name}: is [r, g, b], and others are spectra; write a number or a spectrum")
        return np.full((1, 1), plain) if address.colour else float(plain)

    # Channels are wavelengths, and no colours of what was measured
    made = Material.of(stack, value).of_metals([None] * len(stack.layers))
    return replace(made, light=nm)


def reflectance(material: Material, specular: bool = True) -> Array:
    """Reflectance (C,) of a material of NumPy's values, by its channels; without `specular`, less what the first
    interface reflects."""
    from velatura.model.solved.energies.energies import energies
    from velatura.model.solved.lobes.widths import nearly_straight

    cosines = np.array([np.cos(np.radians(TILT))])
    found = energies(material, cosines, 0 * cosines, tables.load(), nearly_straight, incidences=NONE)
    total = found.lobes.sum(axis=0) + found.veils.sum(axis=0) + found.rest
    if not specular and isinstance(material.layers[0], InterfaceValues):
        total = total - found.lobes[0]
    return np.asarray(total[:, 0])


def paint_colour(material: MaterialLike, specular: bool = False) -> Array:
    """The colour of a material under such an instrument, linear sRGB under D65 (3,).

    One with spectra is followed at wavelengths every 10 nm, and not by the colours of its spectra. Without `specular`
    it is less what the first interface reflects.

    Raises:
        InvalidInput: a texture, or [r, g, b] beside spectra.
    """
    described: Described = load(material)
    if isinstance(described, Mix):
        shares = described.weighted("a paint is the same at all points")
        return np.sum([share * paint_colour(stack, specular) for share, stack in shares], axis=0)
    if not any(isinstance(value, Measured) for value in described.flat().values()):
        return np.broadcast_to(reflectance(Material.of(described), specular), 3).copy()
    nm, weights = observer()
    found = reflectance(at_wavelengths(described, nm), specular)
    return np.asarray(weights @ np.broadcast_to(found, len(nm)))


# Coefficients of a pigment -------------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class PigmentFit(Result):
    """K and S of a film, at N wavelengths.

    Attributes:
        wavelengths_nm, K, S: (N,), coefficients per unit of length of the film's depth.
        error: (2, N), reflectance over black and over white, less what was measured.
        spread: (2, N), relative standard error of K and S for one of .001 in reflectance; infinite where the readings
            leave it open, as S of a film that hides its ground.
        guess: (2, N), K and S by Kubelka and Munk's and Saunderson's formulas.
    """

    wavelengths_nm: Array
    K: Array
    S: Array
    error: Array
    spread: Array
    guess: Array

    def as_tables(self, every: int = 1) -> list[Table]:
        """A row per wavelength, or of some of them alone."""
        rows = []
        for n in range(0, len(self.K), every):
            spread = (f"{x:.1%}" if x < 1 else "open" for x in self.spread[:, n])
            guess = (f"{x:.4g}" for x in self.guess[:, n])
            rows.append((f"{self.wavelengths_nm[n]:g} nm", f"{self.K[n]:.4g}", f"{self.S[n]:.4g}", *spread, *guess))
        right = ("K", "S", "K, of .001", "S, of .001", "Kubelka-Munk K", "Kubelka-Munk S")
        return [Table("", ("wavelength", *right), rows, right)]

    def brief(self) -> list[Table]:
        """A row per wavelength, or of some of many."""
        return self.as_tables(-(-len(self.K) // SHOWN))

    @property
    def pigment(self) -> Pigment:
        """The pigment, at a concentration of 1."""
        rows = (np.stack([self.wavelengths_nm, values], axis=1).tolist() for values in (self.K, self.S))
        k, s = (Spectrum(spectrum=tuple(map(tuple, each))) for each in rows)
        return Pigment(K=k, S=s)

    def save(self, path: str | Path, title: str = "") -> None:
        """Write a file that a material may name as `pigment`, CSV.

        Raises:
            InvalidInput: it cannot be written.
        """
        target = files.check_writable(path, "a file of a pigment", (".csv",))
        lines = [f"# {one_line(title)}"] * bool(title) + [",".join(COLUMNS)]
        lines += [f"{nm:.6g},{k:.6g},{s:.6g}" for nm, k, s in zip(self.wavelengths_nm, self.K, self.S)]
        with files.whole(target) as unfinished:
            unfinished.write_text("\n".join(lines) + "\n", encoding="utf-8")


def load_reflectances(path: str | Path) -> tuple[Array, Array, Array]:
    """Wavelengths in nanometres, and reflectances over a black and over a white ground, (N,), of a CSV file.

    Its columns may be named above, as wavelength_nm,black,white; what follows # is a comment.

    Raises:
        InvalidInput: no such file, or it holds no such table; one line that names it.
    """
    path = Path(path)
    try:
        rows = read(
            path, "a wavelength in nanometres", "wavelengths", ("reflectances over black", "over white"), MEASURED
        )
    except ValueError as error:
        raise InvalidInput(str(error)) from None
    with within(str(path)):
        nm, black, white = _readings(*np.array(rows, float).reshape(-1, 3).T)
    return nm, black, white


def fit_pigment(
    wavelengths_nm: ArrayLike,
    over_black: ArrayLike,
    over_white: ArrayLike,
    depth: float,
    black: ArrayLike,
    white: ArrayLike,
    interface: Interface | None = None,
    g: float = 0.0,
    specular: bool = True,
) -> PigmentFit:
    """K and S of a film of known depth, of its reflectances over a black and over a white ground.

    The film lies below an interface, and on grounds that are ideally diffuse. Reflectances are those of an instrument
    with an integrating sphere under 8 degrees.

    Args:
        wavelengths_nm: (N,), ascending.
        over_black, over_white: (N,), measured reflectances, 0 to 1.
        depth: of the film; K and S are per its unit of length.
        black, white: albedos of the grounds below the film, numbers or (N,).
        interface: above the film; None: a smooth one of index 1.5.
        g: asymmetry of the film, which K and S hardly depend on.
        specular: whether the readings include what the interface reflects.

    Raises:
        InvalidInput: a value outside its range, or lists of different lengths.
    """
    from scipy import optimize, sparse

    nm, *seen = _readings(wavelengths_nm, over_black, over_white)
    grounds = _grounds(nm, black, white)
    described = Stack([interface or Interface(eta=1.5), Medium(depth=depth, g=g), Diffuse()])
    if described.transmits or not depth > 0:
        raise InvalidInput(f"depth: must be above 0, got {show(depth)}")
    material = at_wavelengths(described, nm)

    def read_off(logarithms: Array) -> Array:
        """Reflectances over both grounds, (2, N), of the logarithms of K and S, (2, N)."""
        k, s = np.exp(logarithms)[..., None]
        film = material.with_layer(1, sigma_a=absorption(k), sigma_s=scattering(s, g))
        found = [reflectance(film.with_layer(-1, albedo=ground[:, None]), specular) for ground in grounds]
        return np.stack([np.broadcast_to(each, len(nm)) for each in found])  # one value stands for equal ones

    def slopes(logarithms: Array) -> Array:
        """Derivatives (2 of K and S, 2 grounds, N) of `read_off`."""
        steps = np.eye(2)[:, :, None] * STEP
        return np.stack([(read_off(logarithms + step) - read_off(logarithms - step)) / (2 * STEP) for step in steps])

    def jacobian(flat: Array) -> Any:
        of_k, of_s = slopes(flat.reshape(2, -1))
        return sparse.bmat(
            [[sparse.diags(of_k[0]), sparse.diags(of_s[0])], [sparse.diags(of_k[1]), sparse.diags(of_s[1])]]
        )

    guess = _guess(np.stack(seen), np.stack(grounds), depth, _index(material), specular)
    found = optimize.least_squares(
        lambda flat: (read_off(flat.reshape(2, -1)) - seen).ravel(),
        np.log(guess).ravel(),
        jacobian,
        bounds=tuple(np.log(np.array(RANGE) / depth)),
        xtol=1e-10,
        ftol=1e-12,
        gtol=1e-10,
        max_nfev=60,
    ).x.reshape(2, -1)
    k, s = np.exp(found)
    return PigmentFit(nm, k, s, read_off(found) - seen, _spread(slopes(found)), guess)


def _readings(wavelengths_nm: ArrayLike, *reflectances: ArrayLike) -> tuple[Array, ...]:
    """Wavelengths and reflectances as arrays (N,). Raises InvalidInput where they are none."""
    nm = np.array(wavelengths_nm, float).ravel()
    if len(nm) < 2 or not np.isfinite(nm).all() or np.any(np.diff(nm) <= 0):
        raise InvalidInput("wavelengths: must be two or more, in nanometres, which ascend")
    found = [np.array(each, float).ravel() for each in reflectances]
    for name, each in zip(("over black", "over white"), found):
        if len(each) != len(nm):
            raise InvalidInput(f"reflectances {name}: must be {len(nm)}, one for each wavelength, got {len(each)}")
        if not ((each >= 0) & (each <= 1)).all():
            worst = each[np.argmin((each >= 0) & (each <= 1))]
            raise InvalidInput(f"reflectances {name}: must lie in 0 to 1 (100 % is 1), got {worst:g}")
    return nm, *found


def _grounds(nm: Array, black: ArrayLike, white: ArrayLike) -> list[Array]:
    """Albedos of both grounds, (N,)."""
    found = []
    for name, given in (("black", black), ("white", white)):
        each = np.array(given, float)
        if each.ndim > 1 or each.size not in (1, len(nm)) or not ((each >= 0) & (each <= 1)).all():
            raise InvalidInput(f"{name}: must be a number in 0 to 1, or {len(nm)} of them, got {show(given)}")
        found.append(np.broadcast_to(each, len(nm)))
    if not (found[0] < found[1]).all():
        raise InvalidInput("white: must be a brighter ground than black at every wavelength")
    return found


def _index(material: Material) -> float:
    """The index of the film, relative to the outside."""
    first = material.layers[0]
    assert isinstance(first, InterfaceValues)
    return max(float(np.mean(first.eta) / np.mean(material.exterior)), 1.0)


def _guess(seen: Array, grounds: Array, depth: float, eta: float, specular: bool) -> Array:
    """K and S (2, N) by Kubelka and Munk's and Saunderson's formulas; of films that hide their ground, or that do not
    scatter, by their limits."""
    with_surface = seen if specular else seen + kubelka_munk.surface(eta)[0]
    r = np.clip(kubelka_munk.below(with_surface, eta), 1e-4, 0.9999)
    k, s = kubelka_munk.coefficients(r[0], r[1], grounds[0], grounds[1], depth)
    ratio = kubelka_munk.ratio(r.mean(axis=0))
    hiding = HIDDEN / depth / np.sqrt(ratio * (ratio + 2))
    # What is left of light that passes the film twice
    clear = -np.log(np.clip((r[1] - r[0]) / (grounds[1] - grounds[0]), 1e-4, 0.999)) / (2 * depth)
    hides = r[1] - r[0] < 0.02 * (grounds[1] - grounds[0])
    known = np.isfinite(k) & np.isfinite(s) & (k > 0) & (s > 0)
    k = np.where(known, k, np.where(hides, ratio * hiding, clear))
    s = np.where(known, s, np.where(hides, hiding, 0.01 / depth))
    low, high = np.array(RANGE) / depth
    return np.clip([k, s], 10 * low, high / 10)


def _spread(slopes: Array) -> Array:
    """Standard errors (2, N) of the logarithms of K and S, for `READING`."""
    normal = np.einsum("agn,bgn->nab", slopes, slopes)
    determinant = np.linalg.det(normal)
    open_ = determinant < 1e-12 * np.trace(normal, axis1=1, axis2=2) ** 2
    safe = np.where(open_[:, None, None], np.eye(2), normal)
    variances = np.diagonal(np.linalg.inv(safe), axis1=1, axis2=2).T
    return np.where(open_, np.inf, READING * np.sqrt(variances))


# Concentrations of pigments ------------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class Paint(Result):
    """A material whose pigments have the concentrations for a wished colour.

    Attributes:
        stack: the material.
        concentrations: of its pigments, from the top.
        names: of these: by name, file, or place.
        wished, reached: linear sRGB (3,), or reflectances (N,) at the wavelengths of a spectrum that is wished for.
        colour: linear sRGB (3,) that is reached.
        difference: CIE 1976 colour difference of the two, under D65.
    """

    stack: Stack
    concentrations: Array
    names: tuple[str, ...]
    wished: Array
    reached: Array
    colour: Array
    difference: float

    def as_tables(self) -> list[Table]:
        """A row per pigment, and the colour that is reached."""
        rows: list[tuple[str, str] | None] = [(name, f"{x:.4f}") for name, x in zip(self.names, self.concentrations)]
        rows += [None, ("linear sRGB reached", cell(self.colour)), ("colour difference", f"{self.difference:.2f}")]
        return [Table("", ("pigment", "concentration"), rows, ("concentration",))]

    def to_dict(self) -> dict[str, Any]:
        """The numbers in the types of JSON."""
        return {
            "stack": self.stack.to_dict(),
            "pigments": [{"name": n, "concentration": c} for n, c in zip(self.names, self.concentrations.tolist())],
            "wished": self.wished.tolist(),
            "reached": self.reached.tolist(),
            "colour": self.colour.tolist(),
            "difference": self.difference,
        }


def paint(
    material: MaterialLike,
    wish: Sequence[float] | Spectrum,
    most: float = 1.0,
    total: float | None = None,
    specular: bool = False,
) -> Paint:
    """Concentrations of the pigments of a material for a wished colour, the closest that they reach.

    All other values of the material stay as they are. Where several mixtures do equally well, as of opaque paint, whose
    colour depends on ratios alone, one near the first guess is returned; `total` chooses among these.

    Args:
        material: a stack whose media have pigments, a file, or a preset's name.
        wish: linear sRGB, or reflectances over wavelength.
        most: the upper bound of each concentration.
        total: the sum of the concentrations; None leaves it free.
        specular: whether the wish includes what the first interface reflects.

    Raises:
        InvalidInput: a mixture of materials, no pigments, a texture, a wish outside 0 to 1, a spectrum as a wish where
            pigments are [r, g, b], or a total that the bounds do not allow.
    """
    from scipy import optimize

    stack = single(material, "paint")
    places = [(n, k) for n, k in enumerate(stack.layers) if isinstance(k, Medium) and k.pigments]
    pigments = [pigment for _, medium in places for pigment in medium.pigments]
    if not pigments:
        raise InvalidInput("layers: no medium has pigments")
    if not 0 < most <= 1e6:
        raise InvalidInput(f"most: must lie in 0 to 1e6, the lower end excluded, got {show(most)}")
    if total is not None and not 0 < total <= most * len(pigments):
        raise InvalidInput(
            f"total: must lie in 0 to {most * len(pigments):g}, the sum of all bounds, got {show(total)}"
        )
    seen = _Seen.of(stack, pigments, wish)
    which = np.repeat(np.arange(len(places)), [len(medium.pigments) for _, medium in places])
    of_media = [(n, seen.material.layers[n].g) for n, _ in places]  # type: ignore[union-attr]

    def reflected(shares: Array) -> Array:
        """Reflectance by channels (C,)."""
        mixed = seen.material
        for medium, (n, g) in enumerate(of_media):
            own = which == medium
            k, s = (np.tensordot(shares[own], each[own], 1)[:, None] for each in (seen.k, seen.s))
            mixed = mixed.with_layer(n, sigma_a=absorption(k), sigma_s=scattering(s, g))
        return np.broadcast_to(reflectance(mixed, specular), seen.k.shape[1:])

    def residual(shares: Array, start: Array) -> Array:
        rows = [seen.difference(reflected(shares)), PULL * (shares - start) / most]
        if total is not None:
            rows.append(np.array([FIRM * (shares.sum() / total - 1)]))
        return np.concatenate(rows)

    written = np.array([pigment.concentration for pigment in pigments])
    tried = []
    for start in (seen.guess(most, total), np.clip(written, 0, most)):
        first = np.clip(start, 1e-3 * most, (1 - 1e-3) * most)
        options: dict[str, Any] = {"bounds": (0, most), "diff_step": STEP, "x_scale": most, "xtol": 1e-6, "ftol": 1e-6}
        tried.append(optimize.least_squares(residual, first, args=(first,), max_nfev=TRIED, **options))
        if tried[-1].cost < SAME:
            break
    shares = min(tried, key=lambda each: float(each.cost)).x
    if total is not None:
        shares = np.clip(shares * total / shares.sum(), 0, most)
    found = reflected(shares)
    colour, wished = seen.rgb(found), seen.wished
    return Paint(
        stack=_with_concentrations(stack, shares),
        concentrations=shares,
        names=tuple(each.name or (each.pigment.name if each.pigment else str(n)) for n, each in enumerate(pigments)),
        wished=wished,
        reached=found if seen.spectral else colour,
        colour=colour,
        difference=float(np.linalg.norm(lab(colour) - lab(seen.rgb(wished) if seen.spectral else wished))),
    )


@dataclass(frozen=True)
class _Seen:
    """A material and its pigments in channels, those of sRGB or wavelengths, and the wish.

    Attributes:
        material: of NumPy's values, regardless of the concentrations.
        k, s: (P, C), of pigments at a concentration of 1.
        weights: (3, C), of channels in linear sRGB.
        wished: linear sRGB (3,), or reflectances (C,) if the wish is `spectral`.
    """

    material: Material
    k: Array
    s: Array
    weights: Array
    wished: Array
    spectral: bool

    @classmethod
    def of(cls, stack: Stack, pigments: Sequence[Pigment], wish: Sequence[float] | Spectrum) -> _Seen:
        is_table = isinstance(wish, Spectrum)
        over_wavelength = is_table or any(isinstance(x, Spectrum) for each in pigments for x in each.coefficients)
        nm, weights = observer() if over_wavelength else (None, np.eye(3))
        if isinstance(wish, Spectrum):
            wished = np.interp(observer()[0], *spectrum(wish))
        else:
            wished = np.array(wish, float).ravel()
            if len(wished) != 3:
                raise InvalidInput(f"colour: must be three numbers, got {len(wished)}")
        if not ((wished >= 0) & (wished <= 1)).all():
            raise InvalidInput(f"{'reflectances' if is_table else 'colour'}: must lie in 0 to 1")

        def channels(value: Any) -> Array:
            if isinstance(value, Spectrum):
                return np.interp(observer()[0], *spectrum(value))
            if isinstance(value, tuple) and nm is not None:
                raise InvalidInput("pigments: K and S are [r, g, b], and others are spectra; write numbers or spectra")
            return np.broadcast_to(np.asarray(value, float), weights.shape[1:])

        k, s = (np.array([channels(each.coefficients[part]) for each in pigments]) for part in (0, 1))
        material = Material.of(stack) if nm is None else at_wavelengths(stack, nm)
        return cls(material, k, s, weights, wished, is_table)

    def rgb(self, reflected: Array) -> Array:
        """Reflectances by channels as linear sRGB under D65."""
        return np.asarray(self.weights @ reflected)

    def difference(self, reflected: Array) -> Array:
        """Reflected light less the wish, in units of colour difference."""
        if self.spectral:
            return SPECTRAL * (reflected - self.wished) / np.sqrt(len(self.wished))
        return lab(self.rgb(reflected)) - lab(self.wished)

    def guess(self, most: float, total: float | None) -> Array:
        """Concentrations at which opaque paint has the wish, by Kubelka and Munk's and Saunderson's formulas."""
        from scipy import optimize

        first = self.material.layers[0]
        refracts = isinstance(first, InterfaceValues) and first.kind == "dielectric"
        eta = _index(self.material) if refracts else 1.0
        inside = kubelka_munk.below(self.wished + kubelka_munk.surface(eta)[0], eta)
        ratio = kubelka_munk.ratio(np.clip(inside, 0.01, 0.99))
        reduced = np.eye(len(self.wished)) if self.spectral else self.weights
        k, s = (np.maximum(each @ reduced.T, 0) for each in (self.k, self.s))
        # The sum of c (K - q S) is 0, and that of c as wished
        rows = (k - ratio * s) / np.maximum(k + ratio * s, 1e-9).max(axis=0)
        sum_ = total if total is not None else min(0.5 * most * len(k), 1.0)
        system = np.vstack([rows.T, np.ones(len(k))])
        wanted = np.append(np.zeros(rows.shape[1]), sum_)
        return np.asarray(optimize.lsq_linear(system, wanted, bounds=(0, most)).x)


def observer() -> tuple[Array, Array]:
    """Wavelengths (C,) every 10 nm, as spectrophotometers have them, and weights (3, C) of linear sRGB under D65."""
    nm, weights = srgb_weights()
    kept = (nm >= VISIBLE_NM[0]) & (nm <= VISIBLE_NM[1]) & (nm % 10 == 0)
    return nm[kept], weights[:, kept] / weights[:, kept].sum(axis=1, keepdims=True)


def _with_concentrations(stack: Stack, shares: Array) -> Stack:
    """The stack whose pigments have these concentrations, from the top."""
    each: Iterator[float] = iter(shares.tolist())
    layers = []
    for layer in stack.layers:
        if isinstance(layer, Medium) and layer.pigments:
            pigments = [pigment.model_copy(update={"concentration": next(each)}) for pigment in layer.pigments]
            layer = Medium(**{**dict(layer), "pigments": pigments})
        layers.append(layer)
    return stack.with_layers(layers)
