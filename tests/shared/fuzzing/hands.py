"""Random edits in the editor's page, each of one control that is there, and what must hold of the page after them."""

from __future__ import annotations

import base64
import hashlib
import math
import random
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from editor import Visit

import velatura as vt
from velatura.editor import service
from velatura.editor.messages import to_write
from velatura.errors import InvalidInput
from velatura.stack.paths import rewritten

MOST_LAYERS = 7  # from which on no more are added
REFUSED = "the server responded with a status of 4"  # what the browser notes of a stack that is refused in words

#: How often a control of a kind is taken; of one kind all are alike.
WEIGHTS = {"range": 8, "number": 4, "select": 3, "checkbox": 2, "button": 5, "grip": 2, "handle": 2, "canvas": 1}

#: Acts on one control of a kind, as its events come of hands; returns what it was, or null where there is none.
ACT = """
({ kind, u, most }) => {
  const where = document.querySelector('dialog[open]') ?? document.querySelector('.velatura');
  const find = {
    range: 'input[type=range]', number: 'input.number', select: 'select', checkbox: 'input[type=checkbox]',
    button: 'button:not(.grip)', grip: '.layer button.grip', handle: '.handle', canvas: '.picture canvas',
  }[kind];
  const named = (e) => e.getAttribute('aria-label') ?? e.textContent.trim().replace(/\\s+/g, ' ');
  const full = velatura.store.get().layers.length >= most;
  const outside = /texture|from a file|From this computer|Download|Share|Save picture|^Copy|Validations/;
  const adding = /^(Interface|Medium|Duplicate|Add a layer)/;
  const possible = [...where.querySelectorAll(find)].filter((e) =>
    e.checkVisibility() && !e.disabled && !outside.test(named(e)) && !(full && adding.test(named(e))));
  if (!possible.length) return null;
  const e = possible[Math.floor(u[0] * possible.length)], name = named(e);
  const dispatch = (type) => e.dispatchEvent(new Event(type, { bubbles: true }));
  const press = (key) => e.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }));
  e.focus();
  if (kind === 'range') {
    for (const part of u.slice(1, 4)) {
      e.value = Math.round(part * Number(e.max));
      dispatch('input');
    }
    dispatch('change');
    return `${name}: ${e.value}`;
  }
  if (kind === 'number') {
    e.value = String(Number((Number(e.value) * 2 * u[1] + (u[2] < 0.2 ? u[3] : 0)).toPrecision(3)));
    dispatch('input');
    dispatch('change');
    e.blur();
    return `${name}: ${e.value}`;
  }
  if (kind === 'select') {
    const options = [...e.options].filter((o) => !o.disabled && !o.selected && o.value !== 'truth');
    if (!options.length) return null;
    e.value = options[Math.floor(u[1] * options.length)].value;
    dispatch('change');
    return `${name}: ${e.value}`;
  }
  if (kind === 'grip') press(u[1] < 0.5 ? 'ArrowUp' : 'ArrowDown');
  else if (kind === 'handle') press(['ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown'][Math.floor(u[1] * 4)]);
  else if (kind === 'canvas') press(['ArrowLeft', 'ArrowRight', 'ArrowUp', '+', '-'][Math.floor(u[1] * 5)]);
  else e.click();
  return name;
}
"""

STATE = "(({ camera, disk, ...state }) => state)(velatura.store.get())"
HEAP = "Runtime.getHeapUsage"


@dataclass
class Outcome:
    """The edits that were done, heaps of the page in MB after each look, and what went wrong."""

    edits: list[str] = field(default_factory=list)
    heaps: list[float] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)


