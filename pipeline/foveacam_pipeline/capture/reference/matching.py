"""Matches a sample in other views, after warping both onto the surface that the short baseline measured.

A view of another stop sees the surface from the side. So the sample's own picture and the other are both
warped onto the local plane of 1 / Z. A small shift remains: along the epipolar line by the error of the
depth, and across it by that of the poses. It is searched within their uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.register import REACH_PX, register
from foveacam_pipeline.capture.reference.short_baseline import ShortBaselineSample
from foveacam_pipeline.capture.reference.values import Floats
from foveacam_pipeline.capture.reference.views import FoveaView, GreyPictureCache, StopPose
from foveacam_pipeline.models.calibration import Calibration

CORE_PX = 40
"""Side of the compared window."""
SIDE_PX = CORE_PX + 2 * REACH_PX
SIGMAS = 4.0
LEAST_Q = 1e-3
COARSE_WIDTH_PX = 360
"""Width to which foveae are reduced to locate the stops."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchSearch:
    """A patch search: one px of a patch is `factor` px of the fovea; `slack_px`: possible error of poses."""

    factor: int
    slack_px: float


FINE = PatchSearch(factor=1, slack_px=5.0)


def coarse_search(calibration: Calibration) -> PatchSearch:
    """Return the search for when nothing but the rail's report is known."""
    factor = max(1, calibration.fovea_width // COARSE_WIDTH_PX)
    return PatchSearch(factor=factor, slack_px=float(factor * (REACH_PX - 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampleMatch:
    """A sample found in a view: `relative_px`: (2,) h (`EyeLook`), and its matching covariance, px²."""

    sample: int
    view: int
    relative_px: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchingScene:
    """The views, stop poses and calibration that matching uses."""

    views: Sequence[FoveaView]
    stop_poses: Sequence[StopPose]
    calibration: Calibration

    def look(self, view: FoveaView) -> EyeLook:
        """Return a view's projection corrected by the estimated error of its gaze."""
        return view.look.with_adjustment(self.stop_poses[view.stop].shifts_px[view.eye], np.eye(2))

    def point_m(self, view: FoveaView, u_px: Floats, v_px: Floats, q: Floats) -> Floats:
        """Return (..., 3) points of plane positions of an anchor, in the judged scan's rig frame."""
        z = 1.0 / np.maximum(q, LEAST_Q)
        f_px = self.calibration.fovea_f_px
        shift = self.stop_poses[view.stop].shifts_px[view.eye]
        rays = np.stack([(u_px + shift[0]) / f_px * z, (v_px + shift[1]) / f_px * z, z], axis=-1)
        return np.asarray(rays + self.calibration.reference_rig_m(view.role), dtype=np.float64)

    def project(self, view: FoveaView, points_m: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (u, v, q) of points (..., 3) on the plane of a view's eye."""
        own = self.stop_poses[view.stop].to_stop_frame(points_m) - self.calibration.reference_rig_m(view.role)
        q = np.asarray(1.0 / np.maximum(own[..., 2], 1e-3), dtype=np.float64)
        f_px = self.calibration.fovea_f_px
        return f_px * own[..., 0] * q, f_px * own[..., 1] * q, q


def candidate_views(
    sample_points_m: Floats, anchor: FoveaView, scene: MatchingScene
) -> list[list[FoveaView]]:
    """Return for every sample (n, 3) the views to search: for each stop and eye the most central one."""
    calibration = scene.calibration
    margin = 0.75 * SIDE_PX
    best: list[dict[tuple[int, int], tuple[float, FoveaView]]] = [{} for _ in sample_points_m]
    for view in scene.views:
        if (view.stop, view.eye) == (anchor.stop, anchor.eye):
            continue
        x, y = scene.look(view).raw(*scene.project(view, sample_points_m))
        inside = np.minimum(
            np.minimum(x, calibration.fovea_width - 1 - x), np.minimum(y, calibration.fovea_height - 1 - y)
        )
        for k in np.flatnonzero(inside > margin):
            key = view.stop, view.eye
            if key not in best[k] or inside[k] > best[k][key][0]:
                best[k][key] = float(inside[k]), view
    return [[view for _, view in each.values()] for each in best]


def match_sample(
    sample: ShortBaselineSample,
    number: int,
    view: FoveaView,
    *,
    scene: MatchingScene,
    pictures: GreyPictureCache,
    search: PatchSearch,
) -> SampleMatch | None:
    """Return a sample's match in a view; None where there is none within the uncertainty."""
    anchor = scene.views[sample.anchor]
    surface = _Surface(sample=sample, anchor=anchor, scene=scene)
    images = [_warp_patch(each, surface, pictures, search) for each in (anchor, view)]
    if images[0] is None or images[1] is None:
        return None
    found = register(images[0], images[1])
    if found is None:
        return None
    shift = search.factor * found.shift_px
    off = np.vstack([np.zeros(2), shift, shift + np.eye(2)])
    about = surface.gaze_relative(view, off)
    moved = about[1] - about[0]
    if not _plausible(moved, surface.depth_step_px(view), slack_px=search.slack_px):
        return None
    slopes = (about[2:] - about[1]).T
    covariance = search.factor**2 * slopes @ found.covariance @ slopes.T
    return SampleMatch(sample=number, view=view.number, relative_px=about[1], covariance=covariance)


def own_match(sample: ShortBaselineSample, number: int, scene: MatchingScene) -> SampleMatch:
    """Return the match of a sample in its own picture, exact by definition."""
    anchor = scene.views[sample.anchor]
    u, v, q = (np.asarray(value) for value in (sample.u_px, sample.v_px, sample.q0))
    about = np.array(anchor.look.gaze_relative(u, v, q), dtype=np.float64)
    return SampleMatch(sample=number, view=sample.anchor, relative_px=about, covariance=np.zeros((2, 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Surface:
    """The local plane around a sample."""

    sample: ShortBaselineSample
    anchor: FoveaView
    scene: MatchingScene

    def points_m(self, off_px: Floats, *, nearer: float = 0.0) -> Floats:
        """Return (..., 3) points at (..., 2) px from the sample on the anchor's plane; `nearer` in q."""
        q = self.sample.q0 + nearer + off_px @ self.sample.slope
        return self.scene.point_m(
            self.anchor, self.sample.u_px + off_px[..., 0], self.sample.v_px + off_px[..., 1], q
        )

    def gaze_relative(self, view: FoveaView, off_px: Floats, *, nearer: float = 0.0) -> Floats:
        """Return (..., 2) h of those points in a view."""
        points = self.points_m(off_px, nearer=nearer)
        return np.stack(self.scene.look(view).gaze_relative(*self.scene.project(view, points)), axis=-1)

    def depth_step_px(self, view: FoveaView) -> Floats:
        """Return (2,): the sample's motion in a view for a change of its depth by a standard error."""
        sigma = float(np.hypot(self.sample.sigma, self.sample.pose_sigma))
        at = np.zeros(2)
        return np.asarray(
            self.gaze_relative(view, at, nearer=sigma) - self.gaze_relative(view, at), dtype=np.float64
        )


def _plausible(shift_px: Floats, depth_step_px: Floats, *, slack_px: float) -> bool:
    """Return whether a shift lies within the search interval, along and across the epipolar line."""
    length = float(np.linalg.norm(depth_step_px))
    direction = depth_step_px / max(length, 1e-9)
    along = float(shift_px @ direction)
    across = float(np.linalg.norm(shift_px - along * direction))
    return abs(along) <= SIGMAS * length + slack_px and across <= slack_px


def _warp_patch(
    view: FoveaView, surface: _Surface, pictures: GreyPictureCache, search: PatchSearch
) -> NDArray[np.float32] | None:
    """Return (n, n) the surface as a view shows it; None where the view does not cover it."""
    steps = search.factor * (np.arange(SIDE_PX, dtype=np.float64) - (SIDE_PX - 1) / 2)
    off = np.stack(np.meshgrid(steps, steps), axis=-1)
    scene = surface.scene
    x, y = scene.look(view).raw(*scene.project(view, surface.points_m(off)))
    picture = pictures.picture(view, search.factor)
    x, y = ((each + 0.5) / search.factor - 0.5 for each in (x, y))
    height, width = picture.shape
    if not (x.min() >= 1.0 and y.min() >= 1.0 and x.max() <= width - 2.0 and y.max() <= height - 2.0):
        return None
    warped = cv2.remap(picture, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC)
    return np.asarray(warped, dtype=np.float32)
