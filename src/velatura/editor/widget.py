"""The editor in a cell of a notebook: the same page, with this process as its server."""

from __future__ import annotations

import contextvars
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.parse import unquote

from velatura.editor import bundle
from velatura.editor.folder import Conflict, Folder
from velatura.editor.messages import Answer, admitted, document, field, material_of, model_of
from velatura.editor.rendering import Renderings
from velatura.editor.service import FILES, VERBS
from velatura.errors import InvalidInput, VelaturaError, needs
from velatura.model import DEFAULT, SWITCHES, Model, named
from velatura.stack import Described, MaterialLike, load
from velatura.stack.schema import show, unknown

with needs("notebook"):
    import anywidget
    import traitlets

BUG = "the editor has failed, which is a mistake in it; the kernel's log shows details"
LOWEST = 200  # pixels
THREADS = 4  # that answer one widget


class ReadTrait(traitlets.TraitType):
    """A trait that a function reads, which raises InvalidInput where there is no meaning to a value."""

    def __init__(self, read: Callable[[Any], Any]) -> None:
        super().__init__()
        self.read = read

    def validate(self, _: Any, value: Any) -> Any:
        return self.read(value)


# Values --------------------------------------------------------------------------------------------------------------


def _stack(value: Any) -> Described:
    if isinstance(value, MaterialLike):
        found: Described = load(value)
        return found
    raise InvalidInput(
        f"stack: must be a Stack, a Mix, the fields of one, a file or the name of a preset, got {show(value)}"
    )


def _model(value: Any) -> Model:
    if isinstance(value, str | Model):
        return named(value)
    raise InvalidInput(f"model: must be a Model or its name, got {show(value)}")


def _height(value: Any) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and value >= LOWEST:
        return value
    raise InvalidInput(f"height: must be a whole number of pixels from {LOWEST}, got {show(value)}")


# Values as the page has them -----------------------------------------------------------------------------------------


def _written(stack: Described, editor: Editor) -> Answer:
    """A material for the page: in its own words where it is the page's, which hears of no change then."""
    described, fields = editor._described
    return fields if stack == described else document(stack)


def _described(fields: Answer, editor: Editor) -> Described:
    """The page's material; while that is invalid, which the page reports, the last valid one."""
    try:
        stack = material_of(admitted({"material": fields}))
    except InvalidInput:
        return editor.stack
    editor._described = stack, fields
    return stack


def _chosen(model: Model, _: Editor) -> Answer:
    usual = named(model.name)
    changed = {switch: getattr(model, switch) for switch in SWITCHES}
    return {
        "name": model.name,
        "switches": {key: choice for key, choice in changed.items() if choice != getattr(usual, key)},
    }


def _named(fields: Answer, editor: Editor) -> Model:
    try:
        return model_of(admitted({"model": fields.get("name"), "switches": fields.get("switches")}))
    except InvalidInput:
        return editor.model


# The widget ----------------------------------------------------------------------------------------------------------


class Editor(anywidget.AnyWidget):
    """The editor, shown in the cell whose last line it is.

    `stack` and `model` are synchronised both ways: set them, and the page changes, in one step that it can undo; change
    the page, and they follow, which `editor.observe(f, "stack")` reports. The page opens and saves files of the
    working directory.

    Args:
        stack: a Stack or a Mix, its fields as a mapping, a file or the name of a preset.
        model: a named model, or a Model with other switches.
        height: of the cell, in pixels.

    Raises:
        InvalidInput: no valid material, model or height, here or where they are set.
        MissingTool: on import, where anywidget or the page is missing.
    """

    _esm = bundle.require() / "widget.js"
    _css = bundle.require() / "widget.css"

    stack = ReadTrait(_stack).tag(sync=True, to_json=_written, from_json=_described)
    model = ReadTrait(_model).tag(sync=True, to_json=_chosen, from_json=_named)
    height = ReadTrait(_height).tag(sync=True)

    def __init__(
        self,
        stack: MaterialLike | None = None,
        model: str | Model = DEFAULT,
        height: int = 640,
    ) -> None:
        self._described: tuple[Described | None, Answer] = None, {}
        self._folder = Folder()
        self._verbs = {**VERBS, **self._folder.verbs, **Renderings(self._folder).verbs}
        self._threads = ThreadPoolExecutor(THREADS)
        super().__init__(stack="coated-gold" if stack is None else stack, model=model, height=height)
        self.on_msg(self._asked)

    def __repr__(self) -> str:
        return f"Editor(stack={self.stack.name!r}, model={self.model.name!r}, height={self.height})"

    def close(self) -> None:
        """Take the editor off the notebook."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        super().close()

    def _asked(self, _: Any, message: Answer, buffers: Any) -> None:
        """Answer a message of the page without holding up the notebook."""
        self._threads.submit(contextvars.copy_context().run, self._answer, message)

    def _answer(self, message: Answer) -> None:
        about = {"id": message.get("id")}
        try:
            verb, body = field(message, "verb", str), field(message, "body", dict, {})
            if verb == "file":
                self.send({**about, "answer": {}}, [self._file(field(body, "address", str))])
            elif verb in self._verbs:
                self.send({**about, "answer": self._verbs[verb](body)})
            else:
                raise InvalidInput(unknown("verb", verb, self._verbs))
        except VelaturaError as error:
            self.send({**about, "error": str(error), "status": 409 if isinstance(error, Conflict) else 422})
        except Exception:
            self.log.exception("The editor has failed")
            self.send({**about, "error": BUG, "status": 500})

    def _file(self, address: str) -> bytes:
        """The content at an address of the server: an environment, or a texture of the folder."""
        if address in FILES:
            return FILES[address].read_bytes()
        return self._folder.picture(unquote(address.removeprefix("/files/"))).read_bytes()
