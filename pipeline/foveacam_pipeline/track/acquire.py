"""Acquisition of a moving target: tracked in the wide view since the click, then found in both foveae.

One look in which both foveae agree is enough to start tracking. A fixation would go on until the target is
centred and still, which a walker is not while looks take a third of a second.
"""

from dataclasses import dataclass

from foveacam_hardware.contract import Clock, Frame, Head, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.image_tracker import TrackBox, TrackerKind
from foveacam_pipeline.track.trackers import start_tracker
from foveacam_pipeline.verge.distance import LocatedPoint, triangulate
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead
from foveacam_pipeline.verge.looking.motion import TargetTracker
from foveacam_pipeline.verge.resolved_target import patches_for, resolve
from foveacam_pipeline.verge.search import TargetSearch
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.values import Target

SETTINGS = VergeSettings()
MATCH_SIGMA_PX = 1.0
"""Standard error of the disparity of a match in the search, fovea px."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AcquiredTarget:
    """A look in which both foveae agree on the target, with the target's position and velocity."""

    sighting: Sighting
    point: LocatedPoint
    velocity_rig_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Across the line of sight as measured in the wide view; assumed 0 along it."""


def acquire(
    head: Head,
    calibration: Calibration,
    target: Target,
    *,
    clicked: Frame,
    speed_px_s: tuple[float, float],
    clock: Clock,
) -> AcquiredTarget | None:
    """Search along the line of sight until both foveae agree on the target; None if they never do.

    `clicked`: the wide frame to which `target` refers; `speed_px_s`: the target's speed in it, x and y. Raise
    `OutOfRange` for a target outside the wide image.
    """
    aim = resolve(target, calibration.wide, SETTINGS)
    looks = FixationHead(head, calibration, clock=clock, limits=SETTINGS, on_step=None, cancelled=None)
    templates = patches_for(gray(to_uint8(clicked)), aim, calibration.wide, SETTINGS)
    tracker = TargetTracker(templates[0], clicked, calibration.wide, far=True)
    tracker.follow(looks.wide())
    try:
        found = TargetSearch(looks, calibration, SETTINGS).find(templates, tracker)
    except FixationEnded:
        return None
    point = triangulate(calibration, found.gazes, sigma_px=MATCH_SIGMA_PX)
    if point is None or looks.last is None or found.joint < SETTINGS.register_joint:
        return None
    z_m = point.point_rig_m[2]
    along_x, along_y = (z_m / calibration.wide.fx_px * speed for speed in speed_px_s)
    return AcquiredTarget(sighting=looks.last.sighting, point=point, velocity_rig_m_s=(along_x, along_y, 0.0))


class ClickTrack:
    """Tracks a clicked point through newer wide frames; searches where its last speed predicts it."""

    def __init__(self, frame: Frame, box: TrackBox) -> None:
        """`frame`: the clicked wide frame. Raise `OutOfRange` if the box has no texture to track."""
        self._tracker = start_tracker(TrackerKind.TEMPLATE, gray(to_uint8(frame)), box, binning=frame.binning)
        self.frame = frame
        """Newest frame in which the point was found."""
        self.place_px = (box.x_px, box.y_px)
        """Its position in that frame, (x, y)."""
        self.speed_px_s = (0.0, 0.0)
        """Its speed in the wide view along x and y."""

    def see(self, frame: Frame) -> None:
        """Track the point in a frame; ignore one that is not newer than that of the last match."""
        passed_s = (frame.t_ns - self.frame.t_ns) / 1e9
        if passed_s <= 0.0:
            return
        near = tuple(at + passed_s * speed for at, speed in zip(self.place_px, self.speed_px_s, strict=True))
        match = self._tracker.update(gray(to_uint8(frame)), (near[0], near[1]))
        if match is None:
            return
        found = (match.x_px, match.y_px)
        self.speed_px_s = (
            (found[0] - self.place_px[0]) / passed_s,
            (found[1] - self.place_px[1]) / passed_s,
        )
        self.place_px, self.frame = found, frame