class Hands:
    """Hands on a page of a server that works in a folder."""

    def __init__(self, visit: Visit, folder: Path, seed: int) -> None:
        self.visit, self.page, self.folder = visit, visit.page, folder
        self.rng = random.Random(seed)
        self.outcome = Outcome()
        self.line = self.page.context.new_cdp_session(self.page)

    def edit(self, count: int) -> None:
        """So many edits, some of them while the page still works on those before."""
        done = 0
        while done < count:
            (kind,) = self.rng.choices(list(WEIGHTS), list(WEIGHTS.values()))
            u = [self.rng.random() for _ in range(6)]
            name = self.page.evaluate(ACT, {"kind": kind, "u": u, "most": MOST_LAYERS})
            if name is None:
                continue
            self.outcome.edits.append(f"{kind} {name}")
            done += 1
            self.page.wait_for_timeout(self.rng.choice([0, 5, 100, 300]))

    def look(self) -> None:
        """Wait for the picture, and hold all that the page has against what Python says of it."""
        self.page.evaluate("for (const open of document.querySelectorAll('dialog[open]')) open.close()")
        self.visit.settled()
        self._follows()
        self._undoes()
        self._saves()
        complaints = [text for text in self.visit.complaints if REFUSED not in text]
        self._fail("the console", complaints)
        self.visit.complaints.clear()
        self.line.send("HeapProfiler.collectGarbage")
        self.outcome.heaps.append(self.line.send(HEAP)["usedSize"] / 2**20)

    def reload(self) -> None:
        """Open the page anew; its state and its history are as before. Not where the material has no picture."""
        if any(each["about"] == "a" for each in self.page.evaluate("velatura.problems")):
            return
        known = f"[{STATE}, velatura.store.history().past.length]"
        before = self.page.evaluate(known)
        self.page.reload()
        self.visit.ready()
        if self.page.evaluate(known) != before:
            self._fail("the state after a reload", [str(before)])
        self.visit.settled()

    # What must hold

    def material(self) -> dict[str, Any]:
        """The material of the page as a body has it, with paths of images from anywhere."""
        state = self.visit.state()

        def written(node: dict[str, Any]) -> dict[str, Any]:
            named = {key: node[key] for key in ("name", "source") if node[key]}
            if node.get("parts"):
                return {**named, "mix": [part(each) for each in node["parts"]]}
            own = {**node, **{key: state[key] for key in ("thin", "layers")}} if node["id"] == state["part"] else node
            on = [{layer["kind"]: layer["keys"]} for layer in own["layers"] if layer["enabled"]]
            return {**named, "exterior": state["exterior"], "thin": own["thin"], "layers": on}

        def part(node: dict[str, Any]) -> dict[str, Any]:
            weight = {} if node["weight"] is None else {"weight": node["weight"]}
            return {**weight, "material": written(node)}

        found: dict[str, Any] = rewritten(written({**state, "id": None}), lambda path: str(self.folder / path))
        return found

    def _follows(self) -> None:
        """The picture has the material that the state has, or a message says why not."""
        body = {"material": self.material(), **{key: self.visit.state(key) for key in ("model", "switches")}}
        drawn = self.page.evaluate(
            "(({ key, values, solution }) => ({ key, values, solution }))"
            "({ ...velatura.shader(), ...velatura.viewport.slots.a.contents })"
        )
        said = [each["text"] for each in self.page.evaluate("velatura.problems") if each["about"] == "a"]
        try:
            wanted = service.VERBS["shader"](body)
        except InvalidInput as error:
            if str(error) not in said:
                self._fail("a refusal without a message", [str(error), *said])
            return
        self._fail("a message without a cause", said)
        for key, value in drawn.items():
            if not alike(value, vt_json(wanted[key])):
                self._fail(f"{key} of the picture", [str(body)[:2000]])

    def _undoes(self) -> None:
        """Steps are taken back, and done again."""
        steps = self.rng.randint(1, 6)
        state = self.page.evaluate(STATE)
        done = self.page.evaluate(
            """(steps) => {
              const { store } = velatura;
              let done = 0;
              while (done < steps && store.canUndo) store.undo(), done++;
              return done;
            }""",
            steps,
        )
        self.page.evaluate("(steps) => { while (steps--) velatura.store.redo(); }", done)
        if self.page.evaluate(STATE) != state:
            self._fail(f"{done} steps undone and redone", [str(state)])
        self.visit.settled()

    def _saves(self) -> None:
        """A saved file holds the material, and its images lie beside it."""
        name = f"saved-{len(self.outcome.heaps)}.yaml"
        try:
            stack = to_write({"material": self.material()})
        except InvalidInput:
            return
        self.page.get_by_role("button", name="Save as").click()
        self.page.get_by_label("File name").fill(name)
        self.page.locator("dialog.save").get_by_role("button", name="Save").click()
        self.page.get_by_text(f"Saved {name}").wait_for()
        there, here = (rewritten(each.to_dict(), digest) for each in (vt.load(self.folder / name), stack))
        if there != here:
            self._fail("a saved file", [name])

    def _fail(self, what: str, details: list[str]) -> None:
        last = "; ".join(self.outcome.edits[-40:])
        self.outcome.failures += [
            f"{what}: {detail} (after {len(self.outcome.edits)} edits: {last})" for detail in details
        ]


def digest(path: str) -> str:
    """Digest of an image, by which it is compared, since images of presets are saved beside a file."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def alike(value: Any, wanted: Any) -> bool:
    """Whether values are equal, arrays to single precision, since another process may work them out in another order,
    and numbers to the eight digits that the page keeps of what pigments make."""
    if isinstance(value, list) and isinstance(wanted, list):
        return len(value) == len(wanted) and all(map(alike, value, wanted))
    if {type(value), type(wanted)} <= {int, float}:
        return math.isclose(value, wanted, rel_tol=1e-7)
    if not isinstance(value, dict) or not isinstance(wanted, dict):
        return bool(value == wanted)
    if value.keys() != wanted.keys():
        return False
    if value.keys() != {"dtype", "shape", "data"}:
        return all(alike(entry, wanted[key]) for key, entry in value.items())
    found, expected = (np.frombuffer(base64.b64decode(x["data"]), x["dtype"]) for x in (value, wanted))
    return value["shape"] == wanted["shape"] and np.allclose(found, expected, rtol=1e-5, atol=1e-6)


def vt_json(value: Any) -> Any:
    """The value as JSON brings it: tuples are lists."""
    if isinstance(value, dict):
        return {key: vt_json(entry) for key, entry in value.items()}
    return [vt_json(entry) for entry in value] if isinstance(value, list | tuple) else value
