"""The editor of a notebook without one: its arguments, its messages to the page, and its answers."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import wait
from typing import Any

import pytest

pytest.importorskip("anywidget")

import velatura as vt
from velatura.editor import bundle
from velatura.errors import InvalidInput

pytestmark = pytest.mark.skipif(not bundle.finding().ok, reason="the page is not built")

BAD = [
    ("stack", 3, "stack: must be a Stack, a Mix, the fields of one, a file or the name of a preset, got 3"),
    ("stack", "no-such", "unknown preset 'no-such'"),
    ("stack", {"layers": []}, "layers: must hold at least one layer"),
    ("model", "no-such", "unknown model 'no-such'"),
    ("model", 3, "model: must be a Model or its name, got 3"),
    ("height", 20, "height: must be a whole number of pixels from 200, got 20"),
    ("height", True, "height: must be a whole number of pixels from 200, got True"),
]


@pytest.mark.parametrize(("key", "value", "says"), BAD)
def test_bad_values_are_refused_at_once_and_later(key: str, value: Any, says: str) -> None:
    with pytest.raises(InvalidInput) as made:
        vt.Editor(**{key: value})
    editor = vt.Editor()
    before = getattr(editor, key)
    with pytest.raises(InvalidInput) as set_:
        setattr(editor, key, value)
    assert str(made.value).startswith(says) and str(made.value) == str(set_.value)
    assert "\n" not in str(made.value) and getattr(editor, key) == before


def test_every_way_to_name_a_stack_is_the_same() -> None:
    stack = vt.preset("coated-gold")
    assert vt.Editor().stack == vt.Editor(stack).stack == vt.Editor(stack.to_dict()).stack == stack
    assert vt.Editor("bare-gold").stack == vt.preset("bare-gold")


def test_the_page_is_heard_in_its_own_words() -> None:
    """What it writes is not sent back in others, a change else; what is no stack or no model is left out."""
    editor = vt.Editor()
    fields = {"exterior": 1.0, "layers": [{"interface": {"alpha": 0.25, "eta": 1.5, "rotation": 0.0}}]}
    editor.set_state({"stack": fields, "model": {"name": "belcour2018", "switches": {"tir": "off"}}})
    assert editor.stack.layers[0].alpha == 0.25
    assert editor.model.name == "belcour2018"
    assert editor.get_state("stack") == {"stack": fields}
    editor.set_state({"stack": {"layers": []}, "model": {"name": "belcour2018", "switches": {"tir": "no"}}})
    editor.set_state({"stack": {"layers": [{"interface": {"eta": 1.5}}] * 49}, "model": {"switches": {"model": ""}}})
    assert editor.stack.layers[0].alpha == 0.25 and editor.model.name == "belcour2018"


def test_a_mixture_is_shown_and_follows_the_page() -> None:
    editor = vt.Editor("half-metallic-paint")
    fields = editor.get_state("stack")["stack"]
    assert isinstance(editor.stack, vt.Mix) and len(fields["mix"]) == 2
    fields["mix"][0]["weight"] = 0.125
    editor.set_state({"stack": fields})
    assert editor.stack.flat()["part0_weight"] == 0.125
    fields["mix"][0]["material"] = "bare-gold"  # which the page writes out
    editor.set_state({"stack": fields})
    assert editor.stack.flat()["part0_weight"] == 0.125


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Answers of an editor to a message of its page."""
    editor = vt.Editor()
    sent: list[Any] = []
    monkeypatch.setattr(editor, "send", lambda content, buffers=None: sent.append((content, buffers)))

    def answer(verb: str, body: Any = None) -> Any:
        sent.clear()
        submit, futures = editor._threads.submit, []
        with monkeypatch.context() as patch:
            patch.setattr(editor._threads, "submit", lambda *call: futures.append(submit(*call)))
            editor._handle_custom_msg({"id": "1", "verb": verb, "body": body or {}}, [])
        wait(futures)
        ((content, buffers),) = sent
        assert content.pop("id") == "1"
        return content, buffers

    return answer


def test_calls_are_answered(ask: Callable[..., Any]) -> None:
    content, _ = ask("read", {"text": "layers: [{interface: {eta: 1.4}}]"})
    assert content == {"answer": {"material": {"layers": [{"interface": {"eta": 1.4}}]}}}
    content, buffers = ask("file", {"address": "/environments/city.exr"})
    assert content == {"answer": {}} and buffers[0][:4] == bytes.fromhex("762f3101")  # OpenEXR's magic number


def test_calls_are_refused_in_one_line(ask: Callable[..., Any]) -> None:
    assert ask("read", {"text": "layers: ["})[0]["status"] == 422
    assert ask("reed")[0]["error"].startswith("unknown verb 'reed'")
    assert ask("validation", {"name": []}) == ({"error": "name: must be text, got []", "status": 422}, None)
    for address in ("/files/../secret.png", "/files/%2e%2e%2fsecret.png", "/etc/passwd", "/environments/../widget.js"):
        assert ask("file", {"address": address})[0]["status"] == 422


def test_a_bug_is_answered_too(ask: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vt.Stack, "from_dict", lambda fields: 1 / 0)
    assert ask("write", {"material": {}})[0]["status"] == 500


def test_without_anywidget_the_command_is_told() -> None:
    script = "import sys; sys.modules['anywidget'] = None\nimport velatura\nvelatura.Editor"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    mend = f'{sys.executable} -m pip install "velatura[notebook]"'
    assert run.stderr.endswith(f"anywidget is not installed: run `{mend}`\n")


def test_a_class_shows_itself() -> None:
    found = vt.inverse.invert_stack([{"energy": 0.09, "alpha": 0, "interfaces": 2}, {"energy": 0.1, "alpha": 0.1}])
    for members in found.classes:
        picture = members._repr_png_()
        assert picture.startswith(b"\x89PNG") and len(picture) < 60_000
