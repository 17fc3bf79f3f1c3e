"""The verb `render`: the page's view by Mitsuba, a step a call, which is in the folder after the last.

The page asks for one step after another, so that it shows how far the picture is, stops it, and leaves Mitsuba to other
calls in between. A step is some samples of all pixels, or one of a band of a large picture.
"""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from velatura import kernel
from velatura.editor.folder import Folder
from velatura.editor.messages import Answer, Body, Verb, admitting, field, material_of, model_of
from velatura.editor.shot import LIGHT, Shot, sides
from velatura.errors import InvalidInput
from velatura.model import Model
from velatura.scenes import check_view, write_image
from velatura.scenes.denoise import check_denoiser, denoised
from velatura.scenes.views import DEFAULT_VIEW
from velatura.stack import Described

LARGEST = 4096  # pixels along a side
MOST = 2**20  # samples of a step
WRITTEN = (".png", ".exr")
HIDDEN = ("plinth", "ground")  # where the ground is transparent


class Renderings:
    """The pictures of a folder that are under way: the latest alone, by its key."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.key = ""
        self.picture: Picture | None = None
        self.lock = threading.Lock()

    @property
    def verbs(self) -> dict[str, Verb]:
        """Every verb by the name that the page calls it by."""
        return {"render": admitting(self.render)}

    def render(self, body: Body) -> Answer:
        """A step of the picture that has a `key` of the page's choice: the next `step` of `steps`, or the `file`.

        A step that was made already is not made again. Of the body, beside that of `truth`, which the first step
        takes alone: a `mesh` in the place of the object, `samples` per pixel,
        `walk`, whether light walks through the layers, `transparent`, whether there is no ground, `denoised`, the
        `exposure` of a PNG in stops and its `view` transform, and the name of the `file`, which is numbered where it is
        taken.
        """
        step, key, name = body.get("step", 0), field(body, "key", str), field(body, "file", str)
        view = check_view(body.get("view", DEFAULT_VIEW))
        self.folder.place(name, WRITTEN)
        with self.lock:
            if step == 0 and key != self.key:
                self.key, self.picture = key, self._begun(body)
            picture = self.picture
            if picture is None or key != self.key:
                raise InvalidInput("the picture is no longer under way: another one was begun")
            if step == picture.step:
                picture.go_on()
            if picture.step < picture.steps:
                return {"step": picture.step, "steps": picture.steps}
            self.key, self.picture = "", None
            stops = body.get("exposure", 0.0) if name.lower().endswith(".png") else 0.0
            return {"file": self._written(name, 2.0**stops * picture.image(), view)}

    def _begun(self, body: Body) -> Picture:
        environment = body.get("environment", "studio")
        file = None
        if environment.lower().endswith(LIGHT):
            file = self.folder.existing(environment, LIGHT).relative_to(self.folder.path)
        if body.get("denoised"):
            check_denoiser()
        kind = Kind(*(body.get(key, False) for key in Kind._fields))
        shot, size = Shot.of(body, file), sides(body, LARGEST)
        return Picture(material_of(body), model_of(body), shot, size, body.get("samples", 64), kind)

    def _written(self, name: str, image: NDArray[np.float32], view: str) -> str:
        with self.folder.writing, kernel.exclusive:
            path = self.folder.free(self.folder.place(name, WRITTEN))
            write_image(image, path.relative_to(self.folder.path), view)
        return path.name


class Kind(NamedTuple):
    """Whether light walks through the layers, the ground is transparent, and noise is taken away at the end."""

    walk: bool
    transparent: bool
    denoised: bool


class Picture:
    """A picture under way, (height, width, 3 or 4); `step` of `steps` are done."""

    def __init__(
        self, material: Described, model: Model, shot: Shot, size: tuple[int, int], samples: int, kind: Kind
    ) -> None:
        self.material, self.model, self.shot, self.size, self.kind = material, model, shot, size, kind
        width, height = size
        self.rows = max(1, min(height, MOST // width))  # of a band
        self.bands = -(-height // self.rows)
        self.spp = 1 if self.bands > 1 else min(samples, max(1, MOST // (width * height)))
        self.samples = samples
        self.rounds = -(-samples // self.spp)
        self.step, self.steps = 0, self.bands * self.rounds
        self.total = np.zeros((height, width, 4 if kind.transparent else 3), np.float32)

    def go_on(self) -> None:
        """Make the next step."""
        at, band = divmod(self.step, self.bands)
        spp = min(self.spp, self.samples - at * self.spp)
        first = band * self.rows
        seen = self._band(first, spp, seed=self.step + 1)
        self.total[first : first + len(seen)] += spp * seen
        self.step += 1

    def image(self) -> NDArray[np.float32]:
        """The picture of all samples, its colours weighed by alpha."""
        image = self.total / np.float32(self.samples)
        if self.kind.denoised:
            image[..., :3] = denoised(image[..., :3])
        return image

    @kernel.exclusive
    def _band(self, first: int, spp: int, seed: int) -> NDArray[np.float32]:
        mi = kernel.mitsuba()
        scene, described = self._loaded
        film = {**described["film"], "crop_offset_y": first, "crop_height": min(self.rows, self.size[1] - first)}
        film |= {"crop_offset_x": 0, "crop_width": self.size[0], "sample_border": self.bands > 1}
        sensor = mi.load_dict({**described, "film": film})
        return np.array(mi.render(scene, sensor=sensor, spp=spp, seed=seed))[..., : self.total.shape[-1]]

    @functools.cached_property
    def _loaded(self) -> tuple[Any, dict[str, Any]]:
        """The scene, and its camera as `mi.load_dict` takes it."""
        from velatura.api import bsdf

        mi = kernel.mitsuba()
        walk = functools.partial(bsdf, model="reference", microsurface=self.model.microsurface)
        scene = self.shot.scene(
            self.material, walk if self.kind.walk else lambda part: bsdf(part, self.model), self.size
        )
        film = scene["sensor"]["film"]
        if self.kind.transparent:
            scene = {name: part for name, part in scene.items() if name not in HIDDEN}
            scene["integrator"] = {**scene["integrator"], "hide_emitters": True}
            film = {**film, "pixel_format": "rgba"}
        if self.kind.denoised:
            film = {**film, "rfilter": {"type": "box"}}
        scene["sensor"] = {**scene["sensor"], "film": film}
        return mi.load_dict(scene), scene["sensor"]
