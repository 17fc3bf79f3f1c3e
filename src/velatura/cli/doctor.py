"""`velatura doctor`: installed and missing components, and the commands that install these."""

from __future__ import annotations

import typer


def doctor() -> None:
    """List what is installed, and how to install the rest."""
    from rich.console import Console
    from rich.table import Table

    from velatura import kernel
    from velatura.editor import bundle

    findings = (*kernel.doctor(), *kernel.extras(), bundle.finding())
    table = Table(box=None, show_header=False)
    for finding in findings:
        table.add_row("[green]ok[/]" if finding.ok else "[red]no[/]", finding.what, finding.found)
    Console().print(table)

    # Commands are printed bare, so that they can be copied
    for finding in findings:
        if not finding.ok:
            print(f"To install {finding.what}: {finding.mend}")
    if not all(finding.ok for finding in findings):
        raise typer.Exit(1)
