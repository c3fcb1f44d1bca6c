"""What a rig's TOML file may say; what it may not is refused by file, key, value and remedy."""

import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

from foveacam_hardware.camera_config import ROLES, CamerasConfig, OpenCvCameraConfig
from foveacam_hardware.config_errors import explain_file
from foveacam_hardware.contract import InvalidInput, MarkerPrint
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig, OperatorConfig, PanTiltConfig
from foveacam_hardware.rail_config import GrblRailConfig, RailConfig
from foveacam_hardware.simulated_faults import SimulatedFaults

FORMAT: Literal["foveacam-rig"] = "foveacam-rig"
VERSION: Literal[1] = 1
MarkerId: TypeAlias = Annotated[int, Field(ge=0, le=49)]


def _checked_id(rig_id: str) -> str:
    if not re.fullmatch("[a-z0-9][a-z0-9-]{0,39}", rig_id):
        raise ValueError("choose small letters, digits and hyphens, 40 at most, a letter or a digit first")
    return rig_id


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class SimulatedRigConfig(_Table):
    """A rig that exists in this program alone."""

    format: Literal["foveacam-rig"] = FORMAT
    version: Literal[1] = VERSION
    kind: Literal["simulated"] = "simulated"
    name: str = "Simulated FoveaCam Duo"
    scene: str = "bench"
    """A scene that ships with the product, or the path of a scene file (relative to this file)."""
    preset: str = "rig120"
    seed: Annotated[int, Field(ge=0, lt=10_000)] = 0
    """Another seed is another specimen: other assembly errors, other noise."""
    strict: bool = False
    """The controller errs as those in the field do."""
    pan_tilt: Literal["motors", "manual"] = "motors"
    """What turns the rig while it is calibrated: its motors, or somebody by hand, who is simulated too."""
    operator: OperatorConfig = OperatorConfig()
    """Who turns it by hand."""
    faults: SimulatedFaults = SimulatedFaults()
    """What is broken in it from the start."""


class SerialMirrorsConfig(_Table):
    """The mirror controller on a serial port."""

    port: str
    """`auto`: the only controller plugged in; `usb:SERIAL`: the one with that serial number; or a path."""
    low_pass_hz: Annotated[int, Field(ge=1, le=1000)] = 120
    settle_us: Annotated[int, Field(ge=0, le=1_000_000)] = 14_000
    pulse_us: Annotated[int, Field(ge=1, le=1_000_000)] = 4_000
    max_v: Annotated[float, Field(gt=0.0, le=180.0)] = 170.0
    bias_v: Annotated[float, Field(gt=0.0, le=100.0)] = 90.0
    crc: Literal["prefer", "require", "forbid"] = "prefer"
    """Whether packets carry a CRC, which our own firmware offers and others do not."""

    @field_validator("port")
    @classmethod
    def _names_a_port(cls, port: str) -> str:
        if port == "auto" or port.startswith("/") or port.removeprefix("usb:") not in ("", port):
            return port
        raise ValueError('no port; write "auto", "usb:SERIAL" or a path such as "/dev/ttyACM0"')


class MarkersConfig(_Table):
    """The three markers that the mirrors are calibrated with, one for each camera, in one plane on a line."""

    side_mm: Annotated[float, Field(gt=0.0, le=1000.0)] = 60.0
    """Of the black square."""
    spacing_mm: Annotated[float, Field(gt=0.0, le=2000.0)] = 100.0
    """From the middle of the wide camera's marker to that of each eye's."""
    wide_id: MarkerId = 0
    left_id: MarkerId = 1
    right_id: MarkerId = 2
    """Of the dictionary 4X4_50."""

    @model_validator(mode="after")
    def _make_sense(self) -> "MarkersConfig":
        if self.spacing_mm <= self.side_mm:
            raise ValueError(
                f"markers of {self.side_mm:g} mm cannot stand {self.spacing_mm:g} mm apart; measure both on"
                " the printed target"
            )
        ids = (self.wide_id, self.left_id, self.right_id)
        if len(set(ids)) != len(ids):
            raise ValueError(
                f"the ids {ids} are not three different ones; give each camera a marker of its own"
            )
        return self

    @property
    def printed(self) -> MarkerPrint:
        """What the calibration is told of them."""
        return MarkerPrint(
            side_m=1e-3 * self.side_mm,
            spacing_m=1e-3 * self.spacing_mm,
            wide_id=self.wide_id,
            left_id=self.left_id,
            right_id=self.right_id,
        )


