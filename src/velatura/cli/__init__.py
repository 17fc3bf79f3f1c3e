"""The command line: one file a verb.

A verb imports what it needs when it runs, so that `velatura --help` loads neither NumPy nor Mitsuba.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Annotated, cast

import typer

from velatura import __version__
from velatura.cli import (
    check,
    coat,
    compare,
    doctor,
    edit,
    explore,
    export,
    figure,
    fit,
    invert,
    lobes,
    presets,
    render,
    schema,
    simplify,
    tables,
)
from velatura.errors import VelaturaError

# What Typer raises for a wrong option; caught, so that it is reported in one line like every other wrong input.
UsageError = cast(type[typer.BadParameter], typer.BadParameter.__base__)

INTERRUPTED = 130  # as a shell reports a process that ended by Ctrl-C

app = typer.Typer(
    name="velatura",
    help="Layered materials: what a stack of interfaces and media looks like, and why.",
    epilog="Exit status: 0 done; 1 a check failed or a tool is missing; 2 invalid input; 3 valid input, but no "
    "solution exists; 130 interrupted.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for verb in (
    render.render,
    lobes.lobes,
    check.check,
    compare.compare,
    invert.invert,
    coat.coat,
    explore.explore,
    fit.fit,
    simplify.simplify,
    edit.edit,
    export.export,
    figure.figure,
    presets.presets,
    schema.schema,
    tables.tables,
    doctor.doctor,
):
    app.command()(verb)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"velatura {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line on `sys.argv` and exit with its status.

    Invalid input, a missing tool and the like end in one line on standard error; what nobody foresaw, in a traceback.
    """
    with _interrupts() as interrupts:
        try:
            status = app(sys.argv[1:] or ["--help"], prog_name="velatura", standalone_mode=False)
            sys.stdout.flush()
        except BaseException as error:
            status = INTERRUPTED if interrupts else _explain(error)
    if status == INTERRUPTED:
        _complain("interrupted")
    sys.exit(status)


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Notes each Ctrl-C while the block runs: libraries turn the exception that it raises into all sorts of others."""
    noted: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        signal.default_int_handler(number, frame)

    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # else somebody wants interrupts ignored, or handles them
        signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)


def _explain(error: BaseException) -> int:
    """The status for an error that was foreseen, once it is told; raises any other."""
    if isinstance(error, VelaturaError):
        _complain(str(error))
        return error.exit_status
    if isinstance(error, UsageError):
        _complain(error.format_message())
        return error.exit_code
    if isinstance(error, BrokenPipeError):
        # The reader has gone (`velatura lobes ... | head`): nothing is left to say, not even at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    raise error


def _complain(message: str) -> None:
    print(f"velatura: {message}", file=sys.stderr)
