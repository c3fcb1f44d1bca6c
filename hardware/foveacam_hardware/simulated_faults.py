"""What is broken on purpose in a simulated rig: as a rig file says it, and as it is changed while it runs."""

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


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class MountKnock(_Table):
    """How far an eye's mount was knocked out of place; signs are those of a drift check, degrees."""

    shift_x_deg: KnockDeg = 0.0
    """Where it looks, to the right."""
    shift_y_deg: KnockDeg = 0.0
    """Where it looks, downwards."""
    rotation_deg: KnockDeg = 0.0
    """About its line of sight, clockwise as it sees."""


class SimulatedFaults(_Table):
    """Everything works when all lists are empty and nothing is knocked."""

    unplugged: CameraNames = []
    """Cameras off the bus."""
    frozen: CameraNames = []
    """Cameras that go on counting frames but repeat the last picture."""
    no_trigger: EyeNames = []
    """Cameras whose trigger cable is off."""
    no_strobe: EyeNames = []
    """Cameras whose strobe cable is off; the exposure still happens."""
    dead_axes: MirrorAxes = []
    """Axes of the mirrors that stay where they are."""
    knocked_left: MountKnock = MountKnock()
    knocked_right: MountKnock = MountKnock()

    @property
    def words(self) -> list[str]:
        """What is broken, for people; empty when nothing is."""
        parts = [f"{name} camera unplugged" for name in self.unplugged]
        parts += [f"{name} camera frozen" for name in self.frozen]
        parts += [f"{name} trigger cable off" for name in self.no_trigger]
        parts += [f"{name} strobe cable off" for name in self.no_strobe]
        parts += [f"mirror axis {name} dead" for name in self.dead_axes]
        knocks = {"left": self.knocked_left, "right": self.knocked_right}
        return parts + [f"{name} mount knocked" for name, knock in knocks.items() if knock != MountKnock()]


class FaultInjector(Protocol):
    """What can be broken on purpose; callable from any thread, in force with the next exposure."""

    @property
    def in_force(self) -> SimulatedFaults:
        """The faults in force."""
        ...

    def set_faults(self, faults: SimulatedFaults) -> None:
        """Set exactly these faults, and clear all others."""
        ...
