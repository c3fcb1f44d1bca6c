"""Value types of stereo: rectified pair, disparity map, depth map, point cloud and mesh."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class RectifiedPair:
    """Two windows of the virtual pinhole planes (Sec. 3.2), sharing v0.

    `left`, `right`: (h, w) or (h, w, 3) uint8 RGB. `valid_left`, `valid_right`: (h, w) bool, false where the
    window looks past the fovea's frame. A pixel (x, y) of a window lies at (x + u0, y + v0) px from the
    principal point of its virtual pinhole, whose focal length is `f_px` at this window's scale. The pinholes
    lie at (-B/2, 0, 0) and (+B/2, 0, 0) in the rig frame.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    valid_left: NDArray[np.bool_]
    valid_right: NDArray[np.bool_]
    f_px: float
    baseline_m: float
    u0_left_px: float
    u0_right_px: float
    v0_px: float
    pose_sigma_px: float
    """Standard error of u0_left - u0_right from the calibration, px at this window's scale."""
    t_ns: int

    @property
    def offset_px(self) -> float:
        """Disparity of the windows' origins: total disparity d = residual + offset, px."""
        return self.u0_left_px - self.u0_right_px

    @property
    def verged_z_m(self) -> float:
        """Depth along +z at which the residual is zero, metres; infinite when the gazes do not meet."""
        if self.offset_px <= 0.0:
            return float("inf")
        return self.f_px * self.baseline_m / self.offset_px

    def mirrored(self) -> "RectifiedPair":
        """Return the pair in a mirror: eyes exchanged and columns reversed; disparities keep their sign."""
        last = self.left.shape[1] - 1
        return replace(
            self,
            left=np.ascontiguousarray(self.right[:, ::-1]),
            right=np.ascontiguousarray(self.left[:, ::-1]),
            valid_left=np.ascontiguousarray(self.valid_right[:, ::-1]),
            valid_right=np.ascontiguousarray(self.valid_left[:, ::-1]),
            u0_left_px=-(last + self.u0_right_px),
            u0_right_px=-(last + self.u0_left_px),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DisparityMap:
    """Signed residual disparity of the left window, px, float32; NaN where unknown."""

    residual_px: NDArray[np.float32]
    sigma_px: NDArray[np.float32]
    """(h, w) matching error, px, which contains the true disparity with probability 0.683; NaN unknown."""
    compute_ms: float
    occluded: NDArray[np.bool_] | None = None
    """(h, w), true where only the left eye sees the surface; None if not computed."""
    wrong: NDArray[np.float32] | None = None
    """(h, w) probability that the disparity is wrong by more than 1 px; NaN unknown, None if not computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthMap:
    """Depth along +z of the rig frame for every pixel of the left window, metres; NaN where unknown."""

    z_m: NDArray[np.float32]
    sigma_m: NDArray[np.float32]
    """(h, w) standard error along z from matching alone (Sec. 4.1), metres."""
    pose_sigma_m: NDArray[np.float32]
    """(h, w) standard error along z that all pixels share: the calibration's, metres."""
    occluded: NDArray[np.bool_] | None = None
    """(h, w), true where only the left eye sees the surface; None if not computed."""
    wrong: NDArray[np.float32] | None = None
    """(h, w) probability that the disparity is wrong by more than 1 px; NaN unknown, None if not computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cloud:
    """Points in the rig frame.

    `points_rig_m`: (n, 3) float32. `colors`: (n, 3) uint8 RGB. `sigma_m`: (n,) float32, along z.
    """

    points_rig_m: NDArray[np.float32]
    colors: NDArray[np.uint8]
    sigma_m: NDArray[np.float32]

    def __len__(self) -> int:
        return int(self.points_rig_m.shape[0])


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthMesh:
    """A textured surface in the rig frame.

    `vertices_rig_m`: (n, 3) float32. `faces`: (m, 3) uint32, outward side towards the rig.
    `uv`: (n, 2) float32 in 0..1, v down. `texture`: (h, w, 3) uint8 RGB.
    """

    vertices_rig_m: NDArray[np.float32]
    faces: NDArray[np.uint32]
    uv: NDArray[np.float32]
    texture: NDArray[np.uint8]
