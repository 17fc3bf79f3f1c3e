"""`velatura doctor`: what is installed, what is missing, and the command that mends it."""

from __future__ import annotations

import typer


def doctor() -> None:
    """Say what is installed, and what mends the rest."""
    from rich.console import Console
    from rich.table import Table

    from velatura import kernel
    from velatura.editor import bundle

    findings = (*kernel.doctor(), *kernel.extras(), bundle.finding())
    table = Table(box=None, show_header=False)
    for finding in findings:
        table.add_row("[green]ok[/]" if finding.ok else "[red]mend[/]", finding.what, finding.found)
    Console().print(table)

    # Commands are printed bare, so that they can be copied
    for finding in findings:
        if not finding.ok:
            print(f"To mend {finding.what}: {finding.mend}")
    if not all(finding.ok for finding in findings):
        raise typer.Exit(1)
