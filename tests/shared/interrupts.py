"""Processes that can be interrupted."""

from __future__ import annotations

import signal


def hear() -> None:
    """Before a process begins: hear interrupts, which those that are started in the background were told to ignore."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
