"""Mutated target files: each is refused in one line, solved, or refused with a reason; never an error of Python."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import velatura as vt
from fuzzing import Failure
from fuzzing.files import changed
from velatura.errors import InvalidInput
from velatura.inverse import Infeasible, Target, alternatives, invert_stack, load_target
from velatura.stack import dumps, loads

INVERTED, SLOW_S = 0.1, 60.0  # share that is inverted, too, and seconds of processor time for that
MODELS = ("bati2021", "bati2021", "belcour2018", "velatura")


def trial(rng: np.random.Generator) -> list[Failure]:
    """A target of any kind, mutated; one in ten is inverted."""
    model = str(rng.choice(MODELS)) if rng.random() < INVERTED else ""
    return tried(mutated(rng), model, more=rng.random() < 0.2)


def mutated(rng: np.random.Generator) -> str:
    """A target of any kind as YAML, changed in up to three places."""
    text = yaml.safe_dump(random_target(rng), sort_keys=False, default_flow_style=bool(rng.random() < 0.5) or None)
    for _ in range(rng.integers(4)):
        text = changed(text, rng)
    return text


def random_target(rng: np.random.Generator) -> dict[str, Any]:
    """The mapping of a target of one to three lobes, with pairs, metals, mirrors, films, brushing and fixed values."""
    lobes = []
    count = int(rng.integers(1, 4))
    for n in range(count):
        interfaces = int(rng.integers(1, 3))
        base = str(rng.choice(["dielectric", "conductor", "mirror"])) if n == count - 1 else "dielectric"
        energy = np.exp(rng.uniform(np.log(0.005), np.log(0.4))) * rng.uniform(0.3, 1, 3)
        lobe: dict[str, Any] = {"energy": float(energy[0]) if rng.random() < 0.6 else energy.tolist()}
        if rng.random() < 0.2:
            lobe |= {"alpha": rng.uniform(0, 0.6, 2).tolist(), "rotation": float(rng.uniform(-180, 180))}
        elif rng.random() < 0.8:
            lobe[str(rng.choice(["alpha", "variance"]))] = float(rng.uniform(0, 0.4))
        lobe |= {"interfaces": interfaces, "base": base} | ({"tint": 0.3} if base == "conductor" else {})
        fixed = {key: _entries(key, interfaces, rng) for key in ("eta", "alpha", "tau", "films") if rng.random() < 0.12}
        lobes.append(lobe | ({"fixed": fixed} if fixed else {}))
    target: dict[str, Any] = {"name": "mutated", "lobes": lobes}
    if rng.random() < 0.2:
        target |= {"exterior": float(rng.uniform(1, 1.6)), "eta_max": float(rng.uniform(2, 4))}
    if rng.random() < 0.2:
        target["channels"] = str(rng.choice(["mean", "separate"]))
    if rng.random() < 0.2:
        target["start"] = vt.preset(str(rng.choice(vt.presets(mixtures=False)))).to_dict()
    return target


def _entries(key: str, interfaces: int, rng: np.random.Generator) -> list[Any]:
    values = {
        "eta": float(rng.uniform(1, 2.5)),
        "alpha": float(rng.uniform(0, 0.5)),
        "tau": rng.uniform(0, 0.5, 3).tolist(),
        "films": [{"eta": 1.8, "thickness_nm": float(rng.uniform(20, 400))}],
    }
    return [values[key] if rng.random() < 0.6 else None for _ in range(interfaces)]


def tried(text: str, model: str = "", more: bool = False) -> list[Failure]:
    """Failures of how a target file of this content is read, and, if a model is given, inverted."""
    case = {"content": text, "model": model}
    start = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "target.yaml")
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        try:
            target = load_target(path)
            wrong = _again(target) or (_inverted(target, model, more) if model else None)
        except InvalidInput as error:
            one_line = len(str(error).splitlines()) == 1 and str(error).isprintable()
            wrong = None if one_line else ("refused in several lines", repr(str(error)))
        except Exception as error:
            wrong = f"raised {type(error).__name__}", repr(str(error))
    if wrong is None and time.process_time() - start > SLOW_S:
        wrong = "slow", f"{time.process_time() - start:.0f} s"
    return [Failure(*wrong, case)] if wrong else []


def _again(target: Target) -> tuple[str, str] | None:
    return None if Target.from_dict(target.to_dict()) == target else ("not equal once written", str(target)[:200])


def _inverted(target: Target, model: str, more: bool) -> tuple[str, str] | None:
    """The fault of the stacks of a target, or of its refusal."""
    try:
        found = alternatives(target, 3, model) if more else [invert_stack(target, model)]
    except Infeasible as error:
        if len(str(error).splitlines()) != 1 or "nan" in str(error) or not error.why:
            return "a reason that is none", repr(str(error))
        return None
    for each in found:
        if loads(dumps(each.stack)) != each.stack:  # which no number that is not finite is
            return "a stack that is not read again", dumps(each.stack)[:200]
        energies = np.array(vt.lobes(each.stack, 1.0, model=model).energy)
        if not np.all(np.isfinite(energies)) or energies.min() < 0 or energies.max() > 1 + 1e-6:
            return "energies that cannot be", str(energies)[:200]
    return None
