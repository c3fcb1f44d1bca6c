"""The least duration of a plan and the disk space that it needs, computed before the start.

The duration is a physical limit: mirrors settle while the last image is read out, then the cameras expose.
The program's own overhead is not included.
"""

import math
from dataclasses import dataclass

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.plan.plan_document import RasterPlan
from foveacam_pipeline.storage.free_space import RESERVE_BYTES, RESERVE_TEXT, free_space_error

READOUT_10BIT_MS = 4.38
"""IMX273: 1080 + 42 lines of 290 / 74.25 MHz; a frame is read out while the mirrors move on."""
READOUT_12BIT_MS = 5.98
MARGIN_MS = 0.5
"""Time between the end of an exposure and the next move, as in the trigger's time budget."""
REVERGE_MS = 100.0
"""Deduced: two steps of the vergence loop, each a look of 20 ms and 29 ms of one core."""
STORED_RATIO = {1: 0.6, 2: 0.7}
"""Size of PNG over raw, by bytes a sample; deduced: simulated and real images have 0.41 to 0.63 and 0.62 to
0.69."""
RECORD_BYTES = 2_000
"""Size of index and journal entries, for each image."""
DISK_REMEDY = "free some, choose another folder, or take fewer points"


@dataclass(frozen=True, slots=True, kw_only=True)
class CapturePace:
    """Durations of the steps of a capture on a rig.

    `exposure_ms`: the cameras' present setting, for plans without exposures of their own.
    `exposure_change_ms`: time until cameras use a changed exposure. `wide_period_ms`: least time of a point
    with its own wide frame; 0 when the wide camera is never waited for. `reverge_ms`: verging anew at one
    point. `rail_mm_s`: None for a rail pushed by hand, whose moves are counted, not timed. `rail_settle_s`:
    time until a moved rig is at rest.
    """

    settle_ms: float
    exposure_ms: float
    readout_ms: float = READOUT_10BIT_MS
    exposure_change_ms: float = 0.0
    wide_period_ms: float = 0.0
    reverge_ms: float = REVERGE_MS
    rail_mm_s: float | None = None
    rail_settle_s: float = 1.0

    def __post_init__(self) -> None:
        times = (
            self.settle_ms,
            self.readout_ms,
            self.exposure_change_ms,
            self.wide_period_ms,
            self.reverge_ms,
        )
        if not (
            all(0.0 <= time < math.inf for time in (*times, self.rail_settle_s))
            and 0.0 < self.exposure_ms < math.inf
            and (self.rail_mm_s is None or 0.0 < self.rail_mm_s < math.inf)
        ):
            raise InvalidInput(
                f"estimate: {self} cannot be; times must be 0 or more,"
                " the exposure and the rail's speed above 0"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageSize:
    """Size of one camera's images as delivered; more than 8 bits are stored in 16."""

    width: int
    height: int
    channels: int = 1
    bits: int = 8

    def raw_bytes(self, *, mean: bool = False) -> int:
        """Return the size of one image, bytes; a mean of several images is stored in 16 bits."""
        return self.width * self.height * self.channels * self.sample_bytes(mean=mean)

    def sample_bytes(self, *, mean: bool = False) -> int:
        """Return the size of one sample: 1 or 2 bytes."""
        return 2 if mean or self.bits > 8 else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class KindSize:
    """The images of one kind ("fovea", "wide"): number of files, their raw size, and their size on disk."""

    kind: str
    files: int
    raw_bytes: int
    stored_bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CaptureEstimate:
    """The remaining duration and size of a plan.

    `limit_s`: the least time that mirrors and sensors need. `reverge_s`, `rail_s`: in addition to it.
    `hand_moves`: moves of a rail without a motor, whose duration is unknown.
    """

    points: int
    shots: int
    limit_s: float
    reverge_s: float
    rail_s: float
    hand_moves: int
    kinds: tuple[KindSize, ...]

    @property
    def total_s(self) -> float:
        """Sum of all times."""
        return self.limit_s + self.reverge_s + self.rail_s

    @property
    def files(self) -> int:
        """Number of all images."""
        return sum(kind.files for kind in self.kinds)

    @property
    def raw_bytes(self) -> int:
        """Size of all images without compression."""
        return sum(kind.raw_bytes for kind in self.kinds)

    @property
    def stored_bytes(self) -> int:
        """Size of all images as stored, with their records."""
        return sum(kind.stored_bytes for kind in self.kinds) + RECORD_BYTES * self.files


def shot_limit_ms(*, settle_ms: float, readout_ms: float, exposure_ms: float) -> float:
    """Return the least time of one shot: settling overlaps the previous readout, then the shot is exposed."""
    return max(settle_ms, readout_ms) + exposure_ms + MARGIN_MS


def point_limit_ms(plan: RasterPlan, pace: CapturePace) -> float:
    """Return the least time of one point: only its first shot waits for the mirrors."""
    exposures_ms = plan.exposures_ms or (pace.exposure_ms,)
    total_ms, settle_ms = 0.0, pace.settle_ms
    for exposure_ms in exposures_ms:
        for _ in range(plan.stack_frames):
            total_ms += shot_limit_ms(
                settle_ms=settle_ms, readout_ms=pace.readout_ms, exposure_ms=exposure_ms
            )
            settle_ms = 0.0
    if len(exposures_ms) > 1:
        total_ms += len(exposures_ms) * pace.exposure_change_ms
    return max(total_ms, pace.wide_period_ms) if plan.wide == "point" else total_ms


def estimate_capture(
    plan: RasterPlan,
    pace: CapturePace,
    *,
    fovea: ImageSize,
    wide: ImageSize,
    done: int = 0,
    stored_ratio: float | None = None,
) -> CaptureEstimate:
    """Return the duration and size of the points from index `done` on; the plan need not be filled in.

    `stored_ratio`: size on disk over raw; None: as assumed for PNG; 1 for files that are not compressed.
    """
    total = plan.scans * plan.points_per_scan
    if not 0 <= done <= total:
        raise InvalidInput(f"estimate: {done} points are done, the plan has {total}; give 0 to {total}")
    left = total - done
    rail_s, hand_moves = _rail(plan, pace, done)
    return CaptureEstimate(
        points=left,
        shots=left * plan.exposures_per_point * plan.stack_frames,
        limit_s=1e-3 * left * point_limit_ms(plan, pace),
        reverge_s=1e-3 * left * pace.reverge_ms if plan.verging.each_point else 0.0,
        rail_s=rail_s,
        hand_moves=hand_moves,
        kinds=_kinds(plan, done, fovea=fovea, wide=wide, stored_ratio=stored_ratio),
    )


def assumed_ratio(image: ImageSize, *, mean: bool = False) -> float:
    """Return the assumed ratio of PNG to raw size."""
    return STORED_RATIO[image.sample_bytes(mean=mean)]


def check_disk(needed: CaptureEstimate, *, free_bytes: int, where: str = "the disk") -> None:
    """Raise OutOfRange, or StorageFull for a full disk, with both sizes when the capture does not fit."""
    needed_bytes = needed.stored_bytes + RESERVE_BYTES
    if needed_bytes > free_bytes:
        raise free_space_error(
            f"capture: {needed.files} images need about {_size(needed_bytes)}, with the {RESERVE_TEXT}; "
            f"{_size(free_bytes)} are free on {where}",
            needed_bytes=needed_bytes,
            free_bytes=free_bytes,
            remedy=DISK_REMEDY,
        )


def _rail(plan: RasterPlan, pace: CapturePace, done: int) -> tuple[float, int]:
    """Return the time of the remaining moves, s, and the number of moves made by hand.

    The first move starts at the rail's middle when nothing is done; an unfinished scan's position is reached.
    """
    places_mm = plan.rail_positions_mm
    if not places_mm or done == plan.scans * plan.points_per_scan:
        return 0.0, 0
    scan = done // plan.points_per_scan
    stands_mm = 0.0 if done == 0 else places_mm[(done - 1) // plan.points_per_scan]
    ways_mm = []
    for place_mm in places_mm[scan:]:
        ways_mm.append(abs(place_mm - stands_mm))
        stands_mm = place_mm
    moves = [way_mm for way_mm in ways_mm if way_mm > 0.0]
    if pace.rail_mm_s is None:
        return 0.0, len(moves)
    return sum(moves) / pace.rail_mm_s + len(moves) * pace.rail_settle_s, 0


def _kinds(
    plan: RasterPlan, done: int, *, fovea: ImageSize, wide: ImageSize, stored_ratio: float | None
) -> tuple[KindSize, ...]:
    left = plan.scans * plan.points_per_scan - done
    mean = plan.stack_frames > 1 and plan.stack_keep == "mean"
    each = plan.exposures_per_point * (1 if mean else plan.stack_frames)
    scans_begun = -(-done // plan.points_per_scan)
    wides = {"point": left, "scan": plan.scans - scans_begun, "none": 0}[plan.wide]
    return (
        _kind("fovea", 2 * left * each, fovea, mean=mean, stored_ratio=stored_ratio),
        _kind("wide", wides, wide, mean=False, stored_ratio=stored_ratio),
    )


def _kind(kind: str, files: int, image: ImageSize, *, mean: bool, stored_ratio: float | None) -> KindSize:
    raw_bytes = files * image.raw_bytes(mean=mean)
    ratio = assumed_ratio(image, mean=mean) if stored_ratio is None else stored_ratio
    return KindSize(kind=kind, files=files, raw_bytes=raw_bytes, stored_bytes=math.ceil(raw_bytes * ratio))


def _size(size_bytes: int) -> str:
    return f"{size_bytes / 1e9:.2f} GB" if size_bytes >= 1e9 else f"{size_bytes / 1e6:.1f} MB"
