"""The laws that every BSDF must keep, checked on any BSDF of Mitsuba's, ours or not."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from velatura.checks.evidence import gather
from velatura.checks.laws import LAWS, Law
from velatura.checks.plots import check_folder, save
from velatura.checks.probe import Probe
from velatura.checks.report import Finding, Report
from velatura.errors import InvalidInput, short

__all__ = ["FALSE_ALARMS", "LAWS", "Finding", "Law", "Report", "check"]

#: Probability that a BSDF that keeps all laws is reported to break one.
FALSE_ALARMS = 1e-3


def check(
    bsdf: Any,
    *,
    exceptions: Collection[str] = (),
    lossless: bool = False,
    expected: Any = None,
    turned: tuple[Any, float] | None = None,
    uv: tuple[float, float] = (0.5, 0.5),
    seed: int = 0,
    plots: str | Path | None = None,
    subject: str = "BSDF",
    progress: Callable[[int, int], None] | None = None,
) -> Report:
    """Hold a BSDF to the laws.

    Args:
        bsdf: any `mi.BSDF` of the variant that is set, which must be a vectorised one.
        exceptions: names of laws that it is declared not to keep, beside those in its own attribute `exceptions` if it
            has one: these give numbers, and no failure.
        lossless: it absorbs nothing, so that loss breaks a law as well as gain does.
        expected: the BSDF that this one should equal, if it is the limit of something.
        turned: the BSDF whose layers are those of this one, turned by an angle (degrees, anticlockwise).
        uv: where on its textures it is looked at.
        seed: of the random numbers; the same seed gives the same report, except for rounding.
        plots: a folder; every law that is broken leaves `LAW.png` there.
        subject: what these call the BSDF.
        progress: called with (steps done, all steps) now and then.

    Raises:
        InvalidInput: no BSDF, an exception that is no law, a scalar variant, a folder that cannot be written.
    """
    if not hasattr(bsdf, "flags"):
        raise InvalidInput(f"must be a BSDF of Mitsuba's, or a material, got {short(repr(bsdf), 60)}")
    declared = {*exceptions, *getattr(bsdf, "exceptions", ())}
    unknown = sorted(declared - {law.name for law in LAWS})
    if unknown:
        raise InvalidInput(f"{unknown[0]}: is no law, must be one of {', '.join(law.name for law in LAWS)}")
    folder = None if plots is None else check_folder(plots)

    # Gather evidence once, and let every law judge it
    other = None if expected is None else Probe(expected, uv)
    also = None if turned is None else (Probe(turned[0], uv), turned[1])
    evidence = gather(Probe(bsdf, uv), other, also, lossless, seed, progress)
    alarm = 1 - (1 - FALSE_ALARMS) ** (1 / len(LAWS))
    judged = (law.judge(evidence, alarm) for law in LAWS)
    findings = tuple(replace(found, declared=found.law in declared) for found in judged if found)
    report = Report(findings, FALSE_ALARMS, subject)

    # Show what is broken
    if folder is not None:
        for law in report.broken:
            save(report[law], folder, subject)
    return report
