"""One sample looked for in every view: the surface as the short baseline has it, laid as that view shows it.

A view of another stop sees the surface from aside. So the sample's own picture and the other are both laid
on the plane that the surroundings make of 1 / Z: what is left is a small shift, along the epipolar line by
what the depth is off, and across it by what the poses are off. It is searched as far as those are uncertain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.capture.mosaic.look import EyeLook
from foveacam_pipeline.capture.mosaic.register import REACH_PX, register
from foveacam_pipeline.capture.reference.fovea_views import FoveaView, GreyPictureCache, StopPose
from foveacam_pipeline.capture.reference.short_baseline import ShortBaselineSample
from foveacam_pipeline.capture.reference.values import Floats
from foveacam_pipeline.models.calibration import Calibration

CORE_PX = 40
"""Side of what is compared."""
SIDE_PX = CORE_PX + 2 * REACH_PX
SIGMAS = 4.0
LEAST_Q = 1e-3
COARSE_WIDTH_PX = 360
"""Foveae are made about so small to find out where the stops are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatchSearch:
    """How to look: one px of a patch is `factor` px of the fovea; `slack_px`: what poses may be off by."""

    factor: int
    slack_px: float


FINE = PatchSearch(factor=1, slack_px=5.0)


def coarse(calibration: Calibration) -> PatchSearch:
    """Return how to look before anything is known of the rail but what it says."""
    factor = max(1, calibration.fovea_width // COARSE_WIDTH_PX)
    return PatchSearch(factor=factor, slack_px=float(factor * (REACH_PX - 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampleMatch:
    """Where a sight shows a sample: `about_px`: (2,) h (`EyeLook`) and its covariance by matching, px²."""

    sample: int
    sight: int
    about_px: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatchingScene:
    """What the matching works with."""

    sights: Sequence[FoveaView]
    stands: Sequence[StopPose]
    calibration: Calibration

    def look(self, sight: FoveaView) -> EyeLook:
        """Return a sight's look with what its gaze was found to be off by."""
        return sight.look.adjusted(self.stands[sight.stop].shifts_px[sight.eye], np.eye(2))

    def point_m(self, sight: FoveaView, u_px: Floats, v_px: Floats, q: Floats) -> Floats:
        """Return (..., 3) points of a plane place of an anchor, as calibrated, judged scan's rig frame."""
        z = 1.0 / np.maximum(q, LEAST_Q)
        f_px = self.calibration.fovea_f_px
        shift = self.stands[sight.stop].shifts_px[sight.eye]
        rays = np.stack([(u_px + shift[0]) / f_px * z, (v_px + shift[1]) / f_px * z, z], axis=-1)
        return np.asarray(rays + self.calibration.reference_rig_m(sight.role), dtype=np.float64)

    def place(self, sight: FoveaView, points_m: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (u, v, q) of points (..., 3) on the plane of a sight's eye."""
        own = self.stands[sight.stop].own(points_m) - self.calibration.reference_rig_m(sight.role)
        q = np.asarray(1.0 / np.maximum(own[..., 2], 1e-3), dtype=np.float64)
        f_px = self.calibration.fovea_f_px
        return f_px * own[..., 0] * q, f_px * own[..., 1] * q, q


def seen_by(sample_points_m: Floats, anchor: FoveaView, scene: MatchingScene) -> list[list[FoveaView]]:
    """Return for every sample (n, 3) the sights to look in: of each stop and eye the one it lies best in."""
    calibration = scene.calibration
    margin = 0.75 * SIDE_PX
    best: list[dict[tuple[int, int], tuple[float, FoveaView]]] = [{} for _ in sample_points_m]
    for sight in scene.sights:
        if (sight.stop, sight.eye) == (anchor.stop, anchor.eye):
            continue
        x, y = scene.look(sight).raw(*scene.place(sight, sample_points_m))
        inside = np.minimum(
            np.minimum(x, calibration.fovea_width - 1 - x), np.minimum(y, calibration.fovea_height - 1 - y)
        )
        for k in np.flatnonzero(inside > margin):
            key = sight.stop, sight.eye
            if key not in best[k] or inside[k] > best[k][key][0]:
                best[k][key] = float(inside[k]), sight
    return [[sight for _, sight in each.values()] for each in best]


def find(
    sample: ShortBaselineSample,
    number: int,
    sight: FoveaView,
    *,
    scene: MatchingScene,
    pictures: GreyPictureCache,
    search: PatchSearch,
) -> SampleMatch | None:
    """Return where a sight shows a sample; None where it does not, or beyond what is uncertain."""
    anchor = scene.sights[sample.anchor]
    surface = _Surface(sample=sample, anchor=anchor, scene=scene)
    images = [_laid(each, surface, pictures, search) for each in (anchor, sight)]
    if images[0] is None or images[1] is None:
        return None
    found = register(images[0], images[1])
    if found is None:
        return None
    shift = search.factor * found.shift_px
    off = np.vstack([np.zeros(2), shift, shift + np.eye(2)])
    about = surface.about(sight, off)
    moved = about[1] - about[0]
    if not _plausible(moved, surface.way_px(sight), slack_px=search.slack_px):
        return None
    slopes = (about[2:] - about[1]).T
    covariance = search.factor**2 * slopes @ found.covariance @ slopes.T
    return SampleMatch(sample=number, sight=sight.number, about_px=about[1], covariance=covariance)


def own_match(sample: ShortBaselineSample, number: int, scene: MatchingScene) -> SampleMatch:
    """Return the sample in its own picture: there it is by definition."""
    anchor = scene.sights[sample.anchor]
    u, v, q = (np.asarray(value) for value in (sample.u_px, sample.v_px, sample.q0))
    about = np.array(anchor.look.about(u, v, q), dtype=np.float64)
    return SampleMatch(sample=number, sight=sample.anchor, about_px=about, covariance=np.zeros((2, 2)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Surface:
    """The plane about a sample."""

    sample: ShortBaselineSample
    anchor: FoveaView
    scene: MatchingScene

    def points_m(self, off_px: Floats, *, nearer: float = 0.0) -> Floats:
        """Return (..., 3) points at (..., 2) px from the sample on the anchor's plane; `nearer` in q."""
        q = self.sample.q0 + nearer + off_px @ self.sample.slope
        return self.scene.point_m(
            self.anchor, self.sample.u_px + off_px[..., 0], self.sample.v_px + off_px[..., 1], q
        )

    def about(self, sight: FoveaView, off_px: Floats, *, nearer: float = 0.0) -> Floats:
        """Return (..., 2) h of them in a sight."""
        points = self.points_m(off_px, nearer=nearer)
        return np.stack(self.scene.look(sight).about(*self.scene.place(sight, points)), axis=-1)

    def way_px(self, sight: FoveaView) -> Floats:
        """Return (2,): how far the sample moves in a sight when its depth changes by a standard error."""
        sigma = float(np.hypot(self.sample.sigma, self.sample.pose_sigma))
        at = np.zeros(2)
        return np.asarray(self.about(sight, at, nearer=sigma) - self.about(sight, at), dtype=np.float64)


def _plausible(moved_px: Floats, way_px: Floats, *, slack_px: float) -> bool:
    """Return whether a shift lies within the search interval: along the epipolar line, and across it."""
    length = float(np.linalg.norm(way_px))
    direction = way_px / max(length, 1e-9)
    along = float(moved_px @ direction)
    across = float(np.linalg.norm(moved_px - along * direction))
    return abs(along) <= SIGMAS * length + slack_px and across <= slack_px


def _laid(
    sight: FoveaView, surface: _Surface, pictures: GreyPictureCache, search: PatchSearch
) -> NDArray[np.float32] | None:
    """Return (n, n) what a sight shows of the surface; None where it does not reach."""
    steps = search.factor * (np.arange(SIDE_PX, dtype=np.float64) - (SIDE_PX - 1) / 2)
    off = np.stack(np.meshgrid(steps, steps), axis=-1)
    scene = surface.scene
    x, y = scene.look(sight).raw(*scene.place(sight, surface.points_m(off)))
    picture = pictures.of(sight, search.factor)
    x, y = ((each + 0.5) / search.factor - 0.5 for each in (x, y))
    height, width = picture.shape
    if not (x.min() >= 1.0 and y.min() >= 1.0 and x.max() <= width - 2.0 and y.max() <= height - 2.0):
        return None
    laid = cv2.remap(picture, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC)
    return np.asarray(laid, dtype=np.float32)
