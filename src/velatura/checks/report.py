"""The outcome of every law: findings, and the report that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from velatura.checks.probe import Array


@dataclass(frozen=True)
class Finding:
    """The outcome of one law.

    Args:
        law: its name.
        passed: whether the law was kept; `value <= bound`, except for noise and rounding that the law allows.
        value, bound: the number that decides, and the largest that is allowed, where it came closest or went furthest.
        detail: the same in words, with the other numbers of interest.
        data: what to plot: curves (their first one is the abscissa) or pictures.
        declared: the law is not expected to hold here, and only its number is of interest.
    """

    law: str
    passed: bool
    value: float
    bound: float
    detail: str
    data: Mapping[str, Array] = field(default_factory=dict, repr=False, compare=False)
    declared: bool = False

    @property
    def status(self) -> str:
        """`kept`, `broken`, or `declared`: not kept, as declared beforehand."""
        return "kept" if self.passed else "declared" if self.declared else "broken"


@dataclass(frozen=True)
class Report:
    """The outcome of all laws.

    Args:
        findings: one for each law, in the order of LAWS.
        false_alarms: probability that a BSDF that keeps all laws is reported to break one, by chance.
    """

    findings: tuple[Finding, ...]
    false_alarms: float

    @property
    def broken(self) -> tuple[str, ...]:
        """Names of the laws that are broken but not declared."""
        return tuple(finding.law for finding in self.findings if finding.status == "broken")

    @property
    def passed(self) -> bool:
        """Whether no law is broken."""
        return not self.broken

    def __getitem__(self, law: str) -> Finding:
        """The finding of one law. Raises KeyError."""
        found = {finding.law: finding for finding in self.findings}
        return found[law]

    def to_dict(self) -> dict[str, Any]:
        """All data except plots, for JSON (numbers that are not finite as None)."""
        rows = [
            {
                "law": finding.law,
                "status": finding.status,
                "value": _finite(finding.value),
                "bound": _finite(finding.bound),
                "detail": finding.detail,
            }
            for finding in self.findings
        ]
        return {"passed": self.passed, "false_alarms": self.false_alarms, "laws": rows}


def _finite(number: float) -> float | None:
    return number if abs(number) < float("inf") else None
