"""What a sweep measured: at every pose the markers in all three views, and the volts.

Nothing is fitted here: corners are raw pixels, so that any model can be fitted to them later. The file is
`sweep_file`'s.
"""

import re
from dataclasses import dataclass

from foveacam_hardware.contract import PanTiltPose, Role, Station
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepHeader:
    """Of what, where and with what a sweep was made.

    `*_serial`: of the cameras, "" when unknown. `*_size`: (width, height), px. `max_v`: the volts that the
    mirrors were allowed.
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
    were at their limit instead, the marker whole in view. `looks`: how many exposures it took.
    """

    volts_v: tuple[float, float]
    corners: MarkerView
    centred: bool
    rim: bool
    looks: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SweepPose:
    """One pose of the base. An eye without a result has a reason for it.

    `node_rad`: the gaze (ax, ay) that was planned. `wide`: by id, means over several frames. `repeat`: 0 for
    the pose of the plan itself, else which of the later or earlier visits to its node this is. `run`: the run
    of the procedure in which it was measured; times are comparable within one run alone.
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

    def eye(self, role: Role) -> EyePose | None:
        """Return what an eye measured."""
        return {Role.LEFT: self.left, Role.RIGHT: self.right}[role]

    def refusal(self, role: Role) -> str | None:
        """Return why an eye's measurement was refused."""
        return {Role.LEFT: self.left_refusal, Role.RIGHT: self.right_refusal}[role]

    @property
    def eyes_measured(self) -> int:
        """How many eyes have a result, 0 to 2."""
        return (self.left is not None) + (self.right is not None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sweep:
    """The poses measured so far at one station, by index.

    `repeats`: nodes visited again, in the order of measuring: how the mounts drifted shows in them.
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
