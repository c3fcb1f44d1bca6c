"""Schema and loader of a rig's TOML file; anything else is refused with file, key, value and remedy."""

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
from foveacam_hardware.config_errors import ConfigFault, KeysConflict, explain_file, list_faults
from foveacam_hardware.contract import Binning, InvalidInput, MarkerPrint
from foveacam_hardware.pan_tilt_config import GrblPanTiltConfig, OperatorConfig, PanTiltConfig
from foveacam_hardware.rail_config import GrblRailConfig, RailConfig
from foveacam_hardware.simulated_assembly import SimulatedAssembly
from foveacam_hardware.simulated_faults import MirrorDisturbance, SimulatedFaults

FORMAT: Literal["foveacam-rig"] = "foveacam-rig"
VERSION: Literal[1] = 1
MarkerId: TypeAlias = Annotated[int, Field(ge=0, le=49)]


RIG_ID = re.compile("[a-z0-9][a-z0-9-]{0,39}")
BAD_RIG_ID = "choose small letters, digits and hyphens, 40 at most, a letter or a digit first"


def _checked_id(rig_id: str) -> str:
    if not RIG_ID.fullmatch(rig_id):
        raise ValueError(BAD_RIG_ID)
    return rig_id


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class AccessConfig(_Table):
    """Permissions on this rig beyond those of a user's role."""

    viewers_may_stop: bool = False
    """Whether users with read-only access may stop the mirrors."""


class SimulatedRigConfig(_Table):
    """A simulated rig."""

    format: Literal["foveacam-rig"] = FORMAT
    version: Literal[1] = VERSION
    kind: Literal["simulated"] = "simulated"
    name: str = "Simulated FoveaCam Duo"
    scene: str = "bench"
    """Name of a shipped scene, or path of a scene file relative to this file."""
    preset: str = "rig120"
    seed: Annotated[int, Field(ge=0, lt=10_000)] = 0
    """Seed of the assembly errors and the noise."""
    strict: bool = False
    """Whether the simulated controller reproduces the known faults of real ones."""
    pan_tilt: Literal["motors", "manual"] = "motors"
    """What turns the rig for calibration: motors, or a simulated person by hand."""
    operator: OperatorConfig = OperatorConfig()
    """The simulated person of a manual pan-tilt."""
    working_binning: Binning = 2
    """Binning of all three cameras for looks, following and live views; 1 or 2."""
    access: AccessConfig = AccessConfig()
    faults: SimulatedFaults = SimulatedFaults()
    """Faults present from the start."""
    mirror_disturbance: MirrorDisturbance = MirrorDisturbance()
    """Scatter and hysteresis of the mirrors' rest angles."""
    assembly: SimulatedAssembly = SimulatedAssembly()
    """Mistakes in its assembly, which an acceptance run must find."""


class SerialMirrorsConfig(_Table):
    """The mirror controller on a serial port."""

    port: str
    """`auto`: the only connected controller; `usb:SERIAL`: the one with that serial number; or a path."""
    low_pass_hz: Annotated[int, Field(ge=1, le=1000)] = 120
    settle_us: Annotated[int, Field(ge=0, le=1_000_000)] = 14_000
    pulse_us: Annotated[int, Field(ge=1, le=1_000_000)] = 4_000
    max_v: Annotated[float, Field(gt=0.0, le=180.0)] = 170.0
    bias_v: Annotated[float, Field(gt=0.0, le=100.0)] = 90.0
    crc: Literal["prefer", "require", "forbid"] = "prefer"
    """Whether packets carry a CRC, which only our own firmware offers."""

    @field_validator("port")
    @classmethod
    def _names_a_port(cls, port: str) -> str:
        if port == "auto" or port.startswith("/") or port.removeprefix("usb:") not in ("", port):
            return port
        raise ValueError('no port; write "auto", "usb:SERIAL" or a path such as "/dev/ttyACM0"')


