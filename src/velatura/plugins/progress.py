"""Progress of what a plugin prepares, on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

SILENT_S = 1.0


def line(title: str) -> Callable[[int, int], None]:
    """Takes steps done and their total; shows a line, on a terminal only, once that has taken a second."""
    begin, shown = time.monotonic(), False

    def show(done: int, total: int) -> None:
        nonlocal shown
        if done < total and time.monotonic() - begin > SILENT_S and sys.stderr.isatty():
            shown = True
            print(f"\r{title}: {done} of {total}", end="", file=sys.stderr, flush=True)
        elif shown and done == total:
            shown = False
            print(f"\r{title}: {total} of {total}", file=sys.stderr, flush=True)

    return show
