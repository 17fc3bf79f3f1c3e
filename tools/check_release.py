"""Build the wheel and the source distribution, and install each into empty environments of every Python.

    python tools/check_release.py [--pythons 3.10 3.14] [--folder dist]

The wheel must have `LARGEST` bytes at most, and both files pass `twine check`, as the index demands. Each environment
sees nothing but the package index and the system's libraries: no Node, no compiler, no variable of the caller. In it,
the commands of `COMMANDS` must succeed. One more, of the oldest Python, has the wheel with `EXTRAS` and the oldest
versions that it allows of all that it requires; there those of `OLDEST` must. Prints a line for each
step, and ends with status 1 at the first that fails.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from email import message_from_bytes
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
SUPPORTED = re.findall(r"Python :: (3\.\d+)", (ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGE = (
    "velatura/py.typed",
    "velatura/references.bib",
    "velatura/tables/tables.npz",
    "velatura/editor/static/editor.js",
    "velatura/stack/presets/coated-gold.yaml",
    "velatura/stack/presets/wear.png",
)
LICENCES = ("LICENSE", "THIRD-PARTY-LICENSES.txt")
SOURCES = ("tests/conftest.py", "docs/index.md", "benchmarks/rows.py", "CHANGELOG.md", "pyproject.toml", *LICENCES)
UNWANTED = re.compile(r"node_modules|__pycache__|\.map$|editor/page/.*\.js$")  # in the wheel
COMMANDS = (
    ("doctor",),
    ("lobes", "coated-gold", "--cos", "1,0.5"),
    ("cite", "belcour2018"),
    ("render", "bare-gold", "--size", "32", "--spp", "4", "-o", "gold.png"),
)
EXTRAS = ("plots", "editor", "notebook", "sweep")
PLAN = """\
material: bare-gold
vary: {layer0_alpha: {range: [0.1, 0.5], steps: 3}}
what: lobes
options: {cos_theta: [1], model: belcour2018}
"""
OLDEST = (
    *COMMANDS,
    ("check", "bare-gold"),
    ("compare", "bare-gold", "--models", "belcour2018", "--cos", "1", "--paths", "2000", "--plot", "lobes.png"),
    ("export", "coated-gold", "--to", "glsl", "-o", "gold.glsl"),
    ("sweep", "plan.yaml", "-o", "points.zarr", "--workers", "1"),
)
SECONDS = 900  # that a command may take
LARGEST = 8_000_000  # bytes of the wheel


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pythons", nargs="+", default=SUPPORTED, choices=SUPPORTED, metavar="VERSION")
    parser.add_argument("--folder", type=Path, default=ROOT / "dist", help="of the two files")
    options = parser.parse_args()
    shutil.rmtree(options.folder, ignore_errors=True)
    _done(
        subprocess.run(
            [sys.executable, "-m", "build", "--outdir", options.folder, ROOT], capture_output=True, text=True
        )
    )
    (wheel,), (source,) = options.folder.glob("*.whl"), options.folder.glob("*.tar.gz")
    print(f"built {wheel.name} and {source.name}")
    check_contents(wheel, source)
    _done(
        subprocess.run(
            [sys.executable, "-m", "twine", "check", "--strict", wheel, source], capture_output=True, text=True
        )
    )
    print(f"twine: metadata and README pass; the wheel has {wheel.stat().st_size / 1e6:.1f} MB")
    missing = []
    for version in options.pythons:
        if python := found(version):
            for distribution in (wheel, source):
                check_installed(python, distribution)
        else:
            missing.append(version)
    if python := found(SUPPORTED[0]):
        check_oldest(python, wheel)
    if missing:
        sys.exit(f"check_release: no Python {', '.join(missing)} on this machine")


def check_contents(wheel: Path, source: Path) -> None:
    """End if a file is missing, or one is there that must not be, or the wheel is too large."""
    if wheel.stat().st_size > LARGEST:
        sys.exit(f"check_release: {wheel.name} has {wheel.stat().st_size} bytes, more than {LARGEST}")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    version = wheel.name.split("-")[1]
    inside = [*PACKAGE, *(f"velatura-{version}.dist-info/licenses/{name}" for name in LICENCES)]
    _require(wheel, [name for name in inside if name not in names], "lacks")
    _require(wheel, [name for name in names if UNWANTED.search(name) or name.startswith("tests")], "has")
    with tarfile.open(source) as archive:
        sources = {name.partition("/")[2] for name in archive.getnames()}
    _require(
        source, [name for name in (*SOURCES, *(f"src/{name}" for name in PACKAGE)) if name not in sources], "lacks"
    )
    print(f"contents: {len(names)} and {len(sources)} files")


def check_installed(python: Path, distribution: Path) -> None:
    """End if a file does not install into an empty environment, or a command fails there."""
    with tempfile.TemporaryDirectory() as folder:
        _check(python, Path(folder), [str(distribution)], COMMANDS)
    print(f"{python}: {distribution.name}: {', '.join(command[0] for command in COMMANDS)}", flush=True)


def check_oldest(python: Path, wheel: Path) -> None:
    """End if the wheel does not install beside the oldest versions that it allows, or a command fails there."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        lines = oldest(wheel, SUPPORTED[0])
        (home / "oldest.txt").write_text("\n".join(lines), encoding="utf-8")
        (home / "plan.yaml").write_text(PLAN, encoding="utf-8")
        _check(python, home, ["--constraint", "oldest.txt", f"{wheel}[{','.join(EXTRAS)}]"], OLDEST)
    print(f"{python}: {len(lines)} oldest versions: {', '.join(command[0] for command in OLDEST)}", flush=True)


