"""Options that commands share (rig, scene, data, printing), and pairs of numbers such as `9x6`."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from foveacam_hardware.contract import InvalidInput
from foveacam_server.foundation.settings import Settings, checked_settings

SessionOption = Annotated[
    str | None, typer.Option("--session", help="session to work in; usually the newest of this rig")
]
LabelOption = Annotated[str | None, typer.Option(help="name for people")]
DataOption = Annotated[Path | None, typer.Option(help="folder for calibrations and all captured data")]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON object and nothing else")]

ClusterOption = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Dask scheduler whose workers compute it, tcp://HOST:8786"),
]


@dataclass(frozen=True, slots=True, kw_only=True)
class RigOptions:
    """The options of a command about rig and printing."""

    settings: Settings
    seed: int | None
    real_time: bool
    as_json: bool


_RIG_OPTIONS: dict[str, tuple[Any, object]] = {  # Any: an annotation
    "rig": (Annotated[str | None, typer.Option(help="'sim', or the path of a rig file (.toml)")], None),
    "scene": (
        Annotated[
            str | None,
            typer.Option(help="scene of the simulated rig; usually `bench`, to calibrate it `calibration`"),
        ],
        None,
    ),
    "preset": (
        Annotated[str | None, typer.Option(help="mirrors of the simulated rig: rig120 or paper")],
        None,
    ),
    "seed": (
        Annotated[int | None, typer.Option(help="another simulated specimen", min=0, max=9999)],
        None,
    ),
    "data": (DataOption, None),
    "real_time": (
        Annotated[
            bool,
            typer.Option("--real-time", help="run the simulated rig in real time"),
        ],
        False,
    ),
    "as_json": (JsonOption, False),
}


def on_rig(*, usual_scene: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Add the rig's options to a command, which gets them as its first argument, a `RigOptions`."""

    def with_options(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def called(**given: Any) -> None:  # noqa: ANN401 - whatever typer parsed
            rig = {name: given.pop(name) for name in _RIG_OPTIONS}
            chosen = {name: rig[name] for name in ("rig", "scene", "preset", "data")}
            if chosen["scene"] is None:
                chosen["scene"] = usual_scene
            rig_options = RigOptions(
                settings=checked_settings(chosen),
                seed=rig["seed"],
                real_time=rig["real_time"],
                as_json=rig["as_json"],
            )
            command(rig_options, **given)

        own = list(inspect.signature(command, eval_str=True).parameters.values())[1:]
        shared = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
            for name, (annotation, default) in _RIG_OPTIONS.items()
        ]
        called.__signature__ = inspect.Signature(own + shared)  # type: ignore[attr-defined]  # read by typer
        del called.__wrapped__  # otherwise typer reads the wrapped function's annotations
        called.__annotations__ = {parameter.name: parameter.annotation for parameter in own + shared}
        return called

    return with_options


def parse_pair(text: str | None, *, option: str, example: str) -> tuple[int, int] | None:
    """Return the two whole numbers of `9x6`; raise `InvalidInput` for anything else."""
    if text is None:
        return None
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.strip().isdecimal() for part in parts):
        raise InvalidInput(f"{option} {text}: two whole numbers are needed, such as {example}")
    return int(parts[0]), int(parts[1])
