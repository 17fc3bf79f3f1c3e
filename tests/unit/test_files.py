"""Files are written whole or not at all, and what is there already keeps its kind, its links and its mode."""

from __future__ import annotations

import os
import resource
import stat
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from velatura import files
from velatura.errors import InvalidInput


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@contextmanager
def small_files(most: int = 8192) -> Iterator[None]:
    """No file may grow beyond so many bytes, which a write meets as it meets a full disk; a report of tests may."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def write(path: str | Path, text: str = "new") -> None:
    with files.whole(Path(path)) as unfinished:
        unfinished.write_text(text)


def mode(path: str | Path) -> int:
    return stat.S_IMODE(os.stat(path).st_mode)


def test_a_new_file_has_the_mode_of_any_other() -> None:
    before = os.umask(0o027)
    try:
        write("a.txt")
    finally:
        os.umask(before)
    assert (Path("a.txt").read_text(), mode("a.txt")) == ("new", 0o640)
    assert os.listdir() == ["a.txt"]


def test_a_link_stays_a_link_to_a_file_that_keeps_its_mode() -> None:
    Path("far").mkdir()
    Path("far/private.txt").write_text("old")
    os.chmod("far/private.txt", 0o600)
    os.symlink("far/private.txt", "a.txt")
    write("a.txt")
    assert os.readlink("a.txt") == "far/private.txt"
    assert (Path("far/private.txt").read_text(), mode("far/private.txt")) == ("new", 0o600)
    assert [*os.listdir("far"), *sorted(os.listdir())] == ["private.txt", "a.txt", "far"]


def test_a_link_to_no_file_yet_leads_to_a_new_one() -> None:
    os.symlink("b.txt", "a.txt")
    write("a.txt")
    assert os.path.islink("a.txt") and Path("b.txt").read_text() == "new"


def test_a_pipe_is_written_to_and_stays_a_pipe() -> None:
    os.mkfifo("a.txt")
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(Path("a.txt").read_text()))
    reader.start()
    files.check_writable("a.txt", "a text", [".txt"])
    write("a.txt")
    reader.join(timeout=60)
    assert read == ["new"] and stat.S_ISFIFO(os.stat("a.txt").st_mode)


def test_a_device_behind_a_link_is_written_to() -> None:
    """Rationale: a terminal stands for all devices, since nothing is lost if it is replaced after all."""
    ours, theirs = os.openpty()
    os.symlink(os.ttyname(theirs), "a.txt")
    write("a.txt")
    assert os.read(ours, 10) == b"new"
    assert os.path.islink("a.txt") and stat.S_ISCHR(os.stat("a.txt").st_mode)
    os.close(ours)
    os.close(theirs)


def test_threads_that_write_one_file_do_not_meet() -> None:
    with ThreadPoolExecutor(10) as pool:
        list(pool.map(lambda n: write("a.txt", str(n) * 1000), range(200)))
    assert Path("a.txt").read_text() in {str(n) * 1000 for n in range(200)}
    assert os.listdir() == ["a.txt"]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("none/a.txt", "none/a.txt: there is no folder none"),
        ("folder.txt", "folder.txt: is a folder"),
        ("read-only.txt", "read-only.txt: cannot be written: is read-only"),
        ("loop.txt", "loop.txt: cannot be written: too many levels of symbolic links"),
        ("x" * 252 + ".txt", "x" * 252 + ".txt: cannot be written: file name too long"),
        ("x" * 300 + "/a.txt", "x" * 300 + "/a.txt: there is no folder " + "x" * 300),
        ("a\0.txt", "a\\x00.txt: cannot be written: embedded null byte"),
        ("out.txt", "out.txt: the folder none is not writable (no such file or directory)"),
    ],
)
def test_a_place_that_cannot_be_written_is_found_before_the_work(name: str, says: str, here: Path) -> None:
    Path("folder.txt").mkdir()
    Path("read-only.txt").write_text("old")
    os.chmod("read-only.txt", 0o444)
    os.symlink("loop.txt", "loop.txt")
    os.symlink("none/b.txt", "out.txt")
    before = sorted(os.listdir())
    with pytest.raises(InvalidInput) as refused:
        files.check_writable(name, "a text", [".txt"])
    assert str(refused.value).replace(f"{here}/", "") == says
    with pytest.raises(InvalidInput):
        write(name)
    assert sorted(os.listdir()) == before and Path("read-only.txt").read_text() == "old"


def test_the_longest_name_is_no_hindrance() -> None:
    name = "x" * 251 + ".txt"
    files.check_writable(name, "a text", [".txt"])
    write(name)
    assert os.listdir() == [name]


def test_a_full_disk_loses_nothing() -> None:
    Path("a.txt").write_text("old")
    with small_files(), pytest.raises(InvalidInput) as refused:
        write("a.txt", "new" * 8192)
    assert str(refused.value) == "a.txt: cannot be written: file too large"
    assert os.listdir() == ["a.txt"] and Path("a.txt").read_text() == "old"


def test_a_disk_that_is_full_already_is_found_before_the_work() -> None:
    full = r"^a\.txt: the folder \. is not writable \(file too large\)$"
    with small_files(0), pytest.raises(InvalidInput, match=full):
        files.check_writable("a.txt", "a text", [".txt"])
    assert not os.listdir()


def test_a_mistake_in_the_block_is_no_error_of_writing() -> None:
    with pytest.raises(ZeroDivisionError), files.whole(Path("a.txt")):
        raise ZeroDivisionError
    assert not os.listdir()
