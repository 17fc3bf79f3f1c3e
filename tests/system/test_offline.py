"""`velatura edit --static`: the folder that it writes, and those that it refuses."""

from __future__ import annotations

import gzip
import itertools
import json
import sys
from pathlib import Path

import pytest

from velatura.editor import bundle, offline
from velatura.errors import InvalidInput
from velatura.model import named
from velatura.stack import preset, presets

pytestmark = pytest.mark.skipif(not bundle.finding().ok, reason="the editor's page is not built")


def test_a_folder_of_other_files_is_refused_and_stays(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("all of it")
    with pytest.raises(InvalidInput, match=r"holds other files; name a new folder"):
        offline.write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(InvalidInput, match=r"is a file"):
        offline.write(tmp_path / "thesis.tex")
    with pytest.raises(InvalidInput, match=r"there is no folder"):
        offline.write(tmp_path / "no" / "where")


def test_nothing_is_left_of_a_folder_that_failed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(offline, "_common", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        offline.write(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_orders_are_those_that_the_page_can_make() -> None:
    """Expected: up to four layers, every word of the five kinds that is a material: 60, and 15 panes that are thin."""
    refusals = offline._refusals(offline.LAYERS)
    made = [order for order, refusal in refusals.items() if not refusal and len(order.kinds) <= offline.LAYERS]
    assert [sum(order.thin == thin for order in made) for thin in (False, True)] == [60, 15]
    below = offline.Order(("dielectric", "medium"))
    assert refusals[below] == "layer 1 (medium): an interface or a diffuse base must lie below a medium"
    for name in presets(mixtures=False):
        assert refusals[offline.Order.of(preset(name))._replace(brushed=False)] == ""


def test_a_folder_is_written_again(tmp_path: Path) -> None:
    """Expected: what it wrote before is replaced, and what lies beside it stays."""
    steps: list[tuple[int, int]] = []
    sizes = offline.write(tmp_path, lambda *step: steps.append(step), layers=1, models=[named("realtime")])
    assert steps[-1][0] == steps[-1][1] == len(steps)
    assert all((tmp_path / name).stat().st_size == size for name, size in sizes.items())
    made, lines = (
        json.loads(gzip.decompress((tmp_path / f"data/{name}.pack").read_bytes()))
        for name in ("shader/realtime/conductor", "lines/realtime")
    )
    assert "vt_eval_pdf" in "\n".join(lines[number] for number in itertools.accumulate(made["text"]))
    assert not made["closed_form"]
    (tmp_path / "data" / "old.pack").touch()
    (tmp_path / "CNAME").touch()
    again = offline.write(tmp_path, layers=1, models=[])
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert files == {*again, "CNAME"}


def test_the_command_takes_no_material_with_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from velatura.cli import main

    argv = sys.argv
    try:
        sys.argv = ["velatura", "edit", "coated-gold", "--static", str(tmp_path)]
        with pytest.raises(SystemExit) as ended:
            main()
    finally:
        sys.argv = argv
    assert ended.value.code == 2
    assert "--static: takes no material" in capsys.readouterr().err
