"""How a capture behaves, and what it reports."""

from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import Frame, StereoVolts


class CapturePhase(StrEnum):
    """What a capture is doing."""

    SURVEY = "survey"
    """Fixations that measure the scene's average distance."""
    RAIL = "rail"
    POINTS = "points"
    PAUSED = "paused"
    CLOSING = "closing"
    """Everything is taken; the last points are on their way to the disk."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """How patient a capture is. `tries`: of one exposure whose frames do not come, the first included."""

    tries: int = 3
    poll_ms: float = 50.0
    rail_ms: float = 60_000.0
    home_ms: float = 120_000.0
    rail_rest_ms: float = 1000.0
    """After a move of the rail, until the rig stands still."""
    rail_near_m: float = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureReport:
    """How far a capture is. `done` of `total` points are taken, `stored` are on the disk for good.

    `written_bytes`, `bytes_per_s`: of this run. `left_s`: None while nobody can say.
    """

    phase: CapturePhase
    done: int
    total: int
    stored: int = 0
    written_bytes: int = 0
    bytes_per_s: float = 0.0
    left_s: float | None = None
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPlan:
    """One exposure of both foveae. `exposure_ns`: None is as the cameras are set."""

    volts: StereoVolts
    bracket: int = 0
    stack: int = 0
    exposure_ns: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoveaPair:
    """What both foveae saw in one exposure."""

    left: Frame
    right: Frame
