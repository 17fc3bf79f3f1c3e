"""A browser and the editor's server for all files of this folder; pages report how a failed test left them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any

import chromium
import in_three
import pytest
from editor import Server, Tabs, Visit, server, unexpected


@pytest.fixture(scope="package", autouse=True)
def kept() -> Iterator[None]:
    """One Chromium for all files, which starts in two seconds."""
    if chromium.missing():
        yield
    else:
        with chromium.kept():
            yield


@pytest.fixture(scope="module")
def opened() -> Iterator[Any]:
    with chromium.launched() as found:
        yield found


@pytest.fixture(scope="package")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with server(tmp_path_factory.mktemp("materials")) as found:
        yield found


@pytest.fixture(scope="module")
def served(running: Server) -> Iterator[Server]:
    """The server, whose folder is empty at first."""
    yield running
    running.clear()


@pytest.fixture(scope="module")
def tabs(opened: Any) -> Tabs:
    return Tabs(opened)


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Callable[..., Visit]]:
    """Opens the page, with the preset coated-gold, in a browser without a past, whose console may not complain."""
    yield lambda: tabs.visit(served.entrance)
    assert unexpected(tabs.forget(), []) == []
    served.clear()


@pytest.fixture(scope="module")
def three() -> Iterator[in_three.Stage]:
    """A page with three.js."""
    if not in_three.THREE.folder.is_dir():
        pytest.skip(f"three.js is missing: npm ci in {in_three.bundle.SOURCES}")
    with in_three.stage() as found:
        yield found


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(call: pytest.CallInfo[None]) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.when == "call":
        if report.failed:
            report.sections += [(f"page {k}", visit.report()) for k, visit in enumerate(Visit.open)]
        Visit.open.clear()
    return report
