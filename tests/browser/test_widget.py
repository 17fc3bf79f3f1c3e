"""The editor in a notebook: JupyterLab in headless Chromium, with code run in the notebook's own kernel beside it.

Rationale: widget, kernel and page each believe that they hold the material, so that only all of them together show
whether they agree. One notebook with two editors is visited by all tests, and the console may not complain.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

import chromium
import pytest
from editor import require_fresh_page
from lab import PATIENCE, Kernel, lab

# Not imported here, since all workers read all files of tests, and jupyterlab and nbformat take seconds
LACKS = [name for name in ("jupyterlab", "anywidget") if not find_spec(name)]
pytestmark = [
    pytest.mark.skipif(bool(LACKS), reason=f"missing: {LACKS}"),
    pytest.mark.skipif(bool(chromium.missing()), reason=chromium.missing()),
]

ONE = "import velatura as vt\none = vt.Editor('coated-gold', height=600)\none"
TWO = "two = vt.Editor(vt.preset('coated-gold'), model='belcour2018', height=600)\ntwo"
HEARD = "heard = []\nfor editor in one, two:\n    editor.observe(heard.append, ['stack', 'model'])"


@dataclass
class Cell:
    """One editor as it is seen."""

    page: Any
    index: int

    @property
    def editor(self) -> Any:
        return self.page.locator(".velatura-cell").nth(self.index)

    def layer(self, index: int) -> Any:
        return self.editor.locator(".layer").nth(index)

    def state(self, path: str) -> Any:
        """A part of the page's state: `state("layers.0.keys.alpha")`."""
        return self.editor.evaluate(
            "(el, path) => path.split('.').reduce((o, key) => o[key], el.velatura.store.get())", path
        )

    def ready(self) -> None:
        """Wait for a picture; from then on the preview alone is drawn, which is quick."""
        self.wait("shader() && el.velatura.viewport.previewed")
        self.editor.evaluate("(el) => el.velatura.viewport.setBudget({ samples: 0 })")

    def wait(self, condition: str) -> None:
        """Wait until a condition on the editor holds."""
        self.page.wait_for_function(
            f"(index) => {{ const el = document.querySelectorAll('.velatura-cell')[index];"
            f" return el?.velatura && el.velatura.{condition}; }}",
            arg=self.index,
            timeout=1000 * PATIENCE,
        )

    def problems(self) -> list[str]:
        return self.editor.evaluate("(el) => el.velatura.problems.map(({ text }) => text)")


@dataclass
class Notebook:
    """A notebook with two editors."""

    page: Any
    kernel: Kernel
    complaints: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.one, self.two = Cell(self.page, 0), Cell(self.page, 1)

    def until(self, expression: str, value: Any) -> None:
        """Wait until an expression in the kernel has a value."""
        end = time.monotonic() + PATIENCE
        while (found := self.kernel.run("", expression)) != value:
            assert time.monotonic() < end, f"{expression} stays {found}"
            time.sleep(0.1)


@pytest.fixture(scope="module")
def notebook(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Notebook]:
    require_fresh_page()
    with lab(tmp_path_factory.mktemp("lab"), ONE, TWO) as running, chromium.launched() as opened:
        page = opened.new_page(viewport={"width": 1200, "height": 900})
        complaints: list[str] = []
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))

        # Open the notebook, and run its cells
        page.goto(running.address)
        idle = "window.jupyterapp?.shell?.currentWidget?.sessionContext?.session?.kernel?.status === 'idle'"
        page.wait_for_function(f"() => {idle}", timeout=1000 * PATIENCE)
        page.evaluate("() => { window.jupyterapp.commands.execute('notebook:run-all-cells'); }")
        with running.kernel() as kernel:
            found = Notebook(page, kernel, complaints)
            for cell in found.one, found.two:
                cell.ready()
            kernel.run(HEARD)
            yield found


@pytest.fixture(autouse=True)
def quiet(notebook: Notebook) -> Iterator[None]:
    """Begin with the preset, and see that nothing has complained."""
    notebook.kernel.run("one.stack = two.stack = 'coated-gold'; one.model, two.model = 'velatura', 'belcour2018'")
    for cell, model in (notebook.one, "velatura"), (notebook.two, "belcour2018"):
        cell.wait(f"store.get().model === '{model}' && el.velatura.store.get().layers[0]?.keys.alpha === 0.05")
        cell.wait("store.get().layers[0].keys.eta === 1.5 && !el.velatura.store.dragging")
    notebook.kernel.run("heard.clear()")
    yield
    assert notebook.complaints == []


