"""Time until a material is ready whose values have changed, in a process that has made one before.

    python benchmarks/preparation.py [--rounds 15]

One roughness of a preset is changed (of an isotropic interface along both axes), the BSDF is made and evaluated once.
Seconds of the clock, and as a remark of the processor, without the first two changes, which compile; then the same for
three interfaces of every kind, and panes of many, by `velatura`, where facets are met once, and often. The remark has
the first one, too, whose kernels may lie on disk.
"""

from __future__ import annotations

import time
from statistics import median
from typing import Any

import numpy as np
from rows import parsed, row

import velatura as vt
from velatura.checks.probe import Probe
from velatura.stack import Interface, Medium, Stack

PRESETS = ("frosted-metal", "coated-gold", "pearl-lacquer")
MODELS: dict[str, dict[str, Any]] = {
    "belcour2018": {"model": "belcour2018"},
    "velatura": {"model": "velatura"},
    "velatura, symmetric": {"model": "velatura", "form": "symmetric"},
}
COPPER: dict[str, Any] = {"eta": (0.2, 0.9, 1.1), "k": (3.9, 2.4, 2.2)}
PAINT = Medium(depth=1.0, sigma_s=(0.9, 0.8, 0.6), sigma_a=(0.1, 0.2, 0.4), g=0.6)


def three(*alphas: Any, turns: tuple[float, float] = (0.0, 0.0), **base: Any) -> Stack:
    """Three interfaces, of which the last two are turned."""
    first, second, third = alphas
    return Stack([
        Interface(eta=1.5, alpha=first),
        Interface(eta=1.8, alpha=second, rotation=turns[0]),
        Interface(alpha=third, rotation=turns[1], **base),
    ])  # fmt: skip


def painted(stack: Stack) -> Stack:
    """The stack with a medium that scatters below the first interface."""
    return Stack([stack.layers[0], PAINT, *stack.layers[1:]])


def pane(count: int, brushed: bool) -> Stack:
    """A pane of rough interfaces, with a medium that scatters below every other one."""
    layers = list[Interface | Medium]()
    for k in range(count):
        share = k / count
        alpha, eta = 0.05 + 0.3 * share, 1.0 if k == count - 1 else 1.5 if k % 2 else 1.3
        layers.append(Interface(eta=eta, alpha=(alpha, 0.4 - alpha) if brushed else alpha, rotation=170 * share))
        layers += [] if k % 2 else [PAINT]
    return Stack(layers)


ISOTROPIC = three(0.1, 0.2, 0.3, **COPPER)
BRUSHED = three(0.1, (0.05, 0.2), (0.1, 0.4), **COPPER)
TURNED = three((0.05, 0.1), (0.05, 0.2), (0.1, 0.4), turns=(30.0, 75.0), **COPPER)
KINDS = {
    "isotropic": ISOTROPIC,
    "brushed": BRUSHED,
    "turned": TURNED,
    "isotropic glass": three(0.1, 0.2, 0.3, eta=1.3),
    "turned glass": three((0.05, 0.1), (0.05, 0.2), (0.1, 0.4), turns=(30.0, 75.0), eta=1.3),
    "isotropic, scattering": painted(ISOTROPIC),
    "brushed, scattering": painted(BRUSHED),
    "turned, scattering": painted(TURNED),
    "pane of 8 turned, scattering": pane(8, brushed=True),
    "pane of 16 turned, scattering": pane(16, brushed=True),
    "pane of 30 isotropic, scattering": pane(30, brushed=False),
}
WI = np.array([[0.6, 0.0, 0.8]])
WO = np.array([[-0.6, 0.0, 0.8]])


def report(label: str, stack: Stack, choices: dict[str, Any], rounds: int) -> None:
    flat = stack.flat()
    u, v, *_ = (name for name in flat if "_alpha" in name)
    names = [u, v] if flat[u] == flat[v] else [u]
    spent = []
    for i in range(rounds + 2):
        changed = stack.replace(**dict.fromkeys(names, 0.05 + 0.3 * i / rounds))
        processor, clock = time.process_time(), time.perf_counter()
        Probe(vt.bsdf(changed, **choices)).eval_pdf(WI, WO)
        spent.append((time.process_time() - processor, time.perf_counter() - clock))
    processor = median(s[0] for s in spent[2:])
    row(
        "preparation",
        label,
        [s[1] for s in spent[2:]],
        remark=f"{processor:.2f} s of the processor, {spent[0][0]:.2f} at first",
    )


def main() -> None:
    options = parsed(__doc__, rounds=15, presets=list(PRESETS), kinds=(list(KINDS), "", list(KINDS)))
    rounds, presets, kinds = options.rounds, options.presets, options.kinds
    for preset in presets:
        for name, choices in MODELS.items():
            report(f"{preset}, {name}", vt.load(preset), choices, rounds)
    for kind in kinds:
        for word, reflectance in (("once", "fgd"), ("often", "fgd-multi")):
            report(f"{kind}, {word}", KINDS[kind], {"model": "velatura", "reflectance": reflectance}, rounds)


if __name__ == "__main__":
    main()
