"""The task for a model in any language: the stacks, and the pairs of directions that its values are taken at."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from velatura import files
from velatura.benchmark import stacks
from velatura.benchmark.candidates import Pairs


def write_task(folder: Path, edition: int = 1) -> int:
    """Write `stacks.json` of an edition, its `schema.json`, and `pairs.npz`: unit vectors `wi` and `wo` (P, 3), and the
    number `stack` (P,) of their stack from 0. Returns P.

    Raises:
        InvalidInput: an unknown edition, or the folder cannot be written.
    """
    cases = stacks.edition(edition)
    files.make_folder(folder)
    for path in (stacks.known(edition).data / "stacks.json", stacks.SCHEMA):
        with files.whole(folder / path.name) as unfinished:
            unfinished.write_bytes(path.read_bytes())
    each = [Pairs.of(case) for case in cases]
    stack = np.repeat(np.arange(len(each), dtype=np.uint8), [len(pairs.wi) for pairs in each])
    wi, wo = (np.concatenate([getattr(pairs, name) for pairs in each]).astype(np.float32) for name in ("wi", "wo"))
    with files.whole(folder / "pairs.npz") as unfinished, open(unfinished, "wb") as stream:
        np.savez(stream, wi=wi, wo=wo, stack=stack)
    return len(stack)
