"""How long the Appearance panel's calls take.

    python benchmarks/appearance.py [--model velatura] [--drags 60]

Of every figure of Bati et al. 2021 that the panel opens: random drags of its lobes, the map of each lobe's class, and
drags of its member; and a visit from a preset over blur and class to a coat. As on the page, the lobes that the
material has are given while something is dragged, so that the answer may be approximate; and not where the hand rests.
Times are of the processor, of one call, without JSON and the way to the page. The bound is that of drags.
"""

from __future__ import annotations

import copy
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rows import parser, row

import velatura as vt
from velatura.editor import appearance, class_maps
from velatura.editor.messages import document

BOUND = 20e-3  # seconds of a call while something is dragged, at the median
HELD = ("invert", "member", "snapped")  # calls while something is dragged


def timed(call: Callable[[Any], Any], body: Any, into: list[float]) -> Any:
    """The answer of a call; its seconds are added to a list."""
    start = time.process_time()
    answer = call(body)
    into.append(time.process_time() - start)
    return answer


def visit(state: dict[str, Any], model: str, drags: int, rng: np.random.Generator) -> dict[str, list[float]]:
    """Seconds of the calls of one visit, by verb; of drags that end short of the wish apart."""
    times: dict[str, list[float]] = {verb: [] for verb in ("appearance", *HELD, "rest", "class")}
    here = appearance.invert({"target": state["target"], "model": model})
    timed(appearance.appearance, {"material": here["material"], "model": model}, times["appearance"])
    for _ in range(drags):
        wish = copy.deepcopy(here["target"])
        lobe, factor = wish["lobes"][rng.integers(len(wish["lobes"]))], float(np.exp(0.03 * rng.normal()))
        if rng.random() < 0.5:
            lobe["energy"] = [e * factor for e in lobe["energy"]]
        else:
            lobe["alpha"] = min(lobe["alpha"] * factor, 1.0)
        seconds: list[float] = []
        body = {"target": wish, "material": here["material"], "model": model}
        here = timed(appearance.invert, body | {"read": here["target"]}, seconds)
        times["snapped" if here["snapped"] else "invert"] += seconds
    here = timed(appearance.invert, {"target": wish, "material": here["material"], "model": model}, times["rest"])
    for k in range(len(here["target"]["lobes"])):
        body = {"target": here["target"], "lobe": k, "model": model}
        card = timed(class_maps.class_, {**body, "material": here["material"]}, times["class"])
        for _ in range(max(drags // 10, 1)):
            point = [x * float(np.exp(0.01 * rng.normal())) for x in card["member"]]
            body |= {"target": here["target"], "material": here["material"], "point": point, "read": here["target"]}
            here = timed(class_maps.member, body, times["member"])
        del body["read"]
        here = timed(class_maps.member, body, times["rest"])
    return times


def session(model: str, drags: int) -> dict[str, list[float]]:
    """Seconds of a visit of the panel, by verb: blur, another form, a walk through the class, a coat."""
    times: dict[str, list[float]] = {verb: [] for verb in ("appearance", *HELD, "rest", "form", "class", "coat")}
    body: dict[str, Any] = {"material": document(vt.preset("coated-rough-metal")), "model": model}
    here = timed(appearance.appearance, body, times["appearance"])

    # Drag the blur of the metal
    for alpha in np.linspace(0.46, 0.35, drags):
        body["target"] = copy.deepcopy(here["target"])
        body["target"]["lobes"][1]["alpha"] = float(alpha)
        here = timed(appearance.invert, body | {"read": here["target"]}, times["invert"])
        body["material"] = here["material"]
    here = timed(appearance.invert, body, times["rest"])
    body["material"] = here["material"]

    # Make the coat of two interfaces, and walk through their class
    body["target"] = copy.deepcopy(here["target"])
    body["target"]["lobes"][0]["interfaces"] = 2
    here = timed(appearance.invert, body, times["form"])
    body |= {"target": here["target"], "material": here["material"], "lobe": 0}
    start = timed(class_maps.class_, {**body, "size": 64}, times["class"])["member"]
    for t in np.linspace(0, 1, drags):
        body["point"] = [(1 - t) * a + t * b for a, b in zip(start, (1.2, 2.36))]
        here = timed(class_maps.member, body | {"read": here["target"]}, times["member"])
        body |= {"target": here["target"], "material": here["material"]}
    here = timed(class_maps.member, body, times["rest"])
    body |= {"target": here["target"], "material": here["material"]}

    # Coat it
    timed(appearance.coated, {**body, "eta": 1.33, "alpha": 0.0, "keep": True}, times["coat"])
    return times


def main() -> int:
    program = parser(__doc__, drags=(60, "of the lobes of every figure"))
    program.add_argument("--model", action="append", help="bati2021, belcour2018 and velatura, unless one is named")
    options = program.parse_args()

    failed = False
    print(f"load: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for model in options.model or ("bati2021", "belcour2018", "velatura"):
        rng = np.random.default_rng(0)
        every: dict[str, list[float]] = {}
        for state in appearance.targets({})["targets"]:
            for verb, seconds in visit(state, model, options.drags, rng).items():
                every.setdefault(verb, []).extend(seconds)
        failed |= report(f"{model}, figures", every) > BOUND
        failed |= report(f"{model}, visit", session(model, options.drags)) > BOUND
    return int(failed)


def report(title: str, every: dict[str, list[float]]) -> float:
    """Print how long calls took, by verb; the median of those while something is dragged."""
    for verb, seconds in every.items():
        if seconds:
            most = 1e3 * np.percentile(seconds, 95)
            row(title, verb, [1e3 * s for s in seconds], "ms", f"95 % below {most:.1f} ms")
    held = [s for verb in HELD for s in every[verb]]
    row(title, "while dragged", [1e3 * s for s in held], "ms", f"bound {1e3 * BOUND:g} ms")
    return float(np.median(held))


if __name__ == "__main__":
    sys.exit(main())
