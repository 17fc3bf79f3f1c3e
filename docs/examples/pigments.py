"""
Paint of computed pigments
==========================

Pigments are particles in a binder. Spheres of one size absorb and scatter as Mie (1908) has it, and so have Kubelka and
Munk's coefficients, here of rutile, haematite and soot by their indices in refractiveindex.info (public domain).
Paint of these lies over white and over black, as on a card for the hiding power of paints: mixtures with white above,
and one mixture in films of growing thickness below. The package `miepython` works out the spheres.
"""

import matplotlib.pyplot as plt
import miepython
import numpy as np

import velatura as vt

BINDER, GLOSS = 1.5, vt.Interface(eta=1.5, alpha=0.05)
PARTICLES = {  # page of the database, and diameter in micrometres
    "rutile, white": ("main/TiO2/Devore-o", 0.24),
    "haematite, red": ("main/Fe2O3/Querry-o", 0.15),
    "soot, black": ("other/acetylene_soot/Dlazell", 0.05),
}
wavelengths_nm = np.arange(380.0, 731.0, 10.0)

# %%
# Spheres of a diameter d that fill a share c of the volume have a cross-section of 3 c / (2 d) for each unit of
# volume, times Mie's efficiencies. From these follow K = 2 sigma_a and S = 3/4 (1 - g) sigma_s, per micrometre and at a
# share of 1. Pigments may also be files of wavelength, K and S, as `velatura pigment` writes them of measurements.


def pigment(page, diameter_um, concentration):
    """K and S of spheres, which do not disturb each other: at shares below a tenth."""
    index = vt.Substance(refractiveindex=page)
    n = np.interp(wavelengths_nm, *index.table())
    k = np.interp(wavelengths_nm, *index.of("k").table()) if index.opaque else 0.0
    extinction, scattering, _, g = miepython.efficiencies(n - 1j * k, diameter_um, wavelengths_nm / 1e3, BINDER)
    sphere = 1.5 / diameter_um
    rows = {
        "K": 2 * sphere * np.maximum(extinction - scattering, 0),
        "S": 0.75 * sphere * (1 - g) * scattering,
    }
    tables = {key: {"spectrum": np.stack([wavelengths_nm, values], axis=1)} for key, values in rows.items()}
    return vt.Pigment(**tables, concentration=concentration)


def paint(shares, depth_um, ground):
    """Paint whose particles, by the names above, fill these shares of its volume."""
    pigments = [pigment(*PARTICLES[name], share) for name, share in shares.items() if share]
    return vt.Stack([GLOSS, vt.Medium(depth=depth_um, pigments=pigments), vt.Diffuse(albedo=ground)])


# %%
# Colours are those of an instrument, less what the surface reflects, over white in the upper half of each patch.

WHITE, BLACK = 0.85, 0.03
rutile, haematite, soot = PARTICLES
mixtures = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0]  # shares of the pigments' volume
depths_um = [1, 2, 4, 8, 16, 32, 64, 128]
rows = {
    "red in white": [({rutile: 0.1 * (1 - x), haematite: 0.1 * x}, 6) for x in mixtures],
    "black in white": [({rutile: 0.1 * (1 - x), soot: 0.1 * x}, 6) for x in mixtures],
    "pink": [({rutile: 0.09, haematite: 0.01}, depth) for depth in depths_um],
}
figure, axes = plt.subplots(len(rows), 1, figsize=(8, 4.6), layout="constrained")
for ax, (title, films) in zip(axes, rows.items(), strict=True):
    patches = [[vt.inverse.paint_colour(paint(*film, ground)) for film in films] for ground in (WHITE, BLACK)]
    ax.imshow(vt.scenes.tone_map(np.clip(patches, 0, 1)), aspect="auto")
    ax.set_yticks([0, 1], ["over white", "over black"])
    labels = [f"{depth} µm" for _, depth in films] if title == "pink" else [f"{x:.1%}" for x in mixtures]
    ax.set_xticks(range(len(films)), labels)
    ax.set_title(
        f"{title}, 9:1, films of growing thickness" if title == "pink" else f"{title}, films of 6 µm", fontsize=9
    )
