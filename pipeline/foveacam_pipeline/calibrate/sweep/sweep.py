"""Measurements of a sweep: the markers in all three views and the volts at every pose.

Corners are raw pixels, so that any model can be fitted to them later. `sweep_file` reads and writes the file.
"""

import re
from dataclasses import dataclass

from foveacam_hardware.contract import Binning, PanTiltPose, Role, Station
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepHeader:
    """Rig, station and settings of a sweep.

    `*_serial`: of the cameras, "" when unknown. `*_size`: (width, height), px. `max_v`: limit of the mirrors'
    volts.
    """

    rig_id: str
    created_utc: str
    station: Station
    layout: MarkerLayout
    plan: SweepPlan
    wide_size: tuple[int, int]
    fovea_size: tuple[int, int]
    max_v: float
    wide_serial: str = ""
    left_serial: str = ""
    right_serial: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EyePose:
    """One eye at one pose: its own marker in its raw image.

    `volts_v`: (x, y) in force during the exposure. `centred`: the end condition was met. `rim`: the volts
    were at their limit instead, the marker whole in view. `looks`: number of exposures.
    """

    volts_v: tuple[float, float]
    corners: MarkerView
    centred: bool
    rim: bool
    looks: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SweepPose:
    """One pose of the base. An eye without a result has a reason for it.

    `node_rad`: the planned gaze (ax, ay). `wide`: by id, means over several frames. `repeat`: 0 for the
    planned measurement of a node, else the number of a further visit. `run`: the run of the procedure in
    which it was measured; times are comparable within one run alone. `binning`: of the frames that it was
    measured in; its pixels are those of the sensor.
    """

    index: int
    node_rad: tuple[float, float]
    pan_tilt: PanTiltPose | None
    t_ns: int
    wide: dict[int, MarkerView]
    left: EyePose | None
    right: EyePose | None
    left_refusal: str | None = None
    right_refusal: str | None = None
    repeat: int = 0
    run: str = ""
    binning: Binning = 1

    def eye(self, role: Role) -> EyePose | None:
        """Return the measurement of an eye."""
        return {Role.LEFT: self.left, Role.RIGHT: self.right}[role]

    def refusal(self, role: Role) -> str | None:
        """Return why an eye's measurement was refused."""
        return {Role.LEFT: self.left_refusal, Role.RIGHT: self.right_refusal}[role]

    @property
    def eyes_measured(self) -> int:
        """Number of eyes with a result, 0 to 2."""
        return (self.left is not None) + (self.right is not None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweep:
    """The poses measured so far at one station, by index.

    `repeats`: further visits to nodes, in the order of measuring, which show the drift of the mounts.
    """

    header: SweepHeader
    poses: tuple[SweepPose, ...] = ()
    repeats: tuple[SweepPose, ...] = ()

    def accepted(self, role: Role) -> tuple[SweepPose, ...]:
        """Return the poses at which an eye was measured."""
        return tuple(pose for pose in self.poses if pose.eye(role) is not None)

    def next_repeat(self, index: int) -> int:
        """Return the number of the next visit to a node."""
        return 1 + max((pose.repeat for pose in self.repeats if pose.index == index), default=0)

    @property
    def missing(self) -> tuple[int, ...]:
        """The indices of the plan that were not measured yet."""
        done = {pose.index for pose in self.poses}
        return tuple(i for i in range(self.header.plan.columns * self.header.plan.rows) if i not in done)

    @property
    def complete(self) -> bool:
        """Whether every pose of the plan was visited."""
        return not self.missing


def sweep_filename(station: Station) -> str:
    """Return the name of a station's sweep in the folder of its session."""
    slug = re.sub(r"[^a-z0-9]+", "-", station.name.lower()).strip("-") or "station"
    return f"sweep-{slug}.jsonl"
