"""Camera projections for the renderer (any 3x3 matrix, a centre, a distortion table), and their disparity.

Depth is measured from the projection's centre along `axis`, a unit vector of the scene's frame, by default
its +z. The third row of M would not serve: behind a mirror or with a measured homography it is no optical
axis.
"""

import hashlib
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract.errors import InvalidInput

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
SAME_SURFACE = 2e-3
"""Relative difference within which two depths count as the same surface."""
HALF_FROM_WHOLE_PX = np.array([[0.5, 0.0, -0.25], [0.0, 0.5, -0.25], [0.0, 0.0, 1.0]])
"""Transform from pixels of the whole picture to those of its 2x2 means, homogeneous."""
HALF_FROM_WHOLE_PX.flags.writeable = False


def _array(value: ArrayLike, name: str, shape: tuple[int, ...]) -> F64:
    array: F64 = np.array(value, dtype=np.float64)
    if array.shape != shape:
        raise InvalidInput(
            f"{name}: asked for shape {shape}, found {array.shape}; pass an array of that shape"
        )
    if not np.isfinite(array).all():
        raise InvalidInput(
            f"{name}: found a value that is not finite in {array.tolist()}; pass finite numbers"
        )
    array.flags.writeable = False
    return array


class RayTable:
    """The position in the undistorted image of each pixel of a distorted one.

    It is built once per lens and shared by its projections; the renderer identifies tables by content.
    """

    def __init__(self, undistorted_px: ArrayLike) -> None:
        """Store the table; undistorted_px: (h, w, 2), undistorted (x, y) of each pixel centre."""
        table = np.asarray(undistorted_px, dtype=np.float64)
        if table.ndim != 3 or table.shape[2] != 2 or min(table.shape[:2]) < 2:
            raise InvalidInput(
                f"ray table: asked for shape (h, w, 2), found {table.shape}; pass one (x, y) a pixel"
            )
        if not np.isfinite(table).all():
            raise InvalidInput(
                "ray table: found a coordinate that is not finite; undistort within the lens' domain"
            )
        height, width = table.shape[:2]
        x, y = np.meshgrid(np.arange(width), np.arange(height))
        shift = table - np.stack([x, y], axis=-1)
        # The shift is small where the coordinate is large: float32 keeps it to 1e-6 px.
        self.shift_px: F32 = np.ascontiguousarray(shift, dtype=np.float32)
        self.shift_px.flags.writeable = False
        self.width, self.height = width, height
        self.digest = hashlib.blake2b(self.shift_px.tobytes(), digest_size=16).digest()

    def halved(self) -> "RayTable":
        """Return the table of pixels that are each the mean of 2x2 of this one's."""
        width, height = self.width // 2, self.height // 2
        blocks = self.shift_px[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 2)
        shift_px = 0.5 * blocks.mean(axis=(1, 3), dtype=np.float64)
        x, y = np.meshgrid(np.arange(width), np.arange(height))
        return RayTable(np.stack([x, y], axis=-1) + shift_px)


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """pixel ~ M (X − C), X in the scene's frame, metres; det M < 0 for a camera behind a mirror.

    With `rays`, M projects to the undistorted image, and the table maps each pixel to it.
    """

    M: F64
    C: F64
    width: int
    height: int
    rays: RayTable | None = None
    axis: F64 = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """Unit vector along which depth is measured."""
    halvings: int = 0
    """How often `halved` was applied: its pixels are means of 2x2 of the camera's."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "M", _array(self.M, "projection M", (3, 3)))
        object.__setattr__(self, "C", _array(self.C, "projection C", (3,)))
        object.__setattr__(self, "axis", _array(self.axis, "projection axis", (3,)))
        if self.width < 1 or self.height < 1:
            raise InvalidInput(
                f"projection: found {self.width}x{self.height} pixels; both must be at least 1"
            )
        condition = np.linalg.cond(self.M)
        if not condition < 1e15:
            raise InvalidInput(
                f"projection M: found condition {condition:.1e}, no ray per pixel; pass an invertible M"
            )
        if abs(np.linalg.norm(self.axis) - 1.0) > 1e-9:
            raise InvalidInput(f"projection axis: found {self.axis.tolist()}; pass a unit vector")
        if self.rays is not None and (self.rays.width, self.rays.height) != (self.width, self.height):
            found = f"{self.rays.width}x{self.rays.height}"
            raise InvalidInput(
                f"ray table: asked for {self.width}x{self.height} pixels, found {found}; build it anew"
            )

    @property
    def key(self) -> bytes:
        """A key of the projection's content: equal keys render equal images."""
        rays = b"" if self.rays is None else self.rays.digest
        size = f"{self.width}x{self.height}/{self.halvings}".encode()
        return self.M.tobytes() + self.C.tobytes() + self.axis.tobytes() + size + rays

    def halved(self) -> "Projection":
        """Return the projection to pixels that are each the mean of 2x2 of this one's: x = 2 x_b + 0.5.

        An odd last column or row is left out.
        """
        return replace(
            self,
            M=HALF_FROM_WHOLE_PX @ self.M,
            width=self.width // 2,
            height=self.height // 2,
            rays=None if self.rays is None else self.rays.halved(),
            halvings=self.halvings + 1,
        )

    def undistort(self, pixels: ArrayLike) -> F64:
        """Return undistorted pixels of (n, 2) image pixels (bilinear in the ray table)."""
        xy = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        if self.rays is None:
            return xy.copy()
        x = np.clip(xy[:, 0], 0, self.width - 1)
        y = np.clip(xy[:, 1], 0, self.height - 1)
        i = np.minimum(y.astype(int), self.height - 2)
        j = np.minimum(x.astype(int), self.width - 2)
        fx, fy = (x - j)[:, None], (y - i)[:, None]
        s = self.rays.shift_px
        top = s[i, j] * (1 - fx) + s[i, j + 1] * fx
        bottom = s[i + 1, j] * (1 - fx) + s[i + 1, j + 1] * fx
        moved: F64 = xy + top * (1 - fy) + bottom * fy
        return moved

    def rays_at(self, pixels: ArrayLike) -> F64:
        """Return ray directions (n, 3) in the scene's frame, scaled to one metre of depth along `axis`."""
        xy = self.undistort(pixels)
        d = np.column_stack([xy, np.ones(len(xy))]) @ np.linalg.inv(self.M).T
        scaled: F64 = d / (d @ self.axis)[:, None]
        return scaled

    def range_m(self, pixels: ArrayLike, depth_m: ArrayLike) -> F64:
        """Return distances from the centre along the ray of (n, 2) pixels that have `depth_m` (n,)."""
        distance: F64 = np.linalg.norm(self.rays_at(pixels), axis=1) * np.asarray(depth_m, dtype=np.float64)
        return distance

    def points(self, pixels: ArrayLike, depth_m: ArrayLike) -> F64:
        """Return the points (n, 3), scene frame, metres, at (n, 2) pixels that have `depth_m` (n,)."""
        depth = np.asarray(depth_m, dtype=np.float64).reshape(-1, 1)
        found: F64 = self.C + depth * self.rays_at(pixels)
        return found

    def project(self, points_m: ArrayLike) -> F64:
        """Return undistorted pixels (n, 2) of points (n, 3), scene frame; NaN behind the camera."""
        p = (np.asarray(points_m, dtype=np.float64).reshape(-1, 3) - self.C) @ self.M.T
        w = np.where(p[:, 2] > 0, p[:, 2], np.nan)
        pixels: F64 = p[:, :2] / w[:, None]
        return pixels


