"""The value types of a still: its plan, frames and missing frames, and its need of memory and disk."""

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
from foveacam_pipeline.capture.plan import ImageSize
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_space_error

FORMAT = "foveacam-still"
VERSION = 1
MOST_FRAMES = 64
MOST_BYTES = 1 << 30
"""Limit of the frames, which are held in memory until they are written."""
_ERROR_KINDS = (InvalidInput, NotConnected, Timeout, DeviceFault)
"""Kinds of a still's error, by the error of its first failed camera."""
EVERY_ROLE = (Role.WIDE, Role.LEFT, Role.RIGHT)


class StillKeep(StrEnum):
    """The frames that are stored of a stack."""

    MEAN = "mean"
    """Its mean in 16 bits; a single frame as the camera delivered it."""
    ALL = "all"
    """Every frame as the camera delivered it; a reader computes the mean."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StillPlan:
    """The plan of a still: `frames` of each camera of `roles`."""

    frames: int = 5
    keep: StillKeep = StillKeep.MEAN
    roles: tuple[Role, ...] = EVERY_ROLE

    def __post_init__(self) -> None:
        """Raise OutOfRange or InvalidInput for a plan that cannot be taken."""
        if not 1 <= self.frames <= MOST_FRAMES:
            raise OutOfRange(
                f"still: {self.frames} frames were asked, a stack has 1 to {MOST_FRAMES}; choose one of these"
            )
        if not self.roles or len(set(self.roles)) != len(self.roles):
            named = ", ".join(self.roles) or "none"
            raise InvalidInput(f"still: cameras {named} were asked; name wide, left or right, each once")

    @property
    def foveae(self) -> tuple[Role, ...]:
        """The triggered cameras."""
        return tuple(role for role in self.roles if role is not Role.WIDE)

    def document(self) -> dict[str, JsonValue]:
        """Return the plan as JSON for its dataset."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "frames": self.frames,
            "keep": self.keep.value,
            "roles": [role.value for role in self.roles],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class StillFrame:
    """The metadata of one frame of a stack, stored by itself or in a mean."""

    role: Role
    seq: int
    epoch: int
    t_ns: int
    exposure_ns: int
    gain_db: float
    volts_v: tuple[float, float] | None

    @classmethod
    def of(cls, frame: Frame, *, gain_db: float) -> "StillFrame":
        """Return the metadata of a frame."""
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
    """A camera that delivered fewer frames than requested, and why."""

    role: Role
    came: int
    asked: int
    reason: FoveaError

    @property
    def remedy(self) -> str:
        """What to do about it."""
        return self.reason.parts[1]

    def sentence(self) -> str:
        """Return a sentence with the camera, the number of its frames, and the reason."""
        return f"camera {self.role.value}: {self.came} of {self.asked} frames came ({self.reason.parts[0]})"

    def document(self) -> dict[str, JsonValue]:
        """Return the description as JSON for the dataset."""
        return {
            "role": self.role.value,
            "came": self.came,
            "asked": self.asked,
            "detail": str(self.reason),
            "remedy": self.remedy,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Still:
    """A captured still of at least one frame. `rig`, `conditions`: JSON as in a dataset."""

    plan: StillPlan
    shots: tuple[Shot, ...]
    exposures: tuple[StillFrame, ...]
    missing: tuple[MissingFrames, ...]
    place: PlanPosition
    rig: dict[str, JsonValue]
    conditions: dict[str, JsonValue]

    def missing_error(self, *, kept: str) -> FoveaError | None:
        """Return the error of an incomplete still; `kept`: a sentence on what happened to its frames."""
        return missing_frames_error(self.missing, more=kept) if self.missing else None


def missing_frames_error(missing: tuple[MissingFrames, ...], *, more: str) -> FoveaError:
    """Return one error for all cameras with missing frames, of the kind of the first one's error."""
    first = missing[0].reason
    kind = next((kind for kind in _ERROR_KINDS if isinstance(first, kind)), DeviceFault)
    sentences = "; ".join(each.sentence() for each in missing)
    return kind(
        f"still: {sentences}; {more}",
        asked=", ".join(f"{each.asked} frames of camera {each.role.value}" for each in missing),
        found=", ".join(f"{each.came} of camera {each.role.value}" for each in missing),
        remedy="; ".join(dict.fromkeys(each.remedy for each in missing if each.remedy)),
    )


def still_bytes(plan: StillPlan, *, fovea: ImageSize, wide: ImageSize) -> int:
    """Return the size of the images of a still without compression, bytes: an upper bound."""
    mean = plan.keep is StillKeep.MEAN and plan.frames > 1
    count = 1 if mean else plan.frames
    return sum(count * (wide if role is Role.WIDE else fovea).raw_bytes(mean=mean) for role in plan.roles)


def check_still_room(needed_bytes: int, *, free_bytes: int) -> None:
    """Raise OutOfRange, or StorageFull for a full disk, with both sizes when a still does not fit."""
    if needed_bytes > MOST_BYTES:
        raise OutOfRange(
            f"still: its frames take {needed_bytes / 1e9:.2f} GB, at most {MOST_BYTES / 1e9:.2f} GB are held"
            " in memory; keep the mean of each stack, or take fewer frames",
            asked=f"{needed_bytes} bytes",
            found=f"{MOST_BYTES} bytes at most",
        )
    wanted_bytes = needed_bytes + RESERVE_BYTES
    if wanted_bytes > free_bytes:
        raise free_space_error(
            f"still: it needs up to {wanted_bytes / 1e6:.0f} MB, with the {RESERVE_TEXT}; "
            f"{free_bytes / 1e6:.0f} MB are free on the disk",
            needed_bytes=wanted_bytes,
            free_bytes=free_bytes,
            remedy="free some, or keep the mean of fewer frames",
        )
