"""The settings of a capture, its progress reports, and its exposures."""

from dataclasses import dataclass
from enum import StrEnum

from foveacam_hardware.contract import Frame, StereoVolts


class CapturePhase(StrEnum):
    """The phase of a capture."""

    SURVEY = "survey"
    """Fixations that measure the scene's average distance."""
    RAIL = "rail"
    POINTS = "points"
    PAUSED = "paused"
    CLOSING = "closing"
    """Every point is captured; the last ones are being written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """Timeouts and retries of a capture. `tries`: attempts at one exposure whose frames do not arrive."""

    tries: int = 3
    poll_ms: float = 50.0
    rail_ms: float = 60_000.0
    home_ms: float = 120_000.0
    rail_rest_ms: float = 1000.0
    """Time after a move of the rail until the rig is at rest."""
    rail_near_m: float = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureReport:
    """The progress of a capture. `done` of `total` points are captured, `stored` are durably on disk.

    `written_bytes`, `bytes_per_s`: of this run. `left_s`: None while unknown.
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
    """One exposure of both foveae. `exposure_ns`: None for the cameras' present setting."""

    volts: StereoVolts
    bracket: int = 0
    stack: int = 0
    exposure_ns: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoveaPair:
    """The frames of both foveae from one exposure."""

    left: Frame
    right: Frame
