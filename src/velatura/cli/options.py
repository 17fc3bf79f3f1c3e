"""The arguments that verbs share: the material, the model, `--set`, and how they are read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from velatura.errors import InvalidInput

if TYPE_CHECKING:
    from rich.console import Console

    from velatura.stack import Described

Material = Annotated[
    str,
    typer.Argument(metavar="M", help="A material file (YAML, JSON; MaterialX, glTF), or the name of a preset."),
]

# By name, since the models themselves load NumPy (tests/unit/test_cli.py holds the two to each other).
MODELS = "belcour2018, yamaguchi2019, weier2020, bati2021, realtime, velatura"

Model = Annotated[str | None, typer.Option("--model", metavar="NAME", help=f"{MODELS}; default: velatura.")]
Bsdf = Annotated[
    str | None,
    typer.Option(
        "--model",
        metavar="NAME",
        help=f"{MODELS}; reference, the walk; exact, the walk by the model's samples; weidlich_wilkie, the baseline. "
        "Default: velatura.",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="A switch of the model (tir=off) or a parameter of the material (layer0_alpha=0.2); may be repeated.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def console() -> Console:
    """Where tables are printed: text as it is, since names and paths may hold what Rich takes for markup."""
    from rich.console import Console

    return Console(markup=False, emoji=False)


def read(material: str, settings: list[str] | None) -> tuple[Described, dict[str, Any]]:
    """The material that the user named, and the switches of the model, as `--set` changes them.

    Raises `InvalidInput` for a file that is no material, and for a setting that is neither a switch nor a parameter.
    """
    from velatura.model import SWITCHES
    from velatura.stack import load
    from velatura.stack.schema import unknown

    described: Described = load(material)
    others = [*SWITCHES, *(name for name in described.flat() if not _of_layer(name)), "thin", "layer0_...", "part0_..."]
    switches: dict[str, Any] = {}
    parameters: dict[str, Any] = {}
    for key, value in map(_pair, settings or ()):
        if key in SWITCHES:
            switches[key] = value
        elif _of_layer(key) or key in others:
            parameters[key] = _page(key, value) or _value(value)
        else:
            raise InvalidInput(f"--set {key}: {unknown('key', key, others)}")
    return described.replace(**parameters) if parameters else described, switches


def folder(text: str) -> Path:
    """The path of a folder; an empty one is refused, as it would mean the working directory."""
    if not text:
        raise typer.BadParameter("needs a name, got nothing")
    return Path(text)


def model_name(name: str | None) -> str:
    """The model that the user named, else the package's default."""
    from velatura.model import DEFAULT

    return DEFAULT if name is None else name


def cosines(text: str) -> list[float]:
    """The numbers of a list such as `1,0.5`; the model checks that they are cosines."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InvalidInput(f"--cos {text}: needs numbers above 0 and up to 1, separated by commas") from None


def _pair(setting: str) -> tuple[str, str]:
    key, _, value = setting.partition("=")
    if not (key and value):
        raise InvalidInput(f"--set {setting}: needs KEY=VALUE")
    return key, value


def _of_layer(key: str) -> bool:
    return key.startswith(("layer", "part"))


def _page(key: str, text: str) -> dict[str, str] | None:
    """The page of refractiveindex.info that an index is read from; None of other values."""
    from velatura.stack.substances import is_path

    is_page = key.endswith(("_eta", "_k")) and ("/" in text or is_path(text))
    return {"refractiveindex": text} if is_page else None


def _value(text: str) -> Any:
    """A value as in a file: a number, several (`.1,.2,.3`, in brackets or not), true, false, or a name."""
    bare = text[1:-1] if text.startswith("[") and text.endswith("]") else text
    try:
        numbers = tuple(float(part) for part in bare.split(","))
    except ValueError:
        return {"true": True, "false": False}.get(text, text)
    return numbers if len(numbers) > 1 else numbers[0]
