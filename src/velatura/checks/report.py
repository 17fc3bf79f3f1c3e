"""The outcome of every law: findings, and the report that holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from velatura.checks.probe import Array
from velatura.errors import needs
from velatura.results import Result, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 3.0  # value over bound, in a plot
STYLES = {"kept": "green", "declared": "yellow", "broken": "red"}  # as Rich names them
COLOURS = {"kept": "seagreen", "declared": "goldenrod", "broken": "crimson"}  # as Matplotlib


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


@dataclass(frozen=True, repr=False)
class Report(Result):
    """The outcome of all laws.

    Args:
        findings: one for each law, in the order of LAWS.
        false_alarms: probability that a BSDF that keeps all laws is reported to break one, by chance.
        subject: what was checked.
    """

    findings: tuple[Finding, ...]
    false_alarms: float
    subject: str = ""

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

    def as_tables(self) -> list[Table]:
        """A row per law."""
        numbers = ("value", "bound")
        rows = [(f.law, f.status, f"{f.value:.4g}", f"{f.bound:.4g}", f.detail) for f in self.findings]
        caption = f"false alarms: {self.false_alarms:g} of all reports"
        return [Table(self.subject, ("law", "", *numbers, "detail"), rows, numbers, ("detail",), caption, STYLES)]

    def plot(self, axes: Axes | None = None) -> Axes:
        """The value of every law over its bound, as bars: green is kept, yellow declared, red broken.

        Args:
            axes: Matplotlib's to draw on, those of a new figure by default.

        Raises:
            MissingTool: the extra `plots` is not installed.
        """
        with needs("plots"):
            from matplotlib import pyplot
        height = 0.3 * len(self.findings) + 1
        drawn = pyplot.subplots(figsize=(7, height), layout="constrained")[1] if axes is None else axes
        shares = [min(f.value / f.bound if f.bound else float(f.value > 0), MOST) for f in self.findings]
        places = range(len(self.findings))
        drawn.barh(places, shares, color=[COLOURS[f.status] for f in self.findings])
        drawn.axvline(1, color="black", linewidth=0.8)
        drawn.set_yticks(places, [f.law for f in self.findings])
        drawn.invert_yaxis()
        drawn.set(title=self.subject, xlabel=f"value / bound, {MOST:g} at most")
        return drawn


def _finite(number: float) -> float | None:
    return number if abs(number) < float("inf") else None
