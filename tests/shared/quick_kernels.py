"""Kernels that are compiled in less time and run slower: those of tests run few times, on few numbers."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

from velatura import kernel

# Dr.Jit asks LLVM for -O2 and has no flag for less, but LLVM takes the options of its command line in any process.
# Passes that may be left out are, and registers are allocated one basic block at a time; the arithmetic is the same.
OPTIONS = ("-opt-bisect-limit=0", "-optimize-regalloc=false", "-regalloc=fast")

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
    options = [b"tests", *map(str.encode, OPTIONS)]
    for llvm in _loaded("libLLVM"):
        if hasattr(llvm, STREAM):
            _silence(llvm)
            llvm.LLVMParseCommandLineOptions(len(options), (ctypes.c_char_p * len(options))(*options), None)


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
