"""The only module that imports Mitsuba and Dr.Jit: finds LLVM, sets the variant, and registers the plugins.

Importing this module imports neither. A Python BSDF class belongs to one Mitsuba variant, so a plugin module does not
hold a class but a factory, which is called once for every variant that is used::

    @kernel.plugin("layered")
    def make(mi):
        class Layered(mi.BSDF): ...
        return Layered
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib.metadata
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from velatura import pictures
from velatura.errors import InvalidInput, MissingTool, VelaturaError

if TYPE_CHECKING:
    from mitsuba import BSDF as BSDF

Factory = Callable[[ModuleType], type]

#: From this LLVM on, compiling `minimum` is known to work; an older one has to show it in a process of its own.
TRUSTED_LLVM = 19

MUCH = 32 << 20  # bytes of Dr.Jit at once, from which its freed memory is returned
TRIMMED = 10  # seconds from one return of the C library's freed memory to the next

_MINIMUM = "import drjit, drjit.llvm as llvm; print(drjit.minimum(llvm.Float([1, 2]), 1.5))"

_factories: dict[str, Factory] = {}
_registered: set[tuple[str, str]] = set()
_trimmed = 0.0  # when the C library's freed memory was returned
_threads: int | None = None  # of Dr.Jit, None for as many as it likes
_compiled_first = ContextVar("compiled_first", default=False)


# One thread at a time


class Exclusive(contextlib.ContextDecorator):
    """Lock that lets one thread at a time work with Mitsuba; a block or a function that holds it may take it again.

    A rendering queries all objects of a kind, those of other threads included. So none may be created while it runs,
    nor destroyed, which happens where the last reference ends: in any thread, or in the traceback of a kept error.
    Hence the references of a failure are cleared before the lock is released, and a BSDF of ours that another thread
    releases, or that the rendering itself is the last to hold, is kept until the lock is free.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._owner: int | None = None
        self._depth = 0
        self._dropped: list[Any] = []

    def __enter__(self) -> None:
        self._lock.acquire()
        self._owner = threading.get_ident()
        self._depth += 1

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        try:
            if self._depth == 1:
                _let_go(error)
                self._dropped.clear()
        finally:
            self._depth -= 1
            if not self._depth:
                self._owner = None
            self._lock.release()

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[bool]:
        """Hold the lock in a block unless another thread keeps it longer, 0 seconds or more; whether it is held."""
        if not self._lock.acquire(timeout=min(seconds, threading.TIMEOUT_MAX)):
            yield False
            return
        try:
            with self:
                yield True
        finally:
            self._lock.release()

    def drop(self, thing: Any) -> None:
        """Keep an object without references, unless this thread may destroy it now. Never waits."""
        import drjit as dr

        alone = self._owner is None and threading.active_count() == 1
        allowed = alone or self._owner == threading.get_ident()
        if not allowed or dr.flag(dr.JitFlag.SymbolicScope):  # which is set while Dr.Jit queries all BSDFs
            self._dropped.append(thing)


def _let_go(error: BaseException | None) -> None:
    """Clear the variables of the calls that an error, or one of its causes, has ended."""
    waiting, seen = [error], set()
    while waiting:
        each = waiting.pop()
        if each is not None and id(each) not in seen:
            seen.add(id(each))
            traceback.clear_frames(each.__traceback__)
            waiting += [each.__cause__, each.__context__]


#: Held by all code of Velatura that works with Mitsuba. Hold it, as `with kernel.exclusive:` or as the decorator
#: `@kernel.exclusive`, where other threads use Velatura while you load scenes, render, or let go of either.
exclusive = Exclusive()


# Mitsuba and its variant


def default_variant() -> str:
    """The variant that is set if the user has set none."""
    return "llvm_ad_rgb"


@exclusive
def mitsuba(variant: str | None = None) -> ModuleType:
    """Mitsuba with a variant set: the given one, else the current one, else `default_variant()`.

    Raises MissingTool where Mitsuba is not installed, or where an LLVM variant would run on an LLVM that is missing or
    too old (which would end the whole process at the first `minimum`, past anything Python can catch).
    """
    _drjit()
    import mitsuba as mi

    wanted = variant or mi.variant() or default_variant()
    if wanted.startswith("llvm"):
        require_llvm()
    if wanted != mi.variant():
        mi.set_variant(wanted)
    return mi


