"""Progress of verbs that take long, on standard error so that results can be piped."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from velatura.progress import bar as bar


@contextmanager
def clock(title: str, after: float = 1.0) -> Iterator[None]:
    """Shows the time that passes, on a terminal only, where a step whose length is not known takes over `after` s."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    progress.add_task(title, total=None)
    timer = threading.Timer(after, progress.start)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        if progress.live.is_started:
            progress.stop()
