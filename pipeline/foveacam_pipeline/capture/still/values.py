"""What a still is: how many frames of which cameras, what came of them, and what did not."""

from dataclasses import dataclass
from enum import StrEnum

from pydantic import JsonValue

from foveacam_hardware.contract import (
    DeviceFault,
    FoveaError,
    Frame,
    InvalidInput,
    NotConnected,
    OutOfRange,
    Role,
    Timeout,
)
from foveacam_pipeline.capture.dataset import PlanPosition, Shot

FORMAT = "foveacam-still"
VERSION = 1
MOST_FRAMES = 64
_KINDS = (InvalidInput, NotConnected, Timeout, DeviceFault)
"""What the error of a still may be, by what ailed its first camera."""
EVERY_ROLE = (Role.WIDE, Role.LEFT, Role.RIGHT)


class StillKeep(StrEnum):
    """What is kept of a stack."""

    MEAN = "mean"
    """Its mean in 16 bits; one frame alone as the camera gave it."""
    ALL = "all"
    """Every frame as the camera gave it; a reader makes the mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StillPlan:
    """What one press takes: `frames` of each camera of `roles`."""

    frames: int = 5
    keep: StillKeep = StillKeep.MEAN
    roles: tuple[Role, ...] = EVERY_ROLE

    def __post_init__(self) -> None:
        """Raise OutOfRange or InvalidInput for what no press can take."""
        if not 1 <= self.frames <= MOST_FRAMES:
            raise OutOfRange(
                f"still: {self.frames} frames were asked, a stack has 1 to {MOST_FRAMES}; choose one of these"
            )
        if not self.roles or len(set(self.roles)) != len(self.roles):
            named = ", ".join(self.roles) or "none"
            raise InvalidInput(f"still: cameras {named} were asked; name wide, left or right, each once")

    @property
    def foveae(self) -> tuple[Role, ...]:
        """The cameras that wait for a pulse."""
        return tuple(role for role in self.roles if role is not Role.WIDE)

    def document(self) -> dict[str, JsonValue]:
        """Return the plan as its dataset tells it."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "frames": self.frames,
            "keep": self.keep.value,
            "roles": [role.value for role in self.roles],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class StillFrame:
    """One frame of a stack, whether it is kept by itself or in a mean."""

    role: Role
    seq: int
    epoch: int
    t_ns: int
    exposure_ns: int
    gain_db: float
    volts_v: tuple[float, float] | None

    @classmethod
    def of(cls, frame: Frame, *, gain_db: float) -> "StillFrame":
        """Return what there is to say of a frame."""
        volts = None if frame.volts is None else (frame.volts.x_v, frame.volts.y_v)
        return cls(
            role=frame.role,
            seq=frame.seq,
            epoch=frame.epoch,
            t_ns=frame.t_ns,
            exposure_ns=frame.exposure_ns,
            gain_db=gain_db,
            volts_v=volts,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissingFrames:
    """A camera of which fewer frames came than were asked for, and why."""

    role: Role
    came: int
    asked: int
    reason: FoveaError

    @property
    def remedy(self) -> str:
        """What to do about it."""
        return self.reason.remedy or str(self.reason).rpartition("; ")[2]

    def sentence(self) -> str:
        """Name the camera, how many of its frames came, and why no more did."""
        return f"camera {self.role.value}: {self.came} of {self.asked} frames came ({self.reason})"

    def document(self) -> dict[str, JsonValue]:
        """Return it as the dataset tells it."""
        return {
            "role": self.role.value,
            "came": self.came,
            "asked": self.asked,
            "detail": str(self.reason),
            "remedy": self.remedy,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Still:
    """What one press brought: at least one frame. `rig`, `conditions`: as a dataset tells them."""

    plan: StillPlan
    shots: tuple[Shot, ...]
    exposures: tuple[StillFrame, ...]
    missing: tuple[MissingFrames, ...]
    place: PlanPosition
    rig: dict[str, JsonValue]
    conditions: dict[str, JsonValue]

    def trouble(self, *, kept: str) -> FoveaError | None:
        """Return the error of a still that is not whole; `kept`: what became of the rest, in words."""
        return trouble_of(self.missing, more=kept) if self.missing else None


def trouble_of(missing: tuple[MissingFrames, ...], *, more: str) -> FoveaError:
    """Return one error for every camera that did not give what was asked, of the first one's kind."""
    first = missing[0].reason
    kind = next((kind for kind in _KINDS if isinstance(first, kind)), DeviceFault)
    told = "; ".join(each.sentence() for each in missing)
    remedy = "; ".join(dict.fromkeys(each.remedy for each in missing))
    return kind(
        f"still: {told}; {more}",
        asked=", ".join(f"{each.asked} frames of camera {each.role.value}" for each in missing),
        found=", ".join(f"{each.came} of camera {each.role.value}" for each in missing),
        remedy=remedy,
    )
