"""
Wishes beyond lobes
===================

What a pane passes, the colours of paint under a coat, of a mixture and of an oxide, what a workshop can make, and the
look at grazing angles: each wish changes the values that it is about, and the picture shows what was asked for beside
what the stack has.
"""

import matplotlib.pyplot as plt
import numpy as np

import velatura as vt

PANE = vt.Stack([vt.Interface(eta=1.5, alpha=0.02), vt.Medium(depth=1), vt.Interface(eta=1, alpha=0.02)])
PLASTIC = vt.preset("glossy-plastic")
TITANIUM = vt.Interface(eta=[2.74, 2.54, 2.27], k=[3.81, 3.43, 3.04], films=[vt.Film(eta=2.4, thickness_nm=50)])
PAIR = [{"energy": 0.15, "alpha": 0.1, "interfaces": 2}]


def shown(energy):
    """The sRGB colour of an energy."""
    return np.clip(np.broadcast_to(energy, 3), 0, 1) ** (1 / 2.2)


def swatches(ax, title, found):
    """The colour that was asked for, above that which the stack has."""
    (wish,), (has,) = found.target.further, found.reached.further
    rows = [shown(each.energy) for each in (wish, has)]
    ax.imshow(np.array(rows)[:, None], extent=(0, 1, 0, 1), aspect="auto")
    ax.set(title=title, xticks=[], yticks=[0.75, 0.25], yticklabels=["asked", "has"])


places = [["pane", "paint", "mixture"], ["film", "workshop", "edge"], ["blur", "glint", "three"]]
figure, axes = plt.subplot_mosaic(places, figsize=(9.4, 6.9), layout="constrained")

# %%
# A pane and its tint and haze, and the colour of paint as it is seen through its coat.

tinted = vt.inverse.answer({"start": PANE, "passed": {"energy": [0.15, 0.45, 0.55], "haze": 0.8}})
painted = vt.inverse.answer({"start": PLASTIC, "body": {"energy": [0.03, 0.12, 0.4]}})
swatches(axes["pane"], f"passes a tint, haze {tinted.reached.passed[0].haze:.2f}", tinted)
swatches(axes["paint"], "paint under its coat", painted)

# %%
# Flakes and pigment side by side, and the share of the flakes that gives a colour.

mixed = vt.inverse.answer({"start": "half-metallic-paint", "mixture": {"energy": [0.1, 0.175, 0.34]}})
(wish,) = mixed.target.mixture
shares = np.linspace(0, 1, 65)
colours = [shown(wish.had_by(mixed.stack.replace(part0_weight=share), mixed.model).energy) for share in shares]
axes["mixture"].imshow(np.array(colours)[None], extent=(0, 1, 0, 1), aspect="auto")
axes["mixture"].axvline(mixed.stack.flat()["part0_weight"], color="white", linestyle="--")
axes["mixture"].set(title="a colour by its weight of flakes", xlabel="weight of flakes", yticks=[])

# %%
# The colour of an oxide by its thickness, and the thicknesses whose colours are nearest to a blue.

blue = {"start": vt.Stack([TITANIUM]), "film": {"energy": [0.1, 0.2, 0.45], "thickest_nm": 400}}
found = vt.inverse.answers(blue, 2, "weier2020")
thickness = np.arange(0, 401, 5)
colours = [
    shown(vt.lobes(found[0].stack.replace(layer0_film0_thickness_nm=nm), 1.0, model="weier2020").energy[0][:, 0])
    for nm in thickness
]
axes["film"].imshow(np.array(colours)[None], extent=(0, 400, 0, 1), aspect="auto")
for each in found:
    axes["film"].axvline(each.stack.flat()["layer0_film0_thickness_nm"], color="white", linestyle="--")
axes["film"].set(title="the nearest blues of an oxide", xlabel="thickness, nm", yticks=[])

# %%
# Varnished copper by what a workshop has: absorption is free below crown glass, and a lacquer is laid twice as thick at
# least as its colour needs.

