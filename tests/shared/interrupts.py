"""Processes that can be interrupted."""

from __future__ import annotations

import signal


def hear() -> None:
    """Before a process begins: restore interrupts, which background processes ignore."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
