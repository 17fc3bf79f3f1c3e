"""Cost and error of models of layers: total variation against the cost of an evaluation, and of a change.

Not a figure of a paper. The error is that of the benchmark's second edition, stacks as people make them, lit up to
grazing angles; that of other walks is the noise of the truth. An evaluation is `eval_pdf` over that of Mitsuba's
`roughconductor`, of one lobe. A change is another value of a roughness, until the BSDF has been evaluated once, in
milliseconds of the processor. Programs with parameters of their own, `principled` and OpenPBR, are fitted to the stack
again, which is most of what a change takes there. OpenPBR is evaluated by formulas in NumPy, which no renderer uses.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from velatura import api, benchmark, kernel
from velatura.benchmark import Case, Walk
from velatura.benchmark.candidates import Candidate, Plugin, made
from velatura.figures import Progress, canvas, evaluation
from velatura.model import MODELS

WALK = "walk"
SYMMETRIC = "-symmetric"
BAKED = ("principled", "openpbr")
NAMES = (*(f"{model.name}{form}" for model in MODELS for form in ("", SYMMETRIC)), "weidlich_wilkie", *BAKED, WALK)
#: Whose cost is measured: of the second edition, opaque ones that are bare metal below, and others.
STACKS = (
    "anodised-aluminium-01",
    "car-paint-00",
    "brushed-under-lacquer-01",
    "four-to-six-coats-00",
    "large-steps-01",
    "glaze-00",
    "wet-asphalt-00",
)
YARDSTICK = "roughconductor"
WARMING = 2  # changes that do not count, since they compile
TO, FROM = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


def compute(
    names: Sequence[str] = NAMES,
    kinds: Sequence[str] | None = None,
    stacks: Sequence[str] = STACKS,
    rounds: int = 7,
    lanes: int = evaluation.LANES,
    seed: int = 0,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Numbers of each entrant of the benchmark, by `name`: total `variation`, and its `noise`, of what it can express,
    the `share` of all records that this is; `evaluation`, the median over stacks, and `from` and `to` on them, None
    where it is no plugin; and `change` in ms."""
    cases = [case for case in benchmark.edition(2) if case.id in stacks]
    costs = _evaluations(names, cases, rounds, lanes, seed)
    entrants = []
    for name in canvas.track(names, progress):
        summary = benchmark.score(benchmark.entrant(name), name, kinds, edition=2).summary()
        found = costs.get(name)
        changes = [
            _change(name, case, 1 if name in BAKED else rounds) for case in cases if _made(name, case) is not None
        ]
        entrants.append(
            {
                "name": name,
                "variation": summary["variation"],
                "noise": summary["floor"],
                "share": summary["records"] / summary["asked"],
                "evaluation": float(np.median(found)) if found else None,
                "from": min(found) if found else None,
                "to": max(found) if found else None,
                "change": float(np.median(changes)),
            }
        )
    return {"stacks": list(stacks), "entrants": entrants}


def _made(name: str, case: Case) -> Candidate:
    """The candidate that an entrant makes of a stack; a BSDF of the walk as well."""
    found = made(benchmark.entrant(name)(case))
    return Plugin(api.bsdf(case.stack, "reference")) if isinstance(found, Walk) else found


def _evaluations(
    names: Sequence[str], cases: Sequence[Case], rounds: int, lanes: int, seed: int
) -> Mapping[str, list[float]]:
    """The cost of `eval_pdf` over that of one lobe on each stack, of entrants that are plugins."""
    found: dict[str, list[float]] = {}
    for case in cases:
        plugins = {name: _made(name, case) for name in names}
        bsdfs = {name: each.probe.bsdf for name, each in plugins.items() if isinstance(each, Plugin)}
        lobe = kernel.load_dict({"type": YARDSTICK, "distribution": "ggx", "alpha": 0.2})
        others = dict.fromkeys(bsdfs, YARDSTICK)
        each = evaluation.costs({**bsdfs, YARDSTICK: lobe}, others, rounds, seed, lanes)["eval_pdf"]
        for name, cost in each.items():
            found.setdefault(name, []).append(cost["median"])
    return found


def _change(name: str, case: Case, rounds: int) -> float:
    """Milliseconds of the processor, the median over rounds, until a stack of another roughness has been evaluated."""
    roughness = next(key for key in case.stack.flat() if key.endswith("_alpha_u"))
    keys = roughness, f"{roughness[:-1]}v"
    spent = []
    for k in range(WARMING + rounds):
        alpha = 0.05 + 0.3 * k / (WARMING + rounds)
        changed = replace(case, stack=case.stack.replace(**dict.fromkeys(keys, alpha)))
        begin = time.process_time()
        candidate = _made(name, changed)
        if isinstance(candidate, Plugin):
            candidate.probe.eval_pdf(TO, FROM)
        else:
            candidate(TO, FROM)
        spent.append(1000 * (time.process_time() - begin))
    return float(np.median(spent[WARMING:]))


@canvas.page(12, 5.5)
def draw(figure: Any, numbers: dict[str, Any]) -> None:
    """Two plots of the error of each entrant: over the cost of an evaluation, and over that of a change."""
    plots = figure.subplots(1, 2, sharey=True)
    found = {each["name"]: each for each in numbers["entrants"]}
    bases = [name for name in found if not name.endswith(SYMMETRIC)]
    for plot, key in zip(plots, ("evaluation", "change")):
        for n, name in enumerate(bases):
            each, colour = found[name], "black" if name == WALK else f"C{n}"
            if each[key] is None:
                plot.axhline(each["variation"], color=colour, linewidth=1, linestyle=":")
                continue
            face = colour if each["share"] == 1 else "white"
            plot.plot(each[key], each["variation"], "o", color=colour, markerfacecolor=face, label=name)
            if key == "evaluation":
                plot.plot([each["from"], each["to"]], [each["variation"]] * 2, color=colour, linewidth=3, alpha=0.2)
            other = found.get(f"{name}{SYMMETRIC}")
            if other:
                plot.plot(other[key], other["variation"], "s", color=colour)
                ends = [each[key], other[key]], [each["variation"], other["variation"]]
                plot.plot(*ends, color=colour, linewidth=0.8)
        plot.axhline(min(each["noise"] for each in found.values()), color="grey", linewidth=0.8, linestyle="--")
        plot.set(xscale="log", yscale="log")
        plot.margins(x=0.15)
        plot.grid(alpha=0.3, which="both")
    plots[0].set(xlabel=f"eval_pdf, over {YARDSTICK}", ylabel="total variation against walks")
    plots[1].set(xlabel="a changed stack until it is evaluated, ms of the processor")
    figure.legend(*plots[1].get_legend_handles_labels(), loc="outside right upper", fontsize="small")
    figure.suptitle(
        "Circles: forward; squares: symmetric; bars: from the cheapest to the dearest stack\n"
        "open: some stacks cannot be expressed; dotted: formulas, not timed; dashed: noise of the truth",
        fontsize="small",
    )
