"""The laws of `velatura check`, for every named model in both forms, on every preset or on random stacks.

    python benchmarks/laws.py [--models NAME ...] [--forms forward symmetric] [--presets NAME ... | --random N]
                              [--seed 0] [--results FILE] [--processes 1]

Random stacks are the tame ones of `fuzz.py`, with 1 to 5 interfaces: opaque ones and panes, brushed and turned, over
metals, mirrors, glass and diffuse bases, with media that absorb and scatter. A line for each check lists the broken
laws, and the values of the declared ones. A summary by model and form, and the broken laws, come last; the exit status
is 1 if anything is. FILE keeps the findings of every check, a line of JSON each, and those that it has are not checked
again. All models on all presets take five minutes, 500 random stacks in both forms of `velatura` two hours.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rows import parsed

import velatura as vt
from velatura import kernel

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

from fuzzing.stacks import random_stack

AT_A_TIME = 40  # checks of a process, which keeps every program that it compiles

Job = tuple[str, str, str]  # model, form, material: the name of a preset, or seed and number of a random stack
Row = dict[str, Any]


def material(name: str) -> vt.Stack | vt.Mix:
    """A preset, or a random stack of the name "random SEED NUMBER"."""
    if name in vt.presets():
        return vt.load(name)
    _, seed, number = name.split()
    return random_stack(np.random.default_rng((int(seed), int(number))))


def checked(job: Job) -> Row:
    """The findings of a check."""
    kernel.mitsuba("llvm_ad_rgb")
    model, form, name = job
    start = time.perf_counter()
    report = vt.check(material(name), model=model, form=form)
    return {"job": job, "seconds": time.perf_counter() - start, **report.to_dict()}


def every(jobs: list[Job], results: Path | None, processes: int) -> Iterator[Row]:
    """The findings of all checks; those of the file first."""
    rows = [json.loads(line) for line in results.read_text().splitlines()] if results and results.exists() else []
    known = {tuple(row["job"]): row for row in rows}
    yield from (known[job] for job in jobs if job in known)
    left = [job for job in jobs if job not in known]
    spawn = multiprocessing.get_context("spawn")
    with spawn.Pool(processes, maxtasksperchild=AT_A_TIME) as pool:
        for row in pool.imap(checked, left):
            if results:
                with results.open("a") as stream:
                    stream.write(json.dumps(row) + "\n")
            yield row


def main() -> None:
    arguments = parsed(
        __doc__,
        models=[model.name for model in vt.MODELS],
        forms=["forward", "symmetric"],
        presets=list(vt.presets()),
        random=(int, "random stacks instead of presets"),
        seed=(0, "of random stacks"),
        results=Path,
        processes=1,
    )
    materials = arguments.presets
    if arguments.random:
        materials = [f"random {arguments.seed} {number}" for number in range(arguments.random)]
    jobs = [(model, form, name) for name in materials for model in arguments.models for form in arguments.forms]

    # Hold all of them to the laws
    declared: dict[tuple[str, str], list[Row]] = defaultdict(list)
    broken: list[str] = []
    for number, row in enumerate(every(jobs, arguments.results, arguments.processes), 1):
        model, form, name = row["job"]
        laws = {
            status: [law for law in row["laws"] if law["status"] == status] for status in ("kept", "declared", "broken")
        }
        declared[model, form] += laws["declared"]
        broken += [f"{model} {form} {name}: {_described(law)}" for law in laws["broken"]]
        found = [*(f"BROKEN {_described(law)}" for law in laws["broken"]), *map(_short, laws["declared"])]
        print(
            f"{number}/{len(jobs)} {row['seconds']:5.1f} s  {model} {form} {name}: {', '.join(found) or 'kept'}",
            flush=True,
        )

    # Sum up
    print(f"\nlaws that are not kept, as declared: on how many of {len(materials)} materials (largest number)")
    for (model, form), findings in sorted(declared.items()):
        print(f"{model:14s} {form:10s} {_needed(findings) or 'none'}")
    print(f"\n{len(jobs)} checks, {len(broken)} broken laws", *broken, sep="\n")
    sys.exit(1 if broken else 0)


def _described(law: Row) -> str:
    return f"{_short(law)}, at most {law['bound']:.3g}; {law['detail']}"


def _short(law: Row) -> str:
    return f"{law['law']} {law['value']:.3g}"


def _needed(findings: list[Row]) -> str:
    by_law = {
        name: [x["value"] for x in findings if x["law"] == name] for name in dict.fromkeys(x["law"] for x in findings)
    }
    return ", ".join(f"{law} {len(values)} ({max(values):.3g})" for law, values in by_law.items())


if __name__ == "__main__":
    main()
