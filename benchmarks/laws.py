"""The laws of `velatura check`, for every named model on every preset, in both forms, in reflection and transmission.

A line for each check lists the broken laws, and the values of the declared ones. A summary by model and form, and the
broken laws, come last; the exit status is 1 if anything is. It takes five minutes.

    python benchmarks/laws.py [--models NAME ...] [--presets NAME ...] [--forms forward symmetric]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict

import velatura as vt
from velatura import kernel
from velatura.checks import Finding


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", nargs="+", default=[model.name for model in vt.MODELS])
    parser.add_argument("--presets", nargs="+", default=vt.presets())
    parser.add_argument("--forms", nargs="+", default=["forward", "symmetric"])
    arguments = parser.parse_args()
    kernel.mitsuba("llvm_ad_rgb")
    jobs = [(m, form, name) for m in arguments.models for form in arguments.forms for name in arguments.presets]

    # Hold all of them to the laws
    declared: dict[tuple[str, str], list[Finding]] = defaultdict(list)
    broken: list[str] = []
    for number, (model, form, name) in enumerate(jobs, 1):
        start = time.perf_counter()
        report = vt.check(name, model=model, form=form)
        seconds = time.perf_counter() - start
        known = [finding for finding in report.findings if finding.status == "declared"]
        declared[model, form] += known
        broken += [f"{model} {form} {name}: {report[law]}" for law in report.broken]
        told = [*(f"BROKEN {law}" for law in report.broken), *(f"{law.law} {law.value:.3g}" for law in known)]
        print(f"{number}/{len(jobs)} {seconds:5.1f} s  {model} {form} {name}: {', '.join(told) or 'kept'}", flush=True)

    # Sum up
    print(f"\nlaws that are not kept, as declared: on how many of {len(arguments.presets)} presets (largest number)")
    for (model, form), findings in declared.items():
        print(f"{model:14s} {form:10s} {_needed(findings) or 'none'}")
    print(f"\n{len(jobs)} checks, {len(broken)} broken laws", *broken, sep="\n")
    sys.exit(1 if broken else 0)


def _needed(findings: list[Finding]) -> str:
    by_law = {law: [f.value for f in findings if f.law == law] for law in dict.fromkeys(f.law for f in findings)}
    return ", ".join(f"{law} {len(values)} ({max(values):.3g})" for law, values in by_law.items())


if __name__ == "__main__":
    main()