def _visible_in_right(
    xy: F64, depth_m: F64, object_ids: I32, right_depth_m: F32, right_ids: I32
) -> NDArray[np.bool_]:
    """Return whether one of the four right pixels about xy (n, 2) shows the same object at the same depth."""
    height, width = right_ids.shape
    visible = np.zeros(len(xy), bool)
    finite: NDArray[np.bool_] = np.isfinite(xy[:, 0]) & np.isfinite(xy[:, 1])
    corner = np.floor(np.where(finite[:, None], xy, -9.0)).astype(np.int64)
    for dx in (0, 1):
        for dy in (0, 1):
            j, i = corner[:, 0] + dx, corner[:, 1] + dy
            inside = finite & (j >= 0) & (i >= 0) & (j < width) & (i < height)
            j, i = np.where(inside, j, 0), np.where(inside, i, 0)
            close = np.abs(right_depth_m[i, j] - depth_m) < SAME_SURFACE * depth_m
            visible |= inside & close & (right_ids[i, j] == object_ids)
    return visible


def disparity_of(
    left: Projection, left_depth_m: F32, left_ids: I32, right: Projection, right_depth_m: F32, right_ids: I32
) -> tuple[F32, NDArray[np.bool_]]:
    """Return x_left − x_right (h, w), NaN where nothing is hit, and the mask of points visible in both."""
    if right.rays is not None:
        raise InvalidInput(
            "disparity: the right projection has a ray table; pass one without lens distortion"
        )
    y, x = np.divmod(np.arange(left.height * left.width), left.width)
    hit = np.flatnonzero(np.isfinite(left_depth_m.ravel()))
    pixels = np.column_stack([x[hit], y[hit]]).astype(np.float64)
    points = left.points(pixels, left_depth_m.ravel()[hit])
    xy = right.project(points)
    disparity = np.full(left.height * left.width, np.nan, np.float32)
    disparity[hit] = pixels[:, 0] - xy[:, 0]
    mask = np.zeros(left.height * left.width, bool)
    depth = (points - right.C) @ right.axis
    mask[hit] = _visible_in_right(xy, depth, left_ids.ravel()[hit], right_depth_m, right_ids)
    shape = (left.height, left.width)
    return disparity.reshape(shape), mask.reshape(shape)