class SerialRigConfig(_Table):
    """A rig of metal and glass."""

    format: Literal["foveacam-rig"] = FORMAT
    version: Literal[1] = VERSION
    """A file without them is of version 1: there was none before."""
    kind: Literal["serial"]
    rig_id: Annotated[str, AfterValidator(_checked_id)]
    """Calibrations carry it: a letter or digit, then letters, digits and hyphens, all small."""
    name: str = "FoveaCam Duo"
    baseline_m: Annotated[float, Field(gt=0.0, le=2.0)] = 0.2
    mirrors: SerialMirrorsConfig
    cameras: CamerasConfig = CamerasConfig()
    markers: MarkersConfig = MarkersConfig()
    pan_tilt: PanTiltConfig | None = None
    """What turns the rig while it is calibrated; none needed to use it."""
    rail: RailConfig | None = None
    """What moves the rig sideways between captures; none needed."""

    @model_validator(mode="after")
    def _share_a_board(self) -> "SerialRigConfig":
        base, rail = self.pan_tilt, self.rail
        if not (isinstance(base, GrblPanTiltConfig) and isinstance(rail, GrblRailConfig)):
            return self
        if base.port == rail.port and base.has_switches != rail.has_switches:
            raise ValueError(
                "pan_tilt and rail share a board, and has_switches differs; a board homes all its axes"
                " or none: make both the same"
            )
        return self


RigConfig: TypeAlias = Annotated[SimulatedRigConfig | SerialRigConfig, Field(discriminator="kind")]
_ANY_RIG: TypeAdapter[SimulatedRigConfig | SerialRigConfig] = TypeAdapter(RigConfig)


def load_rig_config(path: str | Path) -> SimulatedRigConfig | SerialRigConfig:
    """Read and check a rig file."""
    file = Path(path)
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInput(f"rig file {file}: no such file; give the path of a .toml rig file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"rig file {file}: not valid TOML ({error}); {_toml_remedy(error)}") from error
    except OSError as error:
        raise InvalidInput(f"rig file {file}: cannot be read ({error.strerror})") from error
    if (why := _wrong_header(content)) is not None:
        raise InvalidInput(f"rig file {file}: {why}")
    try:
        config = _ANY_RIG.validate_python(content)
    except ValidationError as error:
        raise InvalidInput(f"rig file {file}: {explain_file(error, content)}") from error
    return _beside(config, file.parent)


def _toml_remedy(error: Exception) -> str:
    if "twice" in str(error) or "overwrite" in str(error):
        return "a table or a key stands there twice: a role is one camera, a device one table; take one out"
    return "correct that line"


def _wrong_header(content: dict[str, Any]) -> str | None:  # Any: nothing of the file is checked yet
    """Return why a file is not one of this version's, in words; None when it is."""
    found, version = content.get("format", FORMAT), content.get("version", VERSION)
    if found != FORMAT:
        return f"its format is {found!r}, not {FORMAT!r}; give the path of a rig file"
    if not isinstance(version, int) or isinstance(version, bool):
        return f"its version {version!r} is no whole number; write `version = {VERSION}`"
    if version > VERSION:
        return (
            f"it is of version {version}, and this program reads version {VERSION}: it was written for a"
            " newer one; update the program, or begin with one of the examples of this one"
        )
    if version < VERSION:
        return (
            f"it is of version {version}, older than the version {VERSION} that this program reads; compare"
            f" its keys with the examples, correct them, and write `version = {VERSION}`"
        )
    return None


def _beside(
    config: SimulatedRigConfig | SerialRigConfig, folder: Path
) -> SimulatedRigConfig | SerialRigConfig:
    """Return it with the files that it names found beside its own."""
    if isinstance(config, SimulatedRigConfig):
        if config.scene.endswith(".toml"):
            return config.model_copy(update={"scene": str(folder / config.scene)})
        return config
    found = {}
    for role in ROLES:
        camera = getattr(config.cameras, role)
        if isinstance(camera, OpenCvCameraConfig) and _is_relative(camera.source):
            found[role] = camera.model_copy(update={"source": str(folder / str(camera.source))})
    return config.model_copy(update={"cameras": config.cameras.model_copy(update=found)}) if found else config


def _is_relative(source: str | int) -> bool:
    return isinstance(source, str) and "://" not in source and not source.startswith("/")
