"""What a rig's TOML file may say; what it may not is refused by file, key, value and remedy."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.pan_tilt_config import PanTiltConfig


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class SimulatedRigConfig(_Table):
    """A rig that exists in this program alone."""

    kind: Literal["simulated"] = "simulated"
    name: str = "Simulated FoveaCam Duo"
    scene: str = "bench"
    """A scene that ships with the product, or the path of a scene file (relative to this file)."""
    preset: str = "rig120"
    seed: Annotated[int, Field(ge=0, lt=10_000)] = 0
    """Another seed is another specimen: other assembly errors, other noise."""
    strict: bool = False
    """The controller errs as those in the field do."""


class SerialMirrorsConfig(_Table):
    """The mirror controller on a serial port."""

    port: Annotated[str, Field(min_length=1)]
    low_pass_hz: Annotated[int, Field(ge=1, le=1000)] = 120
    settle_us: Annotated[int, Field(ge=0, le=1_000_000)] = 14_000
    pulse_us: Annotated[int, Field(ge=1, le=1_000_000)] = 4_000
    max_v: Annotated[float, Field(gt=0.0, le=180.0)] = 170.0
    bias_v: Annotated[float, Field(gt=0.0, le=100.0)] = 90.0


CAMERA_KINDS = ("absent",)
"""Kinds of camera that a rig of metal and glass may name in this version."""


class CameraConfig(_Table):
    """A camera by its driver's kind."""

    kind: str = "absent"

    @field_validator("kind")
    @classmethod
    def _have_a_driver(cls, kind: str) -> str:
        if kind not in CAMERA_KINDS:
            allowed = ", ".join(CAMERA_KINDS)
            raise ValueError(f"no camera driver of that kind in this version; allowed kinds: {allowed}")
        return kind


class CamerasConfig(_Table):
    """The three cameras."""

    wide: CameraConfig = CameraConfig()
    left: CameraConfig = CameraConfig()
    right: CameraConfig = CameraConfig()


class SerialRigConfig(_Table):
    """A rig of metal and glass."""

    kind: Literal["serial"]
    rig_id: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,39}$")]
    """Calibrations carry it: a letter or digit, then letters, digits and hyphens, all small."""
    name: str = "FoveaCam Duo"
    baseline_m: Annotated[float, Field(gt=0.0, le=2.0)] = 0.2
    mirrors: SerialMirrorsConfig
    cameras: CamerasConfig = CamerasConfig()
    pan_tilt: PanTiltConfig | None = None
    """What turns the rig while it is calibrated; none needed to use it."""


RigConfig: TypeAlias = Annotated[SimulatedRigConfig | SerialRigConfig, Field(discriminator="kind")]
_KINDS = ("simulated", "serial", "grbl", "manual")
"""What pydantic calls a table by; no keys of the file."""
_ANY_RIG: TypeAdapter[SimulatedRigConfig | SerialRigConfig] = TypeAdapter(RigConfig)


def load_rig_config(path: str | Path) -> SimulatedRigConfig | SerialRigConfig:
    """Read and check a rig file."""
    file = Path(path)
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInput(f"rig file {file}: no such file; give the path of a .toml rig file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"rig file {file}: not valid TOML ({error}); correct that line") from error
    except OSError as error:
        raise InvalidInput(f"rig file {file}: cannot be read ({error})") from error
    try:
        config = _ANY_RIG.validate_python(content)
    except ValidationError as error:
        raise InvalidInput(f"rig file {file}: {_explain(error)}") from error
    if isinstance(config, SimulatedRigConfig) and config.scene.endswith(".toml"):
        return config.model_copy(update={"scene": str(file.parent / config.scene)})
    return config


def _explain(error: ValidationError) -> str:
    """Say in one line each what is wrong where."""
    lines = []
    for detail in error.errors():
        key = ".".join(str(step) for step in detail["loc"] if step not in _KINDS)
        found = "" if isinstance(detail["input"], dict) else f" (found {detail['input']!r})"
        lines.append(f"{key + ': ' if key else ''}{detail['msg'].removeprefix('Value error, ')}{found}")
    return "; ".join(lines)
