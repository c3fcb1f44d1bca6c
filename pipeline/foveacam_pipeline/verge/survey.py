"""Where in the two foveae is the patch of the wide image? One look, reduced by the zoom (about 9 times).

Seen from the eyes, a target at depth Z lies B f / 2Z to the right in the left eye and as much to the left in
the right one. Both eyes' correlations are therefore added at equal and opposite shifts, and searched as one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Sighting
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import crossing_z_m, plane_from_raw, to_uint8
from foveacam_pipeline.verge.aim import EYES
from foveacam_pipeline.verge.template import Template, evened, peak

REDUCTION = 4
"""Whole-number part of the zoom, averaged away before the warp."""
BAND_PX = 14
"""How far above or below its row a target may appear: calibration drift, survey px."""
SLACK_PX = 3
"""How far the two eyes' shifts may differ from equal and opposite, survey px."""
ROWS_APART_PX = 4.0
"""How much the rows found by the two eyes may differ, survey px."""
BLUR_SIGMA_PX = 1.0
"""The reduced foveae are sharper than the enlarged wide image; this brings them closer, survey px."""
CONFIRM_PX = 16
"""How far from the centres a verged target is looked for, survey px."""
ROW_PENALTY = 0.04
"""What a match at the edge of the band loses of its correlation: where rows cannot be told, they match."""
ROLLED_AWAY_PX = 12
"""What the image's rotation (up to 10 degrees) takes from the field at the patch's height, survey px."""
UNSEEN = -1.0
LEAST_SEEN = 0.97

Scores: TypeAlias = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedEye:
    """One fovea at survey scale: a window of its virtual plane, evened out, from (u0, v0) px on."""

    image: NDArray[np.float32]
    seen: NDArray[np.float32]
    u0_px: float
    v0_px: float

    @property
    def centre_px(self) -> NDArray[np.float64]:
        """(2,) plane px of the fovea's image centre."""
        height, width = self.image.shape
        return np.array([self.u0_px + (width - 1) / 2, self.v0_px + (height - 1) / 2])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedLook:
    """Both foveae of one look at survey scale, with its focal length."""

    left: ReducedEye
    right: ReducedEye
    f_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Registration:
    """Where both foveae see the patch.

    `left`, `right`: (2,) tangents from each eye's gaze to the target. `score`: the weaker of the two
    correlations. `lead`: by how much it beats the best other place (mean of both eyes).
    `rows_apart_px`: how much the rows differ in which the two eyes found it, survey px.
    """

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    score: float
    lead: float
    rows_apart_px: float


def epipolar_looks(calibration: Calibration, template: Template, nearest_m: float) -> Iterator[float]:
    """Yield 1/Z, 1/m, of the looks that together see every depth from infinity to `nearest_m`.

    A look finds what lies within its field less half the patch; the first is parallel (Sec. 3.4).
    """
    half_field = (calibration.fovea_width - 1) / 2 / calibration.fovea_f_px
    half_patch = (template.patch.shape[1] - 1) / 2 + ROLLED_AWAY_PX
    cover = half_field - half_patch / template.f_px
    nearest = calibration.baseline_m / 2.0 / nearest_m
    shift = 0.0
    while shift - cover < nearest:
        yield 2.0 * shift / calibration.baseline_m
        shift += 2.0 * cover


def reduce_look(sighting: Sighting, calibration: Calibration, *, f_px: float) -> ReducedLook:
    """Bring both foveae to survey scale."""
    z_m = crossing_z_m(calibration, sighting.volts)
    eyes = []
    for role in EYES:
        frame = sighting.left if role is Role.LEFT else sighting.right
        plane = plane_from_raw(calibration, role, sighting.volts, depth_m=z_m)
        eyes.append(_reduce(gray(to_uint8(frame)), plane, zoom=f_px / calibration.fovea_f_px))
    return ReducedLook(left=eyes[0], right=eyes[1], f_px=f_px)


