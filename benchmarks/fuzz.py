"""Random inputs of every kind, and what must hold of each: stacks, laws, files, command lines.

    python benchmarks/fuzz.py [PROGRAM ...] [--count N] [--seed 0] [--processes 2]
                              [--failures FOLDER] [--index I]

lobes      stacks through `vt.lobes`, all models and switches, cosines to 1e-6: finite, no energy gained, no jumps
plugin     stacks through `vt.bsdf`, all models, either side, down to the horizon: its functions agree, see laws
scalar     stacks through `vt.bsdf` in scalar_rgb, the exact normal and the mirror direction too: as plugin, none raises
gradients  stacks through `vt.bsdf`, every kind of number: gradients are differences of the light that leaves
check      `vt.check` on tame stacks: no law is broken that its model does not declare
files      mutated material files: refused in one line that names the file, or equal once written and read again
imports    likewise files of other programs, tables, spectra and textures; in bounded time and memory
targets    mutated target files: refused in one line, or for a part solved, or refused with a reason
commands   mutated command lines and input files: no traceback, a known status, nothing written or lost on refusal
wishes     random wishes to coat, simplify, explore and fit, hostile numbers among them: as commands
plans      mutated plans of sweeps: refused in one line that names the file, or their points have stacks
candidates hostile functions and files in the benchmark: refused in one line, or scored; the truth stays as it is

Without a name all run. FOLDER gets the smallest input of each kind of failure as YAML; `--index` repeats one input in
this process. Exit status 1 if anything fails, the death of a process included. All take an hour on two quiet cores.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import yaml
from rich.progress import Progress
from rows import parser

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "shared"))

from fuzzing import (
    Failure,
    Trial,
    candidates,
    checking,
    commands,
    files,
    gradients,
    imports,
    lobes,
    plans,
    plugin,
    scalar,
    targets,
    wishes,
)

# The whole count, and how many are tried before the processes are new ones: they keep every program that they compile
PROGRAMS: dict[str, tuple[Trial, int, int]] = {
    "lobes": (lobes.trial, 100_000, 5_000),
    "plugin": (plugin.trial, 2_000, 100),
    "scalar": (scalar.trial, 400, 100),
    "gradients": (gradients.trial, 300, 50),
    "check": (checking.trial, 500, 100),
    "files": (files.trial, 15_000, 1_500),
    "imports": (imports.trial, 15_000, 1_000),
    "targets": (targets.trial, 5_000, 500),
    "commands": (commands.trial, 500, 100),
    "wishes": (wishes.trial, 800, 100),
    "plans": (plans.trial, 1_000, 500),
    "candidates": (candidates.trial, 2_000, 500),
}

Found = list[tuple[int, Failure]]


def tried(name: str, seed: int, indices: Sequence[int]) -> Found:
    """The failures of some inputs of a program."""
    trial, *_ = PROGRAMS[name]
    return [(i, failure) for i in indices for failure in trial(np.random.default_rng((seed, *name.encode(), i)))]


def blocks(name: str, count: int, seed: int, processes: int) -> Iterator[tuple[int, Found]]:
    """How many inputs were tried, and their failures."""
    for block in np.array_split(range(count), -(-count // PROGRAMS[name][2])):
        yield len(block), _in_processes(name, seed, block.tolist(), processes)


def _in_processes(name: str, seed: int, indices: list[int], processes: int) -> Found:
    """Results of `tried`; what ends its process is found by trying again in halves."""
    parts = [indices[k::processes] for k in range(processes)]
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        running = [pool.submit(tried, name, seed, part) for part in parts]
        try:
            return [found for each in running for found in each.result()]
        except BrokenProcessPool:
            pass
    if len(indices) == 1:
        return [(indices[0], Failure("the process died", f"--index {indices[0]} repeats it"))]
    middle = len(indices) // 2
    return [x for half in (indices[:middle], indices[middle:]) for x in _in_processes(name, seed, half, 1)]


def report(name: str, seed: int, found: Found, folder: Path | None) -> None:
    """Print the kinds of failures, the smallest input of each; write these to a folder."""
    kinds: dict[str, Found] = defaultdict(list)
    for index, failure in found:
        kinds[failure.kind].append((index, failure))
    for kind, each in kinds.items():
        inputs = len({index for index, _ in each})
        index, failure = min(each, key=lambda x: len(yaml.safe_dump(x[1].case)))
        print(f"    {inputs} x {kind}; --index {index}: {failure.detail}")
        if folder:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / f"{name}-{''.join(c if c.isalnum() else '-' for c in kind)}.yaml"
            known = {"kind": kind, "detail": failure.detail, "seed": seed, "index": index, "inputs": inputs}
            path.write_text(yaml.safe_dump({**known, "input": failure.case}, sort_keys=False))


def main() -> None:
    count, index = (int, "inputs of each program; else all"), (int, "of one input, tried alone in this process")
    program = parser(__doc__, count=count, seed=0, processes=2, failures=Path, index=index)
    program.add_argument("programs", nargs="*", metavar="PROGRAM", help=", ".join(PROGRAMS))
    arguments = program.parse_args()
    if unknown := [name for name in arguments.programs if name not in PROGRAMS]:
        program.error(f"no such program: {', '.join(unknown)}")

    rows, failed = [], 0
    for name in arguments.programs or PROGRAMS:
        start = time.perf_counter()
        found: Found = []
        if arguments.index is not None:
            count, found = 1, tried(name, arguments.seed, [arguments.index])
        else:
            count = arguments.count or PROGRAMS[name][1]
            with Progress(disable=not sys.stderr.isatty(), transient=True) as progress:
                task = progress.add_task(name, total=count)
                for done, failures in blocks(name, count, arguments.seed, arguments.processes):
                    found += failures
                    progress.update(task, advance=done, description=f"{name}, {len({i for i, _ in found})} failed")
                    for index, failure in failures if progress.disable else ():
                        print(f"{name} --index {index}: {failure.kind}; {failure.detail}", file=sys.stderr, flush=True)
        inputs = len({index for index, _ in found})
        rows.append(f"{name:10s}{count:10d}{inputs:10d}{time.perf_counter() - start:10.0f}")
        failed += inputs
        print(f"{name}: {inputs} of {count} failed", flush=True)
        report(name, arguments.seed, found, arguments.failures)
    print(f"\n{'program':10s}{'tried':>10s}{'failed':>10s}{'seconds':>10s}", *rows, sep="\n")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