def bitmap(path: Path, subject: str = "") -> Any:
    """The `mi.Bitmap` of a file. Sets no variant.

    Raises:
        InvalidInput: the file cannot be read, or is none; one line that begins with the subject, or the path.
        MissingTool: Mitsuba is not installed.
    """
    _drjit()
    import mitsuba as mi

    pictures.check(path, subject)
    try:
        allow_pictures()
        return mi.Bitmap(str(path))
    except (RuntimeError, MemoryError):
        raise InvalidInput(f"{subject or f'{path}:'} is no image that Mitsuba can read") from None


def numbers(value: Any) -> list[float]:
    """All numbers of a value of Dr.Jit, NumPy or Python, channel by channel; no kernel is compiled to read them."""
    import drjit as dr
    import numpy as np

    value = dr.detach(value)
    channels = value if dr.is_array_v(value) and dr.depth_v(value) > 1 else [value]
    return [x for channel in channels for x in np.ravel(np.array(channel, float)).tolist()]


def return_memory() -> None:
    """Return freed memory to the system: what the C library keeps of it, once in `TRIMMED` seconds, and what Dr.Jit
    keeps, if it has held `MUCH` at once since the last time and no other thread works with it.

    The C library keeps it for each thread, Dr.Jit all of it by size, for what may need as much again.
    """
    global _trimmed
    if time.monotonic() > _trimmed + TRIMMED:
        _trimmed = time.monotonic()
        if trim := _malloc_trim():
            trim(0)
    if not _drjit.cache_info().currsize:
        return
    dr = _drjit()
    with exclusive.within(0) as alone:
        if alone and dr.detail.malloc_watermark(dr.JitBackend.LLVM) > MUCH:
            dr.flush_malloc_cache()
            dr.detail.malloc_clear_statistics()


@functools.cache
def _malloc_trim() -> Callable[[int], int] | None:
    """The function of glibc; None where the C library is another one."""
    return getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


# LLVM


@functools.cache
def llvm_version() -> tuple[int, int, int] | None:
    """Version of the LLVM library that Dr.Jit uses, None if it found no usable one."""
    dr = _drjit()
    return dr.detail.llvm_version() if dr.has_backend(dr.JitBackend.LLVM) else None


def require_llvm() -> None:
    """Raise MissingTool, with the command that installs it, unless the LLVM of Dr.Jit is recent enough."""
    if not _llvm_works():
        found = "found none that it can use" if llvm_version() is None else f"{_dotted(llvm_version())} is too old"
        raise MissingTool(f"Dr.Jit needs LLVM {TRUSTED_LLVM} and {found}: run `{llvm_command()}`")


def llvm_command() -> str:
    """The shell command that installs a working LLVM."""
    if sys.platform == "win32":
        return "winget install LLVM.LLVM"
    if sys.platform == "darwin":
        return f"brew install llvm@{TRUSTED_LLVM}"
    unset = "unset DRJIT_LIBLLVM_PATH; " if "DRJIT_LIBLLVM_PATH" in os.environ else ""
    sudo = "" if os.geteuid() == 0 else "sudo "
    return f"{unset}{sudo}apt-get update && {sudo}apt-get install -y libllvm{TRUSTED_LLVM}"


@functools.cache
def llvm() -> ModuleType | None:
    """Dr.Jit's arrays on LLVM, without gradients; None where Mitsuba or LLVM is missing or too old."""
    try:
        require_llvm()
    except MissingTool:
        return None
    import drjit.llvm

    return drjit.llvm


def kept_kernels() -> Path:
    """The folder in which Dr.Jit keeps compiled kernels, which may be missing."""
    folder = os.environ.get("DRJIT_CACHE_DIR")
    at_home = Path(tempfile.gettempdir(), "drjit") if sys.platform == "win32" else Path.home() / ".drjit"
    return Path(folder) if folder else at_home


@functools.cache
def vector_width() -> int:
    """How many values Dr.Jit's kernels of LLVM work on at once: as many as the processor's instructions allow."""
    import numpy as np

    found = np.show_config(mode="dicts")["SIMD Extensions"]
    known = {*found["baseline"], *found["found"]}
    widths = {16: {"X86_V4", "AVX512_SKX"}, 8: {"X86_V3", "AVX2"}}  # as NumPy has named them since, and before, 2.4
    return next((width for width, names in widths.items() if names & known), 4)


