"""A picture of a finding, for the laws that fail."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from velatura import files
from velatura.checks.report import Finding
from velatura.errors import InvalidInput, needs


def check_folder(folder: str | Path) -> Path:
    """The folder for plots, made where it is missing.

    Raises:
        InvalidInput: it cannot be written.
        MissingTool: the extra `plots` is not installed.
    """
    with needs("plots"):
        import matplotlib  # noqa: F401  (before what is slow)
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"{path}: plots cannot be written there ({error.strerror})") from None
    files.check_folder(path, str(path))
    return path


def save(finding: Finding, folder: Path, subject: str) -> Path:
    """Draw a finding about a subject into a PNG in a folder; the file is written whole or not at all."""
    from matplotlib.figure import Figure

    # Pictures side by side, or curves over the first array
    pictures = all(values.ndim == 2 for values in finding.data.values())
    figure = Figure(figsize=(4 * len(finding.data), 4) if pictures else (6, 4), layout="constrained")
    (_pictures if pictures else _curves)(figure, finding)
    figure.suptitle(f"{subject}\n{finding.law}: {finding.value:.4g}, allowed {finding.bound:.4g}", wrap=True)

    # Write it in one go
    path = folder / f"{finding.law.replace(' ', '-')}.png"
    with files.whole(path) as unfinished:
        figure.savefig(unfinished)
    return path


def _pictures(figure: Any, finding: Finding) -> None:
    for axes, (name, values) in zip(figure.subplots(1, len(finding.data), squeeze=False)[0], finding.data.items()):
        figure.colorbar(axes.imshow(values, aspect="auto"), ax=axes, shrink=0.7)
        axes.set(title=name, xlabel="cells of height, from the pole", ylabel="cells of azimuth")


def _curves(figure: Any, finding: Finding) -> None:
    (abscissa, x), *curves = finding.data.items()
    axes = figure.subplots()
    for name, y in curves:
        axes.plot(x, y, ".", label=name)
    axes.ticklabel_format(useOffset=False)
    axes.set(xlabel=abscissa, ylabel=curves[0][0] if len(curves) == 1 else finding.law)
    if len(curves) > 1:
        axes.legend()