def test_the_page_follows_python(notebook: Notebook) -> None:
    """A new stack is seen in the controls of its own editor alone, and is one step to undo, which Python hears of."""
    one, two = notebook.one, notebook.two
    notebook.kernel.run("one.stack = one.stack.replace(layer0_eta=1.8, layer0_alpha=0.2)")
    one.wait("store.get().layers[0].keys.eta === 1.8")
    assert one.layer(0).get_by_label("Index", exact=True).last.input_value() == "1.8"
    assert one.layer(0).get_by_label("Roughness", exact=True).input_value() == "0.2"
    assert two.state("layers.0.keys.eta") == 1.5
    one.wait("quiet && !el.velatura.store.dragging")
    assert notebook.kernel.run("", "len(heard)") == 1

    one.editor.get_by_role("button", name="Undo: change the material").click()
    assert one.layer(0).get_by_label("Roughness", exact=True).input_value() == "0.05"
    notebook.until("one.stack == vt.preset('coated-gold')", True)
    assert one.problems() == two.problems() == []


def test_python_follows_the_page(notebook: Notebook) -> None:
    """A number that is typed reaches `stack` and those who observe it, once; nothing comes back as a step to undo."""
    one = notebook.one
    field = one.layer(0).get_by_label("Roughness", exact=True)
    field.fill("0.3")
    field.press("Enter")
    notebook.until("one.stack.layers[0].alpha", 0.3)
    assert notebook.kernel.run("", "[(change.name, change.owner is one) for change in heard]") == [("stack", True)]
    assert notebook.kernel.run("", "two.stack == vt.preset('coated-gold')") is True
    assert one.editor.evaluate("(el) => el.velatura.store.undoes") == "change a value"


def test_a_burst_ends_with_the_last_value_on_both_sides(notebook: Notebook) -> None:
    slider = notebook.one.layer(0).get_by_label("Roughness, slider", exact=True)
    slider.evaluate(
        """(slider) => {
          for (let tick = 100; tick < 400; tick++) {
            slider.value = tick;
            slider.dispatchEvent(new Event('input', { bubbles: true }));
          }
          slider.dispatchEvent(new Event('change', { bubbles: true }));
        }"""
    )
    last = notebook.one.state("layers.0.keys.alpha")
    notebook.until("one.stack.layers[0].alpha", last)
    notebook.one.wait("quiet && !el.velatura.store.dragging")
    assert notebook.one.state("layers.0.keys.alpha") == last
    assert notebook.kernel.run("", "len(heard)") < 100


def test_models_and_their_switches_go_both_ways(notebook: Notebook) -> None:
    notebook.kernel.run("one.model = vt.MODELS[0].with_switches(tir='clean')")
    notebook.one.wait("store.get().model === 'belcour2018'")
    assert notebook.one.state("switches") == {"tir": "clean"}
    notebook.two.editor.locator("details.section > summary").last.click()
    notebook.two.editor.get_by_role("combobox", name="Model", exact=True).select_option(label="Bati 2021")
    notebook.until("two.model.name", "bati2021")
    assert notebook.kernel.run("", "(one.model.name, one.model.tir)") == ("belcour2018", "clean")


def test_two_editors_work_at_once(notebook: Notebook) -> None:
    """Both load a photographed light, which comes as a message, and take a stack each, in one line of Python."""
    for cell in notebook.one, notebook.two:
        cell.editor.locator("details.section > summary").first.click()
        cell.editor.get_by_role("combobox", name="Light", exact=True).select_option(label="City")
    notebook.kernel.run("one.stack = one.stack.replace(layer0_eta=1.3); two.stack = two.stack.replace(layer0_eta=1.9)")
    for cell, eta in (notebook.one, 1.3), (notebook.two, 1.9):
        cell.wait(f"store.get().layers[0].keys.eta === {eta} && el.velatura.quiet && el.velatura.viewport.previewed")
        cell.wait("viewport.sources.name.endsWith('city.exr')")
        assert cell.problems() == []


def test_what_is_no_stack_stays_in_the_page(notebook: Notebook) -> None:
    """Python keeps the last valid stack while the page says why its own is none, which hands are kept from."""
    one = notebook.one
    one.editor.evaluate(
        "({ velatura: { store } }) => store.run(Object.assign(({ layers: [a, b, c], ...state }) =>"
        " ({ ...state, layers: [a, c, b] }), { title: 'move a layer' }))"
    )
    one.editor.locator(".layer .problem").first.wait_for()
    assert notebook.kernel.run("", "one.stack == vt.preset('coated-gold')") is True
    one.editor.get_by_role("button", name="Undo: move a layer").click()
    one.editor.locator(".layer .problem").first.wait_for(state="detached")
    assert notebook.kernel.run("", "len(heard)") == 0
