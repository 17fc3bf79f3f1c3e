"""Files as bytes."""

from __future__ import annotations

from pathlib import Path

from velatura.errors import InvalidInput
from velatura.files import reason


def content(path: Path, largest: int) -> bytes:
    """The content of a file.

    Raises:
        InvalidInput: it cannot be read, or is larger than `largest` bytes; one line that names the file.
    """
    try:
        with path.open("rb") as file:
            data = file.read(largest + 1)
    except FileNotFoundError:
        raise InvalidInput(f"{path}: file not found") from None
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: cannot be read: {reason(error)}") from None
    if len(data) > largest:
        raise InvalidInput(f"{path}: is larger than {largest // 2**20} MiB")
    return data