LACQUER = {"eta": 1.5, "sigma_a": [0.6, 0.15, 0.3]}
wish = {"start": "tinted-varnish-on-copper", "available": ["bk7", LACQUER, "Cu"]}
made = [vt.inverse.answer({**wish, "available": ["bk7", "Cu"]})]
made += [vt.inverse.answer({**wish, "available": [LACQUER, "Cu"], "thinnest": depth}) for depth in (0, 2)]
rows = [[shown(target.lobes[1].energy) for target in (each.target, each.reached)] for each in made]
axes["workshop"].imshow(np.swapaxes(rows, 0, 1), extent=(0, 3, 0, 1), aspect="auto")
depths = [f"lacquer,\n{each.stack.layers[1].depth:.1f} deep" for each in made[1:]]
axes["workshop"].set(title="copper of a workshop", xticks=[0.5, 1.5, 2.5], yticks=[0.75, 0.25])
axes["workshop"].set(xticklabels=["bk7,\nany tint", *depths], yticklabels=["asked", "has"])

# %%
# Two stacks with one lobe at normal incidence, of which one is brighter at 75 degrees.

angles = np.arange(0, 86, 2)
for energy in (0.22, 0.27):
    stack = vt.inverse.answer({"lobes": PAIR, "grazing": {"energy": energy}}, "bati2021").stack
    lobes = vt.lobes(stack, np.cos(np.radians(angles)), model="bati2021")
    (line,) = axes["edge"].plot(angles, np.sum(lobes.energy, axis=0)[1])
    axes["edge"].plot(75, energy, "o", color=line.get_color())
axes["edge"].set(title="one lobe, other energies at 75°", xlabel="angle of incidence", ylabel="reflected")

# %%
# A metal below a coat whose lobe is asked to be as wide, or as bright, at 75 degrees: its blur gives way at normal
# incidence, or its energy.

start = vt.preset("coloured-absorbing-coat")
wider = vt.inverse.answer({"start": start, "grazing": {"lobe": 2, "alpha": 0.5}}).stack
darker = vt.inverse.answer({"start": start, "grazing": {"lobe": 2, "energy": [0.03, 0.06, 0.1]}}).stack
for stack, style in ((start, ":"), (wider, "-")):
    axes["blur"].plot(angles, vt.lobes(stack, np.cos(np.radians(angles))).alpha[1].mean(axis=0), style, color="C0")
for stack, style in ((start, ":"), (darker, "-")):
    lobe = vt.lobes(stack, np.cos(np.radians(angles))).energy[1]
    for channel, color in zip(lobe, ("C3", "C2", "C0")):
        axes["glint"].plot(angles, channel, style, color=color)
axes["blur"].plot(75, 0.5, "o", color="C0")
axes["glint"].plot([75] * 3, [0.03, 0.06, 0.1], "o", color="black")
axes["blur"].set(title="a lobe's blur at 75°", xlabel="angle of incidence", ylabel="alpha")
axes["glint"].set(title="and its colour", xlabel="angle of incidence", ylabel="energy")

# %%
# The brightest lobes of clear dielectrics that are found, by blur and number of interfaces: the energy that a refusal
# offers. Below a rough interface a second one adds nothing, but a third does.

alphas = [0, 0.05, 0.1, 0.2, 0.3]
for count in (1, 2, 3):
    most = []
    for alpha in alphas:
        try:
            vt.inverse.invert_stack([{"energy": 0.8, "alpha": alpha, "interfaces": count}], "bati2021")
        except vt.inverse.Infeasible as refusal:
            offered = [way.target.lobes[0] for way in refusal.directions]
            most.append(
                next(lobe.colour[0] for lobe in offered if lobe.interfaces == count and lobe.base == "dielectric")
            )
    axes["three"].plot(alphas, most, ".-", label=f"{count} interface{'s' * (count > 1)}")
axes["three"].set(title="the brightest clear lobes", xlabel="alpha", ylabel="energy", ylim=(0.3, 0.7))
axes["three"].legend(fontsize="small")