def register(look: ReducedLook, template: Template, *, slack_px: int = SLACK_PX) -> Registration | None:
    """Return the place where both foveae agree best on the patch; None when the patch fits into neither."""
    target = template.target * template.f_px
    maps = [_scores(eye, template) for eye in (look.left, look.right)]
    left, right = (None if m is None else _band(*m, target_v_px=float(target[1])) for m in maps)
    if left is None or right is None:
        return None
    profile_left, profile_right = left.profile(), right.profile()
    start_left = left.u0_px - float(target[0])
    start_right = float(target[0]) - (right.u0_px + len(profile_right) - 1)
    joint = _Joint.of(profile_left, start_left, profile_right[::-1], start_right, slack_px)
    if joint is None:
        return None
    shift_px, best = joint.best()
    lead = best - joint.second(shift_px, guard_px=max(6.0, template.patch.shape[1] / 8))
    near = slack_px + 1
    found = [
        left.refined(float(target[0]) + shift_px, near),
        right.refined(float(target[0]) - shift_px, near),
    ]
    return Registration(
        left=(np.array(found[0][:2]) - look.left.centre_px) / look.f_px,
        right=(np.array(found[1][:2]) - look.right.centre_px) / look.f_px,
        score=min(found[0][2], found[1][2]),
        lead=lead,
        rows_apart_px=abs(found[0][1] - found[1][1]),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vicinity:
    """How well the patch fits about both foveae's centres: two correlation maps, centres in their middles."""

    left: Scores
    right: Scores
    f_px: float

    def peaks(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Return where each eye by itself sees the patch, (2,) tangents from its gaze; the weaker score."""
        (left, left_score), (right, right_score) = (_peak_about(m) for m in (self.left, self.right))
        return left / self.f_px, right / self.f_px, min(left_score, right_score)

    def given(self, residual: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Return where both see it, given left minus right place, all (2,) tangents; and the score."""
        half = residual * (self.f_px / 2.0)
        left, right = _moved(self.left, half), _moved(self.right, -half)
        centre, _ = _peak_about(np.asarray((left + right) / 2.0, dtype=np.float32))
        row, column = (int(np.clip(round(centre[k]) + CONFIRM_PX, 0, 2 * CONFIRM_PX)) for k in (1, 0))
        return centre / self.f_px, min(float(left[row, column]), float(right[row, column]))


def vicinity(look: ReducedLook, template: Template) -> Vicinity:
    """Correlate the patch with both foveae about their centres."""
    maps = []
    for eye in (look.left, look.right):
        half_y, half_x = ((side - 1) // 2 for side in template.patch.shape)
        middle_y, middle_x = ((side - 1) // 2 for side in eye.image.shape)
        reach_y, reach_x = half_y + CONFIRM_PX, half_x + CONFIRM_PX
        part = cv2.getRectSubPix(
            eye.image, (2 * reach_x + 1, 2 * reach_y + 1), (float(middle_x), float(middle_y))
        )
        found = np.nan_to_num(cv2.matchTemplate(part, template.patch, cv2.TM_CCOEFF_NORMED))
        maps.append(np.asarray(found, dtype=np.float32))
    return Vicinity(left=maps[0], right=maps[1], f_px=look.f_px)


def _peak_about(scores: Scores) -> tuple[NDArray[np.float64], float]:
    """Return the (x, y) of the best place from the middle of a map, survey px, and its score."""
    rows = np.linspace(-1.0, 1.0, scores.shape[0], dtype=np.float32)
    x, y, score = peak(np.asarray(scores - ROW_PENALTY * rows[:, None] ** 2, dtype=np.float32))
    return np.array([x - (scores.shape[1] - 1) / 2, y - (scores.shape[0] - 1) / 2]), score


def _moved(scores: Scores, shift_px: NDArray[np.float64]) -> Scores:
    """Return the map whose entry at p is that of `scores` at p + shift, its border continued."""
    matrix = np.array([[1.0, 0.0, float(shift_px[0])], [0.0, 1.0, float(shift_px[1])]])
    size = (scores.shape[1], scores.shape[0])
    moved = cv2.warpAffine(
        scores,
        matrix,
        size,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=UNSEEN,
    )
    return np.asarray(moved, dtype=np.float32)


def _reduce(image: NDArray[np.uint8], plane: NDArray[np.float64], *, zoom: float) -> ReducedEye:
    height, width = image.shape
    small = cv2.resize(image, (width // REDUCTION, height // REDUCTION), interpolation=cv2.INTER_AREA).astype(
        np.float32
    )
    size = (round(width * zoom) | 1, round(height * zoom) | 1)
    middle = plane @ np.array([(width - 1) / 2, (height - 1) / 2, 1.0])
    u0, v0 = (zoom * middle[k] / middle[2] - (size[k] - 1) / 2 for k in (0, 1))
    offset = (REDUCTION - 1) / 2
    raw_from_small = np.array([[REDUCTION, 0.0, offset], [0.0, REDUCTION, offset], [0.0, 0.0, 1.0]])
    window = np.array([[zoom, 0.0, -u0], [0.0, zoom, -v0], [0.0, 0.0, 1.0]]) @ plane @ raw_from_small
    view = cv2.warpPerspective(small, window, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    seen = cv2.warpPerspective(np.ones_like(small), window, size, flags=cv2.INTER_LINEAR)
    blurred = np.asarray(cv2.GaussianBlur(view, (0, 0), BLUR_SIGMA_PX), dtype=np.float32)
    return ReducedEye(image=evened(blurred), seen=np.asarray(seen, dtype=np.float32), u0_px=u0, v0_px=v0)


def _scores(eye: ReducedEye, template: Template) -> tuple[Scores, float, float] | None:
    """Return the correlation at every place of the patch's middle, and the plane px of the first place."""
    height, width = template.patch.shape
    if eye.image.shape[0] < height or eye.image.shape[1] < width:
        return None
    scores = np.asarray(cv2.matchTemplate(eye.image, template.patch, cv2.TM_CCOEFF_NORMED), dtype=np.float32)
    half_x, half_y = (width - 1) // 2, (height - 1) // 2
    cover = cv2.blur(eye.seen, (width, height), borderType=cv2.BORDER_REPLICATE)
    inside = cover[half_y : half_y + scores.shape[0], half_x : half_x + scores.shape[1]]
    scores[(inside < LEAST_SEEN) | ~np.isfinite(scores)] = UNSEEN
    return scores, eye.u0_px + half_x, eye.v0_px + half_y


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Band:
    """The rows of a correlation map in which the target may lie; its first entry at (u0, v0) plane px."""

    scores: Scores
    u0_px: float
    v0_px: float

    def profile(self) -> Scores:
        """Return the best score of each column."""
        return np.asarray(self.scores.max(axis=0), dtype=np.float32)

    def refined(self, u_px: float, near_px: int) -> tuple[float, float, float]:
        """Return (u, v, score) of the best place within `near_px` columns of `u_px`, plane px."""
        column = round(u_px - self.u0_px)
        first = max(0, min(column, self.scores.shape[1] - 1) - near_px - 1)
        part = self.scores[:, first : column + near_px + 2]
        x, y, score = peak(part)
        return self.u0_px + first + x, self.v0_px + y, score


def _band(scores: Scores, u0_px: float, v0_px: float, *, target_v_px: float) -> _Band | None:
    row = round(target_v_px - v0_px)
    first, last = max(0, row - BAND_PX), min(scores.shape[0], row + BAND_PX + 1)
    if last <= first:
        return None
    rows = (np.arange(first, last, dtype=np.float32) - row) / BAND_PX
    part = np.asarray(scores[first:last] - ROW_PENALTY * (rows * rows)[:, None], dtype=np.float32)
    return _Band(scores=part, u0_px=u0_px, v0_px=v0_px + first)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Joint:
    """Mean of both eyes' best scores over shifts `start_px`, `start_px` + 1, ... survey px."""

    scores: Scores
    start_px: int

    @classmethod
    def of(
        cls, left: Scores, left_start_px: float, right: Scores, right_start_px: float, slack_px: int
    ) -> "_Joint | None":
        """Overlay two profiles, each with some slack; None when no shift is seen by both eyes."""
        starts = (round(left_start_px), round(right_start_px))
        first = max(*starts, -slack_px)
        last = min(starts[0] + len(left), starts[1] + len(right))
        if last - first < 3:
            return None
        kernel = np.ones((1, 2 * slack_px + 1), dtype=np.uint8)
        rows = [
            np.asarray(cv2.dilate(profile[None], kernel)[0], dtype=np.float32)[first - start : last - start]
            for profile, start in ((left, starts[0]), (right, starts[1]))
        ]
        return cls(scores=np.asarray((rows[0] + rows[1]) / 2.0, dtype=np.float32), start_px=first)

    def best(self) -> tuple[float, float]:
        """Return the middle of the best plateau, px, and its score."""
        top = float(self.scores.max())
        plateau = np.flatnonzero(self.scores >= top - 1e-6)
        return self.start_px + float(plateau.mean()), top

    def second(self, shift_px: float, *, guard_px: float) -> float:
        """Return the best score farther than `guard_px` from `shift_px`."""
        shifts = self.start_px + np.arange(len(self.scores))
        others = self.scores[np.abs(shifts - shift_px) > guard_px]
        return float(others.max()) if others.size else UNSEEN
