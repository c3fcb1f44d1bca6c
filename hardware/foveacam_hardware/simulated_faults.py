"""Faults and disturbances of a simulated rig: their schema in a rig file, and the Protocol of faults."""

from typing import Annotated, Literal, Protocol, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

CameraName: TypeAlias = Literal["wide", "left", "right"]
EyeName: TypeAlias = Literal["left", "right"]
MirrorAxis: TypeAlias = Literal["left x", "left y", "right x", "right y"]
CameraNames: TypeAlias = Annotated[list[CameraName], Field(max_length=3)]
EyeNames: TypeAlias = Annotated[list[EyeName], Field(max_length=2)]
MirrorAxes: TypeAlias = Annotated[list[MirrorAxis], Field(max_length=4)]
CAMERA_NAMES: tuple[CameraName, ...] = ("wide", "left", "right")
EYE_NAMES: tuple[EyeName, ...] = ("left", "right")
MIRROR_AXES: tuple[MirrorAxis, ...] = ("left x", "left y", "right x", "right y")
KnockDeg: TypeAlias = Annotated[float, Field(ge=-5.0, le=5.0)]
DisturbanceDeg: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class MountKnock(_Table):
    """Displacement of a fovea's mount after a knock, degrees; signs as in a drift check."""

    shift_x_deg: KnockDeg = 0.0
    """Shift of the line of sight, positive to the right."""
    shift_y_deg: KnockDeg = 0.0
    """Shift of the line of sight, positive down."""
    rotation_deg: KnockDeg = 0.0
    """Rotation about the line of sight, positive clockwise in the image."""


class MirrorDisturbance(_Table):
    """Deviation of the mirrors' rest angles from their static law, as turns of the line of sight, degrees.

    Both axes of both mirrors have the same; zero by default, as of an ideal mirror.
    """

    scatter_rms_deg: DisturbanceDeg = 0.0
    """Standard deviation of the rest angle from move to move; constant while a mirror rests."""
    hysteresis_deg: DisturbanceDeg = 0.0
    """Half the difference between the rest angles after long moves from either side."""


class SimulatedFaults(_Table):
    """The faults in force; none when all lists are empty and both knocks are zero."""

    unplugged: CameraNames = []
    """Cameras that are disconnected from the bus."""
    frozen: CameraNames = []
    """Cameras that keep counting frames but repeat the last image."""
    no_trigger: EyeNames = []
    """Cameras whose trigger cable is disconnected."""
    no_strobe: EyeNames = []
    """Cameras whose strobe cable is disconnected; the exposure still happens."""
    dead_axes: MirrorAxes = []
    """Mirror axes that no longer move."""
    knocked_left: MountKnock = MountKnock()
    knocked_right: MountKnock = MountKnock()

    @property
    def words(self) -> list[str]:
        """A sentence for each fault, for the operator; empty when there is none."""
        parts = [f"{name} camera unplugged" for name in self.unplugged]
        parts += [f"{name} camera frozen" for name in self.frozen]
        parts += [f"{name} trigger cable off" for name in self.no_trigger]
        parts += [f"{name} strobe cable off" for name in self.no_strobe]
        parts += [f"mirror axis {name} dead" for name in self.dead_axes]
        knocks = {"left": self.knocked_left, "right": self.knocked_right}
        return parts + [f"{name} mount knocked" for name, knock in knocks.items() if knock != MountKnock()]


class FaultInjector(Protocol):
    """Sets the faults of a simulated rig; callable from any thread, in force with the next exposure."""

    @property
    def in_force(self) -> SimulatedFaults:
        """The faults in force."""
        ...

    def set_faults(self, faults: SimulatedFaults) -> None:
        """Set exactly these faults, and clear all others."""
        ...
