"""Kernels that are compiled in less time and run slower: those of tests run few times, on few numbers."""

from __future__ import annotations

import ctypes
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from velatura import kernel
from velatura.renderer import compiled

# Dr.Jit asks LLVM for -O2 and has no flag for less, but LLVM takes the options of its command line in any process.
# Passes that may be left out are, and registers are allocated one basic block at a time; the arithmetic is the same.
QUICKLY = "-opt-bisect-limit=0", "-optimize-regalloc=false"

# As programs do: of `renderer.compiled`, whose loops over sources and samples run for longer than that takes
WELL = "-opt-bisect-limit=2147483647", "-optimize-regalloc=true"

# llvm::errs(), and llvm::raw_fd_ostream(int fd, bool shouldClose, bool unbuffered, OStreamKind)
ERRORS = "_ZN4llvm4errsEv"
STREAM = "_ZN4llvm14raw_fd_ostreamC1EibbNS_11raw_ostream11OStreamKindE"


def compile_quickly(cache: Path) -> None:
    """Compile the kernels of this process quickly from now on, and keep them in a folder of their own.

    Dr.Jit finds a kernel by its code, regardless of how it was compiled, so these must not lie where programs look for
    theirs. Kernels are compiled as ever where LLVM is missing or another one, or where the system does not list
    what is loaded.
    """
    os.environ["DRJIT_CACHE_DIR"] = str(cache)
    if kernel.llvm() is None:
        return
    libraries = [llvm for llvm in _loaded("libLLVM") if hasattr(llvm, STREAM)]
    for llvm in libraries:
        _silence(llvm)
        _ask(llvm, QUICKLY)
    original = compiled._kernel

    def of_loops(*arguments: Any, **named: Any) -> Any:
        found = original(*arguments, **named)

        def launch(*given: Any) -> Any:
            for llvm in libraries:
                _ask(llvm, WELL)
            try:
                return found.launch(*given)
            finally:
                for llvm in libraries:
                    _ask(llvm, QUICKLY)

        return replace(found, launch=launch)

    compiled._kernel = of_loops


def _ask(llvm: ctypes.CDLL, options: tuple[str, ...]) -> None:
    """Hand LLVM a command line, in 10 us. Of an option that it has been given before, the last value holds."""
    line = [b"tests", *map(str.encode, options)]
    llvm.LLVMParseCommandLineOptions(len(line), (ctypes.c_char_p * len(line))(*line), None)


def _silence(llvm: ctypes.CDLL) -> None:
    """Open the stream of LLVM's messages anew, on nothing: each pass left out is a line. Failures still show."""
    errors = llvm[ERRORS]
    errors.restype = ctypes.c_void_p
    llvm[STREAM](ctypes.c_void_p(errors()), os.open(os.devnull, os.O_WRONLY), False, True, 0)


def _loaded(name: str) -> list[ctypes.CDLL]:
    """The libraries of this process whose file names begin so."""
    maps = Path("/proc/self/maps")
    lines = maps.read_text().splitlines() if maps.is_file() else []
    paths = {line.split()[-1] for line in lines}
    return [ctypes.CDLL(path) for path in paths if Path(path).name.startswith(name)]
