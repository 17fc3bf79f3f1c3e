"""The editor's server and a browser, for as long as the tests of a file run; pages tell how a failed test left them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any

import in_three
import pytest
from editor import Server, Tabs, Visit, browser, server, unexpected


@pytest.fixture(scope="module")
def opened() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with server(tmp_path_factory.mktemp("materials")) as running:
        yield running


@pytest.fixture(scope="module")
def tabs(opened: Any) -> Tabs:
    return Tabs(opened)


@pytest.fixture
def visit(tabs: Tabs, served: Server) -> Iterator[Callable[..., Visit]]:
    """Opens the page, with the preset coated-gold, in a browser without a past, whose console may not complain."""
    yield lambda: tabs.visit(served.entrance)
    assert unexpected(tabs.forget(), []) == []
    for file in served.folder.iterdir():
        file.unlink()


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
            report.sections += [(f"page {k}", visit.told()) for k, visit in enumerate(Visit.open)]
        Visit.open.clear()
    return report
