"""The first look at a target to be followed: tracks it since the click and verges both foveae on it."""

import math
from dataclasses import replace

from foveacam_hardware.contract import Clock, Head, OutOfRange
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.track.acquire import AcquiredTarget, ClickTrack, acquire
from foveacam_pipeline.track.image_tracker import TrackBox
from foveacam_pipeline.verge.distance import LocatedPoint
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.surroundings.depth_samples import DepthContext
from foveacam_pipeline.verge.values import Basis, DirectionTarget, PixelTarget, RectangleTarget, Target
from foveacam_server.rig.live_views import RecentFrames

MOVES_PX_S = 20.0
"""Speed in the wide view above which a target is acquired as a moving one, wide px/s."""
FRESH_FRAMES = 8
"""Most wide frames that `refresh` takes while it searches for the clicked target."""
LEAST_BOX_PX = 16


def track_click(
    recent: RecentFrames, target: Target, *, frame_seq: int | None, box_px: int, now_ns: int
) -> ClickTrack | None:
    """Return the clicked target, tracked to the newest wide frame; None without a frame or trackable box."""
    if isinstance(target, DirectionTarget):
        return None
    frame = recent.chosen(frame_seq, now_ns=now_ns)
    if frame is None:
        return None
    width_px, height_px = sides_px(target, box_px)
    x_px, y_px = middle_px(target)
    box = TrackBox(x_px=x_px, y_px=y_px, width_px=width_px, height_px=height_px)
    try:
        click = ClickTrack(frame, box)
    except OutOfRange:  # no texture, or at the rim: it is fixated where it was clicked
        return None
    return catch_up(recent, click)


def catch_up(recent: RecentFrames, click: ClickTrack) -> ClickTrack:
    """Track a clicked target through the wide frames taken since; return its track."""
    for frame in recent.since(click.frame.t_ns):
        click.see(frame)
    return click


def refresh(head: Head, click: ClickTrack) -> None:
    """Track a clicked target in new wide frames until it was found in two, which give its place and speed."""
    found = 0
    for _ in range(FRESH_FRAMES):
        before = click.frame
        click.see(head.wide(max_age_ms=0.0))
        found += click.frame is not before
        if found == 2:
            return


def look_first(
    head: Head,
    calibration: Calibration,
    target: Target,
    click: ClickTrack | None,
    *,
    clock: Clock,
    context: DepthContext,
) -> AcquiredTarget:
    """Verge both foveae on a target; raise `OutOfRange` with the reason where they do not both see it.

    `click`: its track since the click. A moving target is acquired by the first look in which both foveae
    agree; where that fails, and for a target at rest, by a fixation.
    """
    if click is not None:
        refresh(head, click)
    place = target if click is None else moved_to(target, click.place_px)
    if click is not None and math.hypot(*click.speed_px_s) > MOVES_PX_S:
        acquired = acquire(
            head, calibration, place, clicked=click.frame, speed_px_s=click.speed_px_s, clock=clock
        )
        if acquired is not None:
            return acquired
    found = fixate(
        head,
        calibration,
        place,
        known=PriorKnowledge(context=context),
        clicked=None if click is None else click.frame,
        clock=clock,
    )
    point, distance_m, sigma_m = found.point_rig_m, found.distance_m, found.distance_sigma_m
    if found.basis is not Basis.BOTH_FOVEAE or found.sighting is None or point is None:
        raise OutOfRange(f"both foveae must see a target to follow it. {found.reason}")
    located = LocatedPoint(point_rig_m=point, distance_m=distance_m or 0.0, distance_sigma_m=sigma_m or 0.0)
    return AcquiredTarget(sighting=found.sighting, point=located)


def middle_px(target: PixelTarget | RectangleTarget) -> tuple[float, float]:
    """Return the pixel at the centre of a target."""
    if isinstance(target, PixelTarget):
        return target.x_px, target.y_px
    return target.x_px + target.width_px / 2.0, target.y_px + target.height_px / 2.0


def moved_to(target: Target, place_px: tuple[float, float]) -> Target:
    """Return a target with its centre moved to another pixel; a direction is returned unchanged."""
    if isinstance(target, DirectionTarget):
        return target
    x_px, y_px = middle_px(target)
    return replace(target, x_px=target.x_px + place_px[0] - x_px, y_px=target.y_px + place_px[1] - y_px)


def sides_px(target: Target, box_px: int) -> tuple[int, int]:
    """Return width and height of the image tracker's template: a rectangle's, or `box_px` about a point."""
    if isinstance(target, RectangleTarget):
        return max(LEAST_BOX_PX, round(target.width_px)), max(LEAST_BOX_PX, round(target.height_px))
    return box_px, box_px
