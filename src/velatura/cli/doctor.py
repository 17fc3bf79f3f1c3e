"""`velatura doctor`: installed and missing components, and the commands that install these."""

from __future__ import annotations

import typer

from velatura.cli import options


def doctor() -> None:
    """List what is installed, and how to install the rest."""
    from rich.table import Table
    from rich.text import Text

    from velatura import kernel
    from velatura.editor import bundle

    findings = (*kernel.doctor(), *kernel.extras(), bundle.finding())
    table = Table(box=None, show_header=False)
    for finding in findings:
        ok = Text("ok", "green") if finding.ok else Text("no", "red")
        table.add_row(ok, finding.what, finding.found)
    options.console().print(table)

    # Commands are printed bare, so that they can be copied
    for finding in findings:
        if not finding.ok:
            print(f"To install {finding.what}: {finding.mend}")
    if not all(finding.ok for finding in findings):
        print(kernel.WITHOUT)
        raise typer.Exit(1)