@functools.cache
def _llvm_works() -> bool:
    version = llvm_version()
    if version is None or version[0] >= TRUSTED_LLVM:
        return version is not None
    return _compiles_minimum()


def _compiles_minimum() -> bool:
    return subprocess.run([sys.executable, "-c", _MINIMUM], capture_output=True, check=False).returncode == 0


@functools.cache
def _drjit() -> ModuleType:
    try:
        # Dr.Jit looks for LLVM while it is imported, and prints a less helpful message than ours
        with exclusive, _quiet_stderr():
            import drjit
            import mitsuba  # noqa: F401
    except ImportError as error:
        raise MissingTool(f"Mitsuba does not load ({error}): run `{sys.executable} -m pip install mitsuba`") from error
    if _threads is not None:
        drjit.set_thread_count(_threads)
    return drjit


def use_threads(count: int) -> None:
    """Let Dr.Jit use that many threads of this process, from now on or as soon as it is loaded."""
    global _threads
    _threads = count
    limit_threads()


def limit_threads() -> None:
    """Return to the threads of `use_threads`, after pictures have been read. Not while Mitsuba loads a scene."""
    if _threads is not None and "drjit" in sys.modules and sys.modules["drjit"].thread_count() != _threads:
        sys.modules["drjit"].set_thread_count(_threads)


def allow_pictures() -> None:
    """Let Dr.Jit have a thread besides this one: Mitsuba reads and writes OpenEXR in it, or else waits for ever.

    It stays, since a scene that is being loaded may use it at once.
    """
    dr = _drjit()
    if dr.thread_count() < 2:
        dr.set_thread_count(2)


@contextlib.contextmanager
def threads_restored() -> Iterator[None]:
    """Undo `use_threads` at the end of the block."""
    global _threads
    before = sys.modules["drjit"].thread_count() if "drjit" in sys.modules else os.cpu_count()
    try:
        yield
    finally:
        if _threads is not None and "drjit" in sys.modules:
            sys.modules["drjit"].set_thread_count(before)
        _threads = None


@contextlib.contextmanager
def compiled_first() -> Iterator[None]:
    """Run by kernels, in the block, all that has any, the first time as well: results then depend, bit by bit, neither
    on what this process has computed before nor on what others have left on disk."""
    before = _compiled_first.set(True)
    try:
        yield
    finally:
        _compiled_first.reset(before)


def compiles_first() -> bool:
    return _compiled_first.get()


@contextlib.contextmanager
def _quiet_stderr() -> Iterator[None]:
    sys.stderr.flush()
    saved, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)


# Our plugins


def plugin(name: str) -> Callable[[Factory], Factory]:
    """Declare the factory below as the BSDF plugin `name`; `register()` registers it with Mitsuba."""

    def declare(factory: Factory) -> Factory:
        _factories[name] = factory
        return factory

    return declare


@exclusive
def register() -> None:
    """Register every declared plugin in the current variant (if one is set) and in all that are set later."""
    _drjit()
    import mitsuba as mi

    _follow_variants()
    if mi.variant():
        _register_missing(mi)


@functools.cache
def _follow_variants() -> None:
    import mitsuba as mi

    mi.detail.add_variant_callback(lambda old, new: _register_missing(mi))


@exclusive  # in any thread that sets a variant
def _register_missing(mi: Any) -> None:
    for name, factory in _factories.items():
        if (name, mi.variant()) not in _registered:
            made: Any = factory(mi)
            made.__del__ = _released
            mi.register_bsdf(name, functools.partial(_built, made))
            _registered.add((name, mi.variant()))


def _released(thing: Any) -> None:
    """Drop a plugin without references."""
    if exclusive and not sys.is_finalizing():  # both names are None at the very end of Python
        exclusive.drop(thing)


def _built(made: type, properties: Any) -> Any:
    """A plugin; its errors come without their stack of calls, which Mitsuba would list before the reason."""
    try:
        return made(properties)
    except VelaturaError as error:
        raise error.with_traceback(None) from None