def oldest(wheel: Path, version: str) -> list[str]:
    """The constraints of pip that hold all that a wheel requires of a Python, with `EXTRAS`, at its lowest version."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = message_from_bytes(archive.read(name))
    found = [Requirement(text) for text in metadata.get_all("Requires-Dist", [])]
    extras = [{"extra": extra, "python_version": version} for extra in EXTRAS]
    return [
        f"{each.name}=={lowest.version}"
        for each in found
        if not each.marker or any(map(each.marker.evaluate, extras))
        for lowest in each.specifier
        if lowest.operator == ">="
    ]


def _check(python: Path, home: Path, wanted: list[str], commands: tuple[tuple[str, ...], ...]) -> None:
    """Make an environment in a folder, install into it, and run commands."""
    programs = home / "environment" / "bin"
    _done(_alone([python, "-m", "venv", home / "environment"], home))
    pip: list[str | Path] = [programs / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    _done(_alone([*pip, *wanted], home))
    for command in commands:
        _done(_alone([programs / "velatura", *command], home))


def found(version: str) -> Path | None:
    """The Python of a version, on the path or of pyenv."""
    for candidate in _candidates(version):
        test = [str(candidate), "-c", "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"]
        try:
            if subprocess.run(test, capture_output=True, text=True).stdout.strip() == version:
                return candidate
        except OSError:
            continue
    return None


def _candidates(version: str) -> Iterator[Path]:
    yield from sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))
    if on_path := shutil.which(f"python{version}"):
        yield Path(on_path)


def _alone(command: list[str | Path], home: Path) -> subprocess.CompletedProcess[str]:
    """Run a command that sees no programs, and of the caller's variables those alone that lead to the package index."""
    kept = {key: os.environ[key] for key in os.environ if re.match(r"PIP_|SSL_CERT|REQUESTS_CA", key)}
    kept |= {key: os.environ[key] for key in os.environ if key.lower().endswith("_proxy")}
    own = Path.home() / ".config" / "pip" / "pip.conf"
    kept |= {"PIP_CONFIG_FILE": str(own)} if own.is_file() else {}
    environment = {**kept, "HOME": str(home), "PATH": str(home / "environment" / "bin"), "LANG": "C.UTF-8"}
    return subprocess.run(command, cwd=home, env=environment, capture_output=True, text=True, timeout=SECONDS)


def _done(run: subprocess.CompletedProcess[str]) -> None:
    if run.returncode:
        command = " ".join(map(str, run.args))
        sys.exit(f"check_release: {command}: status {run.returncode}\n{run.stdout}{run.stderr}")


def _require(where: Path, wrong: list[str], verb: str) -> None:
    if wrong:
        sys.exit(f"check_release: {where.name} {verb} {', '.join(sorted(wrong)[:10])}")


if __name__ == "__main__":
    main()