class MarkersConfig(_Table):
    """The three calibration markers of the mirrors, one per camera, in one plane on a horizontal line."""

    side_mm: Annotated[float, Field(gt=0.0, le=1000.0)] = 60.0
    """Side of the black square."""
    spacing_mm: Annotated[float, Field(gt=0.0, le=2000.0)] = 100.0
    """Distance from the centre of the wide camera's marker to the centre of each fovea's."""
    wide_id: MarkerId = 0
    left_id: MarkerId = 1
    right_id: MarkerId = 2
    """Ids are of the dictionary 4X4_50."""

    @model_validator(mode="after")
    def _make_sense(self) -> "MarkersConfig":
        if self.spacing_mm <= self.side_mm:
            raise KeysConflict(
                f"markers of {self.side_mm:g} mm cannot stand {self.spacing_mm:g} mm apart; measure both on"
                " the printed target",
                keys=("spacing_mm",),
            )
        ids = (self.wide_id, self.left_id, self.right_id)
        if len(set(ids)) != len(ids):
            raise KeysConflict(
                f"the ids {ids} are not three different ones; give each camera a marker of its own",
                keys=("wide_id", "left_id", "right_id"),
            )
        return self

    @property
    def printed(self) -> MarkerPrint:
        """The markers as the contract's value type, m."""
        return MarkerPrint(
            side_m=1e-3 * self.side_mm,
            spacing_m=1e-3 * self.spacing_mm,
            wide_id=self.wide_id,
            left_id=self.left_id,
            right_id=self.right_id,
        )


class SerialRigConfig(_Table):
    """A hardware rig whose mirror controller is on a serial port."""

    format: Literal["foveacam-rig"] = FORMAT
    version: Literal[1] = VERSION
    """A file without `format` and `version` counts as version 1, the first."""
    kind: Literal["serial"]
    rig_id: Annotated[str, AfterValidator(_checked_id)]
    """Identifies the rig in calibrations: a lower-case letter or digit, then such or hyphens, 40 at most."""
    name: str = "FoveaCam Duo"
    baseline_m: Annotated[float, Field(gt=0.0, le=2.0)] = 0.2
    mirrors: SerialMirrorsConfig
    cameras: CamerasConfig = CamerasConfig()
    markers: MarkersConfig = MarkersConfig()
    pan_tilt: PanTiltConfig | None = None
    """Turns the rig for calibration; not needed to use a calibrated rig."""
    rail: RailConfig | None = None
    """Moves the rig sideways between captures; optional."""
    working_binning: Binning = 1
    """Binning of all three cameras for looks, following and live views; 1 or 2."""
    access: AccessConfig = AccessConfig()

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
    """Read a rig file; raise `InvalidInput` for one that cannot be read or is not valid."""
    file = Path(path)
    return parse_rig_config(read_rig_content(file), file=file)


def read_rig_content(file: Path) -> dict[str, Any]:  # Any: the file is not validated yet
    """Return what is in a rig file; raise `InvalidInput` for one that cannot be read or is no TOML."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InvalidInput(f"rig file {file}: no such file; give the path of a .toml rig file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidInput(f"rig file {file}: not valid TOML ({error}); {_toml_remedy(error)}") from error
    except OSError as error:
        raise InvalidInput(f"rig file {file}: cannot be read ({error.strerror})") from error


def parse_rig_config(content: dict[str, Any], *, file: Path) -> SimulatedRigConfig | SerialRigConfig:
    """Return the rig that a file's content describes; raise `InvalidInput` for one that is not valid."""
    if (why := _wrong_header(content)) is not None:
        raise InvalidInput(f"rig file {file}: {why}")
    try:
        config = _ANY_RIG.validate_python(content)
    except ValidationError as error:
        raise InvalidInput(f"rig file {file}: {explain_file(error, content)}") from error
    return _resolve_paths(config, file.parent)


def rig_faults(content: dict[str, Any]) -> tuple[ConfigFault, ...]:  # Any: not validated yet
    """Return what is wrong with each key of a rig file's content; nothing when the file can be used."""
    if (why := _wrong_header(content)) is not None:
        return (ConfigFault(key="version", message=why),)
    try:
        _ANY_RIG.validate_python(content)
    except ValidationError as error:
        return list_faults(error, content)
    return ()


def _toml_remedy(error: Exception) -> str:
    if "twice" in str(error) or "overwrite" in str(error):
        return "a table or a key stands there twice: a role is one camera, a device one table; take one out"
    return "correct that line"


def _wrong_header(content: dict[str, Any]) -> str | None:  # Any: the file is not validated yet
    """Return why a file's format or version is not supported; None when it is."""
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


def _resolve_paths(
    config: SimulatedRigConfig | SerialRigConfig, folder: Path
) -> SimulatedRigConfig | SerialRigConfig:
    """Return the configuration with its relative paths resolved against the rig file's folder."""
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
