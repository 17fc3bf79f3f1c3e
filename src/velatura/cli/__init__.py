"""The command line: one file a verb.

A verb imports what it needs when it runs, so that `velatura --help` loads neither NumPy nor Mitsuba.
"""

from __future__ import annotations

import contextlib
import errno
import gc
import io
import os
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator
from types import FrameType
from typing import Annotated, Any

import typer

from velatura.cli import (
    benchmark,
    check,
    cite,
    coat,
    compare,
    doctor,
    edit,
    explore,
    export,
    figure,
    fit,
    imports,
    invert,
    lobes,
    paint,
    pigment,
    presets,
    render,
    schema,
    show,
    simplify,
    substances,
    sweep,
    tables,
)
from velatura.errors import VelaturaError, VelaturaWarning, one_line
from velatura.files import reason, source_date
from velatura.version import __version__

INTERRUPTED = 130  # as a shell reports a process that ended by Ctrl-C
OBJECTS = 50_000  # between searches for garbage, which imports hardly make: an eighth of their time

app = typer.Typer(
    name="velatura",
    help="Layered materials: the appearance of a stack of interfaces and media, and its causes.",
    epilog="Exit status: 0 done; 1 a check failed or a tool is missing; 2 invalid input; 3 valid input, but no "
    "solution exists; 130 interrupted.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for verb in (
    render.render,
    lobes.lobes,
    show.show,
    check.check,
    compare.compare,
    invert.invert,
    coat.coat,
    explore.explore,
    fit.fit,
    simplify.simplify,
    pigment.pigment,
    paint.paint,
    sweep.sweep,
    edit.edit,
    export.export,
    imports.import_,
    figure.figure,
    presets.presets,
    substances.substances,
    schema.schema,
    tables.tables,
    cite.cite,
    doctor.doctor,
):
    app.command(verb.__name__.rstrip("_"))(verb)
app.add_typer(benchmark.app, name="benchmark")


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

    Invalid input, a missing tool, a full disk and the like end in one line on standard error; an error of Velatura
    itself is reported as such, before its traceback.
    """
    with _interrupts() as interrupts, _warnings_in_one_line():
        try:
            _open_streams()
            gc.set_threshold(OBJECTS)
            source_date()  # NumPy reads it as well, where SciPy is loaded
            status = app(sys.argv[1:] or ["--help"], prog_name="velatura", standalone_mode=False)
            sys.stdout.flush()
        except BaseException as error:
            status = INTERRUPTED if interrupts else _explain(error)
    if status == INTERRUPTED:
        _complain("interrupted")
    _drop_output()
    if status == INTERRUPTED:
        # Python's own end may wait or fail for threads of Dr.Jit, and is by signal after an interrupt within `exec`
        os._exit(status)
    sys.exit(status)


def _open_streams() -> None:
    """Make the standard streams UTF-8 in every locale. Raises OSError if standard output is closed."""
    for number in range(3):  # a stream that is closed would give its number to the next file that is opened
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stderr = sys.stderr or os.fdopen(2, "w")
    if sys.stdout is None:
        raise OSError(errno.EBADF, "standard output is closed")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Names of files that are not UTF-8 are printed unchanged
            stream.reconfigure(encoding="utf-8", errors="surrogateescape")


def _drop_output() -> None:
    """Drop output that can no longer be written, so that Python reports no error at exit."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


@contextlib.contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Records each Ctrl-C while the block runs: libraries turn the exception that it raises into various others."""
    noted: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)
        signal.default_int_handler(number, frame)

    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # else the caller ignores interrupts or handles them
        signal.signal(signal.SIGINT, note)
    try:
        yield noted
    finally:
        signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def _warnings_in_one_line() -> Iterator[None]:
    """Prints warnings of Velatura as errors are printed; other warnings as Python has them."""
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if issubclass(category, VelaturaWarning):
                _complain(str(message))
            else:
                usual(message, category, *where)

        warnings.showwarning = show  # type: ignore[assignment]
        yield


def _explain(error: BaseException) -> int:
    """Report an error, and return its exit status; an exit is passed on."""
    if isinstance(error, VelaturaError):
        _complain(str(error))
        return error.exit_status
    if isinstance(error, typer.TyperException):  # a wrong option
        message = error.format_message().replace("Value error, ", "")  # Pydantic's name for it
        _complain(_out_of_range(error) or " ".join(message.split()))
        return error.exit_code
    if isinstance(error, BrokenPipeError):  # the reader has gone (`velatura lobes ... | head`): print nothing more
        return 1
    if isinstance(error, OSError):
        _complain(": ".join(filter(None, (str(error.filename or ""), reason(error)))))
        return 1
    if isinstance(error, MemoryError):
        _complain("there is not enough memory for this")
        return 1
    if not isinstance(error, Exception):
        raise error
    _complain("this is a mistake of Velatura's own; please report it, with the lines that follow")
    with contextlib.suppress(OSError):
        traceback.print_exception(error)
    return 1


def _out_of_range(error: typer.TyperException) -> str:
    """The message about a number of the command line, as those about numbers of a file; empty for other errors."""
    from pydantic import ValidationError

    option, cause = getattr(error, "param", None), error.__cause__
    low, high = (getattr(option, end, None) for end in ("min", "max"))
    if option is None or low is None or high is None or not isinstance(cause, ValidationError):
        return ""
    kind = "a whole number" if isinstance(low, int) else "a number"
    return f"{option.opts[0]}: must be {kind} in {low} to {high}, got {cause.errors()[0]['input']}"


def _complain(message: str) -> None:
    with contextlib.suppress(OSError):
        print(f"velatura: {one_line(message)}", file=sys.stderr)
