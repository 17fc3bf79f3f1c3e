"""Run benchmarks one after the other, and collect what they print into site/bench/report.md and report.json.

    python tools/bench.py [NAME...] [--smoke] [--again]

Numbers of benchmarks in the manual are of these commands. Results are kept by benchmark and by commit, so that a run
that was interrupted goes on where no file has changed, and runs of single benchmarks add to the same report. `--smoke`
runs those that are quick at tiny sizes; their numbers mean nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import tempfile
import time
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "benchmarks"
REPORT = ROOT / "site" / "bench"
NOTES = "VELATURA_BENCH_ROWS"  # as benchmarks/rows.py reads it
DIRTY = "+"
PACKAGES = ("velatura", "mitsuba", "drjit", "numpy", "scipy")

#: Commands of a benchmark, where that is not the one without options.
COMMANDS = {
    "engines": ["", "--quad"],
    "fidelity": ["--half test"],
    "fit": ["--cases 16 --seed 41"],
    "inverse": ["", "--parts films --seed 1", "--parts physical rough --models bati2021 --physical 500 --seed 1"],
    "laws": ["", "--random 500"],
    "metals": ["--walks 400000"],
    "render": ["", "--solids", "--mixtures"],
    "shader": ["--language all", "--textured"],
}
FIRST = ("walks",)  # which others read
#: Sizes at which each takes seconds. Tests run slices of `fit`, `imports`, `inverse`, `refusals` and `tables` besides.
SMOKE = {
    "bakes": "--presets bare-gold --targets gltf",
    "coat": "--sets absorbing",
    "continuity": "--material 'smooth coat' --parameter layer1_alpha --steps 8",
    "diffuse": "--stacks 1 --paths 1000",
    "exact": "--kinds 'two interfaces' --count 1000 --spp 1 --rounds 2 --size 8",
    "interfaces": "--rounds 2 --most 2 --spp 1 --size 8 --count 64",
    "memory": "--rounds 1 --steps import",
    "metals": "--metals Cu --coats 2",
    "nearest": "--wishes 3 --brute 50 --model bati2021",
    "models": "--rounds 2 --spp 1 --size 8 --models bati2021",
    "pigments": "--mixtures 3",
    "preparation": "--rounds 2 --presets bare-gold --kinds isotropic",
    "reference": "--part statistics --paths 1000",
    "render": "--rounds 2 --spp 1 --size 8 --count 64 --model bati2021",
    "solvers": "--wishes 2 --model bati2021",
    "startup": "--rounds 1 --only 'velatura --help'",
}


def names() -> list[str]:
    """Benchmarks, in the order in which they run."""
    programs = sorted(path.stem for path in FOLDER.glob("*.py") if "__main__" in path.read_text(encoding="utf-8"))
    return [*FIRST, *(name for name in programs if name not in FIRST)]


def run(name: str, options: str) -> dict[str, Any]:
    """The output of one command, its rows, and the circumstances."""
    with tempfile.NamedTemporaryFile("r", suffix=".jsonl", encoding="utf-8") as rows:
        command = [sys.executable, str(FOLDER / f"{name}.py"), *shlex.split(options)]
        load, begin = os.getloadavg()[0], time.perf_counter()
        environment = {**os.environ, NOTES: rows.name}
        lines = []
        with subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as process:
            try:
                for line in process.stdout or ():
                    print(line, end="", flush=True)
                    lines.append(line)
            except KeyboardInterrupt:
                process.terminate()
                raise
        return {
            "command": f"benchmarks/{name}.py {options}".strip(),
            "status": process.returncode,
            "seconds": round(time.perf_counter() - begin, 1),
            "load": [round(load, 1), round(os.getloadavg()[0], 1)],
            "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "rows": [json.loads(line) for line in rows],
            "output": "".join(lines),
        }


def machine() -> dict[str, Any]:
    """Facts that numbers depend on."""
    processors = re.findall(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "processor": processors[0] if processors else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "memory": f"{memory:.0f} GiB",
        "system": platform.platform(),
        "Python": platform.python_version(),
        **{name: metadata.version(name) for name in PACKAGES},
    }


def commit() -> str:
    """The commit, marked where files differ from it."""

    def git(*arguments: str) -> str:
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True).stdout.strip()

    return git("rev-parse", "--short=12", "HEAD") + (DIRTY if git("status", "--porcelain", "-uno") else "")


def markdown(report: dict[str, Any]) -> str:
    """The report as a page."""
    lines = ["# Benchmarks", "", "| | |", "|---|---|"]
    lines += [f"| {key} | {value} |" for key, value in report["machine"].items()]
    for name, part in report["benchmarks"].items():
        lines += ["", f"## {name}", "", part["about"]]
        for each in part["runs"]:
            ended = "" if each["status"] == 0 else f"; **ended with status {each['status']}**"
            lines += ["", f"`{each['command']}`: commit {part['commit']}, {each['date']}, {each['seconds']} s, load "
                      f"{each['load'][0]} before and {each['load'][1]} after{ended}", ""]  # fmt: skip
            if each["rows"]:
                lines += [
                    "| | | median | quartiles | times | |",
                    "|---|---|---|---|---|---|",
                    *map(_cells, each["rows"]),
                ]
            if not each["rows"] or each["status"]:
                lines += ["```text", each["output"].rstrip(), "```"]
    return "\n".join([*lines, ""])


def _cells(row: dict[str, Any]) -> str:
    spread = f"{row['low']:.3g} to {row['high']:.3g}" if row["times"] > 1 else ""
    middle = f"{row['median']:.3g} {row['unit']}"
    return f"| {row['table']} | {row['name']} | {middle} | {spread} | {row['times']} | {row['remark']} |"


def collect(folder: Path) -> None:
    """Write the report of all results that there are."""
    parts = {name: folder / f"{name}.json" for name in names()}
    found = {name: json.loads(path.read_text(encoding="utf-8")) for name, path in parts.items() if path.is_file()}
    report = {"machine": machine(), "benchmarks": found}
    (folder / "report.json").write_text(json.dumps(report, indent=1), encoding="utf-8")
    (folder / "report.md").write_text(markdown(report), encoding="utf-8")


def _is_done(path: Path, now: str) -> bool:
    """Whether there is a result of this commit, all commands of which ended well."""
    if now.endswith(DIRTY) or not path.is_file():
        return False
    part = json.loads(path.read_text(encoding="utf-8"))
    return bool(part["commit"] == now and not any(each["status"] for each in part["runs"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(names())}; all without")
    parser.add_argument("--smoke", action="store_true", help="tiny sizes")
    parser.add_argument("--again", action="store_true", help="also what has a result of this commit")
    parser.add_argument("--folder", type=Path, default=REPORT)
    options = parser.parse_args()
    if unknown := set(options.names) - set(SMOKE if options.smoke else names()):
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}")
    options.folder.mkdir(parents=True, exist_ok=True)
    failed, now = [], commit()
    interrupted = False
    try:
        for name in options.names or (SMOKE if options.smoke else names()):
            path = options.folder / f"{name}.json"
            if not options.again and _is_done(path, now):
                continue
            print(f"== {name}", flush=True)
            commands = [SMOKE[name]] if options.smoke else COMMANDS.get(name, [""])
            runs = [run(name, each) for each in commands]
            failed += [name] if any(each["status"] for each in runs) else []
            about = (FOLDER / f"{name}.py").read_text(encoding="utf-8").removeprefix('"""').split("\n", 1)[0]
            path.write_text(json.dumps({"commit": now, "about": about, "runs": runs}, indent=1), encoding="utf-8")
    except KeyboardInterrupt:
        interrupted = True
    collect(options.folder)
    print(f"The report is {options.folder / 'report.md'}")
    if interrupted:
        sys.exit(130)
    if failed:
        sys.exit(f"bench: {', '.join(failed)} failed")


if __name__ == "__main__":
    main()
