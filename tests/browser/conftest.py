"""The editor's server and a browser, for as long as the tests of a file run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from editor import Server, browser, server


@pytest.fixture(scope="module")
def opened() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with server(tmp_path_factory.mktemp("materials")) as running:
        yield running
