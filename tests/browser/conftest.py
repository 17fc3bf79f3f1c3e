"""The editor's server and a browser, for as long as the tests of a file run; pages tell how a failed test left them."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any

import pytest
from editor import Server, Visit, browser, server


@pytest.fixture(scope="module")
def opened() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with server(tmp_path_factory.mktemp("materials")) as running:
        yield running


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(call: pytest.CallInfo[None]) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.when == "call":
        if report.failed:
            report.sections += [(f"page {k}", visit.told()) for k, visit in enumerate(Visit.open)]
        Visit.open.clear()
    return report
