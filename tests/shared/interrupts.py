"""Processes that can be interrupted."""

from __future__ import annotations

import signal


def hear() -> None:
    """Restore interrupts, which background processes ignore, before a process begins."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
