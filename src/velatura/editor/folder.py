"""The files of the folder of the editor: materials and textures, by plain names, and nothing else."""

from __future__ import annotations

import base64
import binascii
import contextlib
import hashlib
import itertools
import os
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from velatura import imports
from velatura.editor import library
from velatura.editor.messages import TEXT, Answer, Body, Verb, admitting, document, field, to_write
from velatura.errors import InvalidInput
from velatura.files import reason, whole
from velatura.programs import embedded
from velatura.stack import dumps, load
from velatura.stack.paths import beside, is_of_presets, rewritten

#: Bytes of the largest file that is read, and of the largest request.
LARGEST = 32 * 2**20

MATERIALS = (".yaml", ".yml", ".json")
FOREIGN = tuple(imports.FORMATS)
REMOVED = ".velatura-removed"  # where files lie that were removed
PICTURES = (".png", ".jpg", ".jpeg", ".exr", ".hdr")


class Conflict(InvalidInput):
    """A file has been changed by another program since it was opened."""


class Folder:
    """The working directory, and the verbs that read and write files directly in it."""

    def __init__(self) -> None:
        self.path = Path.cwd().resolve()
        self.writing = threading.Lock()

    @property
    def verbs(self) -> dict[str, Verb]:
        """Every verb by the name that the page calls it by."""
        verbs = {"list": self.listed, "open": self.opened, "save": self.saved}
        verbs |= {"import": self.imported, "texture": self.texture}
        verbs |= {"rename": self.renamed, "remove": self.removed, "restore": self.restored, "keep": self.kept}
        return {name: admitting(verb) for name, verb in verbs.items()}

    def first(self, material: str) -> Answer:
        """A material that is named on the command line: a file, to be saved back if it is in the folder, or a preset.

        Raises:
            InvalidInput: no such material.
        """
        found, path = load(material), Path(material).resolve()
        if path.is_file() and path.parent == self.path and path.suffix.lower() in MATERIALS:
            return {**self.opened({"file": path.name}), "file": path.name}
        return {"material": document(found), "file": None, "version": None}

    # Verbs -----------------------------------------------------------------------------------------------------------

    def listed(self, body: Body) -> Answer:
        """The files that can be opened, and what is `kept` of materials by their names."""
        names = sorted(os.listdir(self.path))
        kinds = {"files": (*MATERIALS, *FOREIGN), "textures": PICTURES}
        found = {kind: [name for name in names if self._readable(name, endings)] for kind, endings in kinds.items()}
        kept = {name: library.kept(self.path, name) for name in found["files"]}
        return {**found, "kept": {name: each for name, each in kept.items() if each}}

    def opened(self, body: Body) -> Answer:
        """The material of a file, and the version that the file has now."""
        path = self.existing(field(body, "file", str), MATERIALS)
        if path.stat().st_size > TEXT:
            raise InvalidInput(f"{path.name}: a material file may have {TEXT >> 10} KiB at most here")
        version = _version(path)
        return {"material": document(load(os.path.relpath(path))), "version": version}

    def imported(self, body: Body) -> Answer:
        """The material of a file of another program, in the folder or in `data`, and what is `left` of it.

        Images that the file holds are written into the folder. Where it has several materials, and `name` is none of
        them, the answer is their `names`. Of `bare` data the parameters are read also where a bake holds its material.
        """
        name = field(body, "file", str)
        data = None if body.get("data") is None else _decoded(body)
        if data is not None and body.get("bare"):
            data = embedded.loosened(data)
        with self._placed(name, data) as path:
            names = [] if body.get("name") else imports.choice(path)
            if names:
                return {"names": names}
            found = imports.read(path, body.get("name"))
            with self.writing, beside(found.stack, self.path) as placed:
                material = document(placed)
                rewritten(material, self._check_near)
        return {"material": material, "left": [str(each) for each in found.left]}

    def saved(self, body: Body) -> Answer:
        """Write a material; Conflict unless the file has the version given, None for a file that is not there."""
        name = field(body, "file", str)
        path = self.place(name, MATERIALS)
        format, material = "json" if path.suffix.lower() == ".json" else "yaml", to_write(body)
        with self.writing:
            self._check_version(path, body.get("version"))
            with beside(material, self.path, presets=True) as placed:
                _write(path, dumps(placed, format, self.path).encode())
            return {"file": name, "version": _version(path)}

    def renamed(self, body: Body) -> Answer:
        """Give a material file another `name` of the same ending; Conflict where that is taken."""
        path = self.existing(field(body, "file", str), MATERIALS)
        target = self.place(field(body, "name", str), (path.suffix,))
        with self.writing:
            _move(path, target)
            library.move(self.path, path.name, target.name)
        return {"file": target.name}

    def removed(self, body: Body) -> Answer:
        """Put a material file away, into the folder REMOVED, where it has the name of the answer."""
        path = self.existing(field(body, "file", str), MATERIALS)
        with self.writing:
            (self.path / REMOVED).mkdir(exist_ok=True)
            target = self.free(self.path / REMOVED / path.name)
            _move(path, target)
            library.move(self.path, path.name, f"{REMOVED}-{target.name}")
        return {"file": target.name}

    def restored(self, body: Body) -> Answer:
        """Put a `file` that was put away back, as `name`; Conflict where that is taken meanwhile."""
        put = self.place(field(body, "file", str), MATERIALS).name
        target = self.place(field(body, "name", str), MATERIALS)
        with self.writing:
            _move(self.path / REMOVED / put, target)
            library.move(self.path, f"{REMOVED}-{put}", target.name)
        return {"file": target.name}

    def kept(self, body: Body) -> Answer:
        """Keep the `tags` or the `thumbnail` of a file, in the folder of the library; the answer is what is kept."""
        name = self.existing(field(body, "file", str), (*MATERIALS, *FOREIGN)).name
        with self.writing:
            library.keep(self.path, name, **{key: body[key] for key in library.KEYS if key in body})
            return library.kept(self.path, name)

    def texture(self, body: Body) -> Answer:
        """Put a picture into the folder, under a name that is free, or is this very picture's already."""
        name = field(body, "file", str)
        path = self.place(name, PICTURES)
        data = _decoded(body)
        with self.writing:
            free = self.free(path, data)
            if not free.exists():
                _write(free, data, check=lambda written: _check_picture(written, name))
        return {"file": free.name}

    @contextlib.contextmanager
    def _placed(self, name: str, data: bytes | None) -> Iterator[str]:
        """The path of a file to import; `data` lies in the folder for the time being, so that it finds its images."""
        if data is None:
            yield os.path.relpath(self.existing(name, FOREIGN))
            return
        place = self.place(name, FOREIGN)
        try:
            with tempfile.NamedTemporaryFile(dir=self.path, prefix=".import-", suffix=place.suffix.lower()) as file:
                file.write(data)
                file.flush()
                try:
                    yield os.path.relpath(file.name)
                except InvalidInput as error:
                    text = str(error).replace(Path(file.name).name, name).replace(f"{self.path}{os.sep}", "")
                    raise InvalidInput(text) from None
        except OSError as error:
            raise InvalidInput(f"{name}: cannot be put into the folder: {reason(error)}") from None

    def _check_near(self, path: str) -> str:
        """The path of an image or a table, which must lie in the folder. Raises InvalidInput."""
        if Path(path).name != path and not is_of_presets(self.path / path):
            raise InvalidInput(f"{path}: must lie in the folder that the editor was started in, beside the material")
        return path

    # Names -----------------------------------------------------------------------------------------------------------

    def place(self, name: str, endings: Sequence[str]) -> Path:
        """The path of a file of that name, which may not exist yet.

        Raises:
            InvalidInput: anything but the plain name of a file of this folder with one of the endings.
        """
        if not name.isprintable() or {"/", "\\"} & set(name) or name.startswith(".") or not name.strip():
            raise InvalidInput(f"{name!r}: must be the plain name of a file of the folder")
        path = self.path / name
        if path.suffix.lower() not in endings:
            raise InvalidInput(f"{name}: must end in {', '.join(endings)}")
        try:
            inside = path.resolve().parent == self.path and (path.is_file() or not path.exists())
        except OSError as error:  # a name that is too long for the disk
            raise InvalidInput(f"{name}: cannot be the name of a file ({error.strerror})") from None
        except (RuntimeError, ValueError):
            inside = False
        if not inside:
            raise InvalidInput(f"{name}: must be a file of the folder, and no link out of it")
        return path

    def picture(self, name: str) -> Path:
        """The path of a picture that a material reads: one of this folder, or one that comes with the presets.

        Raises:
            InvalidInput: as `existing`.
        """
        path = self.path / name
        if path.suffix.lower() in PICTURES and is_of_presets(path) and path.is_file():
            return path
        return self.existing(name, PICTURES)

    def free(self, path: Path, data: bytes | None = None) -> Path:
        """The path, or with a number where another file, of other data than these, has the name."""
        numbered = (path.with_stem(f"{path.stem}-{i}") for i in itertools.count(2))
        same = (p for p in itertools.chain([path], numbered) if not p.exists() or p.read_bytes() == data)
        return next(same)

    def existing(self, name: str, endings: Sequence[str]) -> Path:
        """The path of an existing file. Raises InvalidInput as `place`, and where it is missing or too large."""
        path = self.place(name, endings)
        if not path.is_file():
            raise InvalidInput(f"{name}: there is no such file in the folder")
        if path.stat().st_size > LARGEST:
            raise InvalidInput(f"{name}: is larger than {LARGEST >> 20} MiB")
        return path

    def _check_version(self, path: Path, expected: object) -> None:
        if _version(path) == expected:
            return
        if expected is None:
            raise Conflict(f"{path.name}: exists already")
        raise Conflict(f"{path.name}: has {'changed' if path.exists() else 'been removed'} since it was opened")

    def _readable(self, name: str, endings: Sequence[str]) -> bool:
        try:
            return self.existing(name, endings).is_file()
        except InvalidInput:
            return False


def _move(path: Path, target: Path) -> None:
    if target.exists():
        raise Conflict(f"{target.name}: exists already")
    try:
        os.rename(path, target)
    except OSError as error:
        raise InvalidInput(f"{path.name}: cannot be moved: {reason(error)}") from None


def _decoded(body: Body) -> bytes:
    try:
        return base64.b64decode(field(body, "data", str), validate=True)
    except (binascii.Error, ValueError):
        raise InvalidInput("data: must be in base64") from None


def _version(path: Path) -> str | None:
    """The version of the content of a file; None if there is no file."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InvalidInput(f"{path.name}: cannot be read ({error.strerror})") from None


def _write(path: Path, data: bytes, check: Callable[[Path], None] = lambda path: None) -> None:
    """Write a file that passes a check, whole or not at all."""
    with whole(Path(os.path.relpath(path))) as unfinished:
        unfinished.write_bytes(data)
        check(unfinished)


def _check_picture(path: Path, name: str) -> None:
    """Raise InvalidInput, which gives the name of the picture, unless the renderer can read a file as one."""
    from velatura import kernel

    try:
        kernel.bitmap(path)
    except InvalidInput:
        raise InvalidInput(f"{name}: is no picture that can be read") from None
