"""Sizes of pictures by their heads, and what is refused before it is decoded."""

from __future__ import annotations

import os
import re
import resource
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import velatura as vt
from velatura import kernel, pictures
from velatura.errors import InvalidInput

FORMATS = (".png", ".jpg", ".exr", ".hdr", ".pfm", ".ppm", ".bmp", ".tga")
HUGE = 60000


@pytest.fixture(params=FORMATS)
def picture(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A picture of 5 x 3 pixels, as Mitsuba writes it; those of formats that it only reads, by hand."""
    path = tmp_path / f"a{request.param}"
    texels = np.random.default_rng(0).uniform(0, 1, (3, 5, 3)).astype(np.float32)
    if request.param == ".tga":
        head = struct.pack("<BBB5xHHHHBB", 0, 0, 2, 0, 0, 5, 3, 24, 32)
        path.write_bytes(head + (texels * 255).astype(np.uint8).tobytes() + bytes(8) + b"TRUEVISION-XFILE.\0")
    elif request.param == ".bmp":
        rows = b"".join(row.tobytes() + b"\0" for row in (texels * 255).astype(np.uint8))
        head = struct.pack("<2sI4xIIiiHHIIiiII", b"BM", 54 + len(rows), 54, 40, 5, 3, 1, 24, 0, len(rows), 0, 0, 0, 0)
        path.write_bytes(head + rows)
    else:
        single = request.param in (".exr", ".hdr", ".pfm")
        kernel.mitsuba().Bitmap(texels if single else (texels * 255).astype(np.uint8)).write(str(path))
    return path


def enlarged(path: Path) -> bytes:
    """The picture with the size of another one in its head."""
    data = path.read_bytes()
    little, big = struct.pack("<HH", HUGE, HUGE), struct.pack(">HH", HUGE, HUGE)
    if path.suffix == ".png":
        return data[:16] + struct.pack(">II", HUGE, HUGE) + data[24:]
    if path.suffix == ".jpg":
        begin = re.search(rb"\xff[\xc0\xc1\xc2]..\x08", data, re.DOTALL).end()  # type: ignore[union-attr]
        return data[:begin] + big + data[begin + 4 :]
    if path.suffix == ".exr":
        begin = data.index(b"dataWindow\0box2i\0") + 21
        return data[:begin] + struct.pack("<4i", -HUGE, 0, HUGE, HUGE) + data[begin + 16 :]
    if path.suffix == ".hdr":
        return re.sub(rb"([-+]Y )\d+( [-+]X )\d+", rb"\g<1>60000\g<2>60000", data)
    if path.suffix in (".pfm", ".ppm"):
        return re.sub(rb"^(P.\s)5(\s)3(\s)", rb"\g<1>60000\g<2>60000\g<3>", data)
    if path.suffix == ".bmp":
        return data[:18] + struct.pack("<ii", HUGE, HUGE) + data[26:]
    return data[:12] + little + data[16:]


def test_the_size_is_read_of_every_format(picture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Expected: 15 pixels, as Mitsuba reads them; with one less in the limit the picture is refused."""
    assert np.shape(kernel.bitmap(picture))[:2] == (3, 5)
    monkeypatch.setattr(pictures, "LARGEST", 14)
    with pytest.raises(InvalidInput, match=rf"^{picture}: holds 15 pixels, more than 14$"):
        kernel.bitmap(picture)


def test_a_bomb_is_refused_before_it_is_decoded(picture: Path) -> None:
    """Expected: one line, as a texture and as a light, and no memory for the pixels."""
    picture.write_bytes(enlarged(picture))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(
        InvalidInput, match=rf"^layer0_alpha_u: the texture {picture} holds .* pixels, more than 1.3e\+08$"
    ):
        vt.bsdf(vt.Stack([vt.Interface(eta=1.5, alpha=vt.Texture(texture=picture))]))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2**18  # KiB


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    """Expected: heads that end early or say nothing, pictures without pixels, a pipe."""
    path, pipe = tmp_path / "a.png", tmp_path / "pipe.png"
    os.mkfifo(pipe)
    png = b"\x89PNG\r\n\x1a\n"
    exr = b"\x76\x2f\x31\x01\2\0\0\0"
    for data in (
        b"",
        b"x",
        png,
        png + bytes(40),
        b"\xff\xd8",
        b"\xff\xd8" + b"\xff\xe0\0\2" * 20_000,
        exr,
        exr + b"a" * 999,
    ):
        path.write_bytes(data)
        with pytest.raises(InvalidInput, match=rf"^{path}: is no image that Mitsuba can read$"):
            kernel.bitmap(path)
    with pytest.raises(InvalidInput, match=rf"^{pipe}: cannot be read: is no regular file$"):
        kernel.bitmap(pipe)


def test_the_tiles_and_channels_of_openexr_count(tmp_path: Path) -> None:
    """Expected: a tile of 2^31 x 2^31, and 20 channels of 8192 x 8192, are more than memory holds."""

    def written(*attributes: tuple[str, str, bytes]) -> Any:
        head = b"".join(
            f"{name}\0{kind}\0".encode() + struct.pack("<I", len(value)) + value for name, kind, value in attributes
        )
        path = tmp_path / "a.exr"
        path.write_bytes(b"\x76\x2f\x31\x01\2\2\0\0" + head + b"\0" + bytes(64))
        return path

    window = "dataWindow", "box2i", struct.pack("<4i", 0, 0, 8191, 8191)
    tiles = "tiles", "tiledesc", struct.pack("<IIB", 2**31 - 1, 2**31 - 1, 0)
    channels = "channels", "chlist", b"".join(f"{k:02d}\0".encode() + bytes(16) for k in range(20)) + b"\0"
    for path in (written(window, tiles), written(window, channels)):
        with pytest.raises(InvalidInput, match=r"pixels, more than 1\.3e\+08$"):
            pictures.check(path)