def reason(error: BaseException) -> str:
    """Mitsuba's message for a failure in one line: where, and why. Calls inside a Python plugin are left out."""
    while error.__cause__:
        error = error.__cause__
    where, calls, why = str(error).partition("Traceback (most recent call last):")
    text = where + why.strip().splitlines()[-1].removeprefix(f"{InvalidInput.__name__}: ") if calls else where
    return " ".join(re.sub(r"\[\w+\.cpp:\d+\] ", "", text).split())  # without the places in Mitsuba's sources


@exclusive
def load_dict(description: dict[str, Any]) -> Any:
    """`mi.load_dict`, with errors of our plugins without the stack of calls.

    Raises:
        InvalidInput: the error of the plugin, in one line.
    """
    mi = mitsuba()
    allow_pictures()
    try:
        return mi.load_dict(description)
    except RuntimeError as error:
        _, refused, reason = str(error).rpartition(f"{InvalidInput.__name__}: ")
        if not refused:
            raise
        raise InvalidInput(reason.strip()) from None
    finally:
        limit_threads()


# Installed components

#: Optional parts of the package, and what needs them.
EXTRAS = {
    "plots": "--plot, --sheet and figures",
    "editor": "velatura edit",
    "notebook": "vt.Editor",
    "sweep": "velatura sweep",
    "mie": "media of spheres",
}


#: What needs neither Mitsuba nor LLVM, and what does.
WITHOUT = (
    "Without Mitsuba and LLVM, lobes, the inverse, imports, bakes, shaders and sweeps of lobes work; "
    "pictures, BSDFs, checks and random walks do not. The spectra of materials by name come with Mitsuba."
)


class Component(NamedTuple):
    """One row of `doctor`: the component, what was found, whether that suffices, and the command that installs it."""

    what: str
    found: str
    ok: bool
    mend: str = ""


def doctor() -> tuple[Component, ...]:
    """The installed components, whether they are sufficient, and otherwise the command that installs them."""
    packages = [_find_package(name) for name in ("mitsuba", "drjit")]
    backends = [_find_llvm(), _find_cuda()] if all(row.ok for row in packages) else []
    return (_find_python(), *packages, *backends)


def _find_python() -> Component:
    return Component(
        "Python", _dotted(sys.version_info[:3]), sys.version_info >= (3, 10), "install Python 3.10 or newer"
    )


def _find_package(name: str) -> Component:
    try:
        return Component(name, importlib.metadata.version(name), True)
    except importlib.metadata.PackageNotFoundError:
        return Component(name, "missing", False, f"{sys.executable} -m pip install mitsuba")


def extras() -> tuple[Component, ...]:
    """The optional parts of Velatura, and their installed packages; a missing one is not an error."""
    return tuple(map(_find_extra, EXTRAS))


def _find_extra(extra: str) -> Component:
    wanted = re.compile(rf"([\w-]+)[^;]*;.*\bextra == ['\"]{extra}['\"]")
    lines = importlib.metadata.requires("velatura") or ()
    names = dict.fromkeys(found[1] for line in lines if (found := wanted.fullmatch(line)))  # once, for all Pythons
    try:
        versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
    except importlib.metadata.PackageNotFoundError:
        return Component(f"Extra {extra}", f'none (optional, {EXTRAS[extra]}): pip install "velatura[{extra}]"', True)
    return Component(f"Extra {extra}", versions, True)


def _find_llvm() -> Component:
    version = llvm_version()
    if _llvm_works():
        return Component("LLVM", _dotted(version), True)
    return Component("LLVM", "missing" if version is None else f"{_dotted(version)}, too old", False, llvm_command())


def _find_cuda() -> Component:
    """A GPU is optional, so this row never fails."""
    dr = _drjit()
    if not dr.has_backend(dr.JitBackend.CUDA):
        return Component("CUDA", "none (optional)", True)
    try:
        ctypes.CDLL("libnvoptix.so.1")
    except OSError:
        return Component("CUDA", f"{_dotted(dr.detail.cuda_version())}, no OptiX: BSDFs run, rendering does not", True)
    return Component("CUDA", f"{_dotted(dr.detail.cuda_version())} with OptiX", True)


def _dotted(version: tuple[int, ...] | None) -> str:
    return ".".join(map(str, version or ()))
