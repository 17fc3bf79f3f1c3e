"""`velatura presets`: the materials that come with the package."""

from __future__ import annotations

import json

from velatura.cli import options


def presets(as_json: options.Json = False) -> None:
    """List the materials that come with the package."""
    from velatura import stack

    stacks = {name: stack.preset(name) for name in stack.presets()}
    if as_json:
        print(json.dumps([{"name": name, "layers": m.kinds, "source": m.source} for name, m in stacks.items()]))
        return

    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, material in stacks.items():
        table.add_row(name, Text(f"{', '.join(material.kinds)}\n{material.source}"))
    Console().print(table)
