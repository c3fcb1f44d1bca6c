"""Comparison of two calibrations of one rig over the field that both cover, in pixels, and its diagram.

The eyes are steered by calibration a, and calibration b computes where they then look.
"""

import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput, Role, StereoVolts
from foveacam_pipeline.diagrams import new_figure
from foveacam_pipeline.geometry.plane_window import homography_apply
from foveacam_pipeline.geometry.verging import eye_angles, point_from_direction
from foveacam_pipeline.models.calibration import Calibration, eye_volts
from foveacam_pipeline.models.footprint import fovea_points_rays

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
NODES = 13
"""Directions along each side of the common field."""
_MARGIN_RAD = math.radians(0.05)
_WIDE_NODES = 25
_DPI = 110
_CELLS_LONG = 1.3
"""Length of the longest arrow, in spacings of the nodes."""
_LEAST_PX = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferenceSpread:
    """Root mean square and largest value of a difference, px."""

    rms_px: float
    max_px: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CalibrationComparison:
    """Differences of calibration b from a, at one distance.

    `field_rad`: ax min, ax max, ay min, ay max of the common field. `directions_rad`: (n, 2) compared
    directions. `gaze_left_px`, `gaze_right_px`: (n, 2) gaze by b minus gaze by a, fovea px. `epipolar_px`:
    (n,) row mismatch by b of points on equal rows by a, root mean square within an image. `disparity_px`:
    (n,) disparity by b minus the disparity of b at the depth by a. `wide_at_px`, `wide_px`: (m, 2) raw wide
    pixels, and the pixels of b for the directions that a has there, minus them. `baseline_m`: of b minus of
    a.
    """

    a: str
    b: str
    distance_m: float
    field_rad: tuple[float, float, float, float]
    directions_rad: NDArray[np.float64]
    gaze_left_px: NDArray[np.float64]
    gaze_right_px: NDArray[np.float64]
    epipolar_px: NDArray[np.float64]
    disparity_px: NDArray[np.float64]
    wide_at_px: NDArray[np.float64]
    wide_px: NDArray[np.float64]
    baseline_m: float

    @property
    def pointing(self) -> DifferenceSpread:
        """Difference of the gaze, both eyes, fovea px."""
        return _spread(np.linalg.norm(np.vstack([self.gaze_left_px, self.gaze_right_px]), axis=1))

    @property
    def epipolar(self) -> DifferenceSpread:
        """Row mismatch between the eyes, fovea px."""
        return _spread(self.epipolar_px)

    @property
    def disparity(self) -> DifferenceSpread:
        """Difference of the total disparity, fovea px."""
        return _spread(np.abs(self.disparity_px))

    @property
    def wide(self) -> DifferenceSpread:
        """Difference of the wide camera, wide px."""
        return _spread(np.linalg.norm(self.wide_px, axis=1))


def compare(
    a: Calibration, b: Calibration, *, distance_m: float = 5.0, nodes: int = NODES
) -> CalibrationComparison:
    """Compare two calibrations of one rig; raise InvalidInput when they have no field in common."""
    _check_same_rig(a, b)
    field = _common_field(a, b)
    rows = [
        _compare_at(a, b, (float(ax), float(ay)), distance_m)
        for ay in np.linspace(field[2], field[3], nodes)
        for ax in np.linspace(field[0], field[1], nodes)
        if _covered(a, b, (float(ax), float(ay)), distance_m)
    ]
    if not rows:
        raise InvalidInput(
            f"calibrations {a.id} and {b.id} share no direction at {distance_m:g} m; compare at a larger "
            "distance, or calibrate over the same field"
        )
    table = np.array(rows)
    wide_at, wide = _wide_difference(a, b)
    return CalibrationComparison(
        a=a.id,
        b=b.id,
        distance_m=distance_m,
        field_rad=field,
        directions_rad=table[:, 0:2],
        gaze_left_px=table[:, 2:4],
        gaze_right_px=table[:, 4:6],
        epipolar_px=table[:, 6],
        disparity_px=table[:, 7],
        wide_at_px=wide_at,
        wide_px=wide,
        baseline_m=b.baseline_m - a.baseline_m,
    )


def _spread(values: NDArray[np.float64]) -> DifferenceSpread:
    return DifferenceSpread(rms_px=float(np.sqrt(np.mean(values**2))), max_px=float(np.max(values)))


def _check_same_rig(a: Calibration, b: Calibration) -> None:
    sizes = [(c.rig_id, c.wide.width, c.wide.height, c.fovea_width, c.fovea_height) for c in (a, b)]
    if sizes[0] != sizes[1]:
        raise InvalidInput(
            f"calibrations {a.id} of rig {a.rig_id!r} and {b.id} of rig {b.rig_id!r} differ in rig or in "
            "image size; compare calibrations of one rig"
        )


def _common_field(a: Calibration, b: Calibration) -> tuple[float, float, float, float]:
    first, second = a.reach_rad(), b.reach_rad()
    field = (
        max(first[0], second[0]) + _MARGIN_RAD,
        min(first[1], second[1]) - _MARGIN_RAD,
        max(first[2], second[2]) + _MARGIN_RAD,
        min(first[3], second[3]) - _MARGIN_RAD,
    )
    if field[0] >= field[1] or field[2] >= field[3]:
        raise InvalidInput(f"calibrations {a.id} and {b.id} cover different fields; compare others")
    return field


def _covered(a: Calibration, b: Calibration, direction: tuple[float, float], distance_m: float) -> bool:
    point = point_from_direction(*direction, distance_m)
    return all(
        calibration.eye(role).mirror.contains(*eye_angles(point, calibration.pivot_rig_m(role)))
        for calibration in (a, b)
        for role in (Role.LEFT, Role.RIGHT)
    )


def _compare_at(
    a: Calibration, b: Calibration, direction: tuple[float, float], distance_m: float
) -> list[float]:
    """Return ax, ay, gaze differences (left x, y, right x, y), row mismatch and difference of disparity."""
    volts = a.steer(*direction, distance_m=distance_m)
    depth_m = float(point_from_direction(*direction, distance_m)[2])
    gazes: list[float] = []
    for role in (Role.LEFT, Role.RIGHT):
        centre = _raw_grid_px(a, nodes=1)
        seen = [_points_m(c, role, volts, raw_px=centre, depth_m=depth_m)[0] for c in (a, b)]
        gazes += (b.fovea_f_px / depth_m * (seen[1] - seen[0])[:2]).tolist()
    left_px = _raw_grid_px(a, nodes=3)
    points = _points_m(a, Role.LEFT, volts, raw_px=left_px, depth_m=depth_m)
    right_px = _raw_px(a, Role.RIGHT, volts, points_m=points, depth_m=depth_m)
    left = fovea_points_rays(b, Role.LEFT, volts.left, raw_px=left_px, depth_m=depth_m)
    right = fovea_points_rays(b, Role.RIGHT, volts.right, raw_px=right_px, depth_m=depth_m)
    columns_px, rows_px, _ = (b.fovea_f_px * (left - right)).T
    disparity_px = float(np.mean(columns_px)) - b.fovea_f_px * b.baseline_m / depth_m
    return [*direction, *gazes, float(np.sqrt(np.mean(rows_px**2))), disparity_px]


def _raw_grid_px(calibration: Calibration, *, nodes: int) -> NDArray[np.float64]:
    """Return (nodes², 2) raw px evenly over the middle four fifths of a fovea image, or its centre."""
    width, height = calibration.fovea_width - 1.0, calibration.fovea_height - 1.0
    side = np.linspace(0.1, 0.9, nodes) if nodes > 1 else np.array([0.5])
    return np.array([(width * x, height * y) for y in side for x in side])


def _points_m(
    calibration: Calibration,
    role: Role,
    volts: StereoVolts,
    *,
    raw_px: NDArray[np.float64],
    depth_m: float,
) -> NDArray[np.float64]:
    """Return the (n, 3) points, m, rig frame, at Z = `depth_m` that raw px (n, 2) of an eye show."""
    rays = fovea_points_rays(calibration, role, eye_volts(volts, role), raw_px=raw_px, depth_m=depth_m)
    points: NDArray[np.float64] = calibration.reference_rig_m(role) + depth_m * rays
    return points


def _raw_px(
    calibration: Calibration,
    role: Role,
    volts: StereoVolts,
    *,
    points_m: NDArray[np.float64],
    depth_m: float,
) -> NDArray[np.float64]:
    """Return the (n, 2) raw px of an eye that show points (n, 3) at Z = `depth_m`."""
    gaze = calibration.eye(role).mirror.angles_rad(eye_volts(volts, role))
    tangents = (points_m - calibration.reference_rig_m(role))[:, :2] / depth_m - np.tan(gaze)
    plane_from_raw = calibration.rectification(role, *gaze, depth_m=depth_m)
    raw_from_plane: NDArray[np.float64] = np.asarray(np.linalg.inv(plane_from_raw), np.float64)
    return homography_apply(raw_from_plane, calibration.fovea_f_px * tangents)


def _wide_difference(a: Calibration, b: Calibration) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (m, 2) raw wide px over the image, and the pixels of b for a's directions there, minus them."""
    at = np.array(
        [
            (x, y)
            for y in np.linspace(0.0, a.wide.height - 1.0, _WIDE_NODES)
            for x in np.linspace(0.0, a.wide.width - 1.0, _WIDE_NODES)
        ]
    )
    return at, b.wide.pixels(a.wide.angles_rad(at)) - at


def comparison_picture(comparison: CalibrationComparison) -> bytes:
    """Return a PNG: arrows for both eyes, row mismatch over the field, arrows over the wide image."""
    figure = new_figure((11.0, 8.6), dpi=_DPI)
    axes = figure.subplots(2, 2)
    at = np.rad2deg(comparison.directions_rad)
    _draw_arrows(axes[0, 0], at, comparison.gaze_left_px, title="left gaze, fovea px")
    _draw_arrows(axes[0, 1], at, comparison.gaze_right_px, title="right gaze, fovea px")
    _draw_rows(figure, axes[1, 0], at, comparison.epipolar_px)
    _draw_arrows(axes[1, 1], comparison.wide_at_px, comparison.wide_px, title="wide camera, px")
    for axis in (axes[0, 0], axes[0, 1], axes[1, 0]):
        axis.set_xlabel("ax, °")
        axis.set_ylabel("ay, °")
    axes[1, 1].set_xlabel("x, px")
    axes[1, 1].set_ylabel("y, px")
    figure.suptitle(
        f"{comparison.b} against {comparison.a} at {comparison.distance_m:g} m\n"
        f"gaze {comparison.pointing.rms_px:.2f} px rms, rows {comparison.epipolar.rms_px:.2f} px rms, "
        f"baseline {1e3 * comparison.baseline_m:+.2f} mm",
        fontsize=11,
    )
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def _draw_arrows(axis: "Axes", at: NDArray[np.float64], px: NDArray[np.float64], *, title: str) -> None:
    length = np.linalg.norm(px, axis=1)
    longest = max(float(length.max()), _LEAST_PX) * math.sqrt(len(at)) / _CELLS_LONG
    x, y, dx, dy = at[:, 0], at[:, 1], px[:, 0], px[:, 1]
    colours = axis.quiver(x, y, dx, dy, length, angles="xy", scale=longest, cmap="viridis")
    figure = axis.get_figure()
    if figure is not None:
        figure.colorbar(colours, ax=axis, shrink=0.8)
    rms = float(np.sqrt(np.mean(length**2)))
    axis.set_title(f"{title}: {rms:.2f} rms, {float(length.max()):.2f} at most", fontsize=10)
    axis.invert_yaxis()
    axis.set_aspect("equal")


def _draw_rows(figure: "Figure", axis: "Axes", at: NDArray[np.float64], px: NDArray[np.float64]) -> None:
    dots = axis.scatter(at[:, 0], at[:, 1], c=px, s=150, marker="s", cmap="magma")
    figure.colorbar(dots, ax=axis, shrink=0.8)
    axis.set_title("row mismatch between the eyes, fovea px", fontsize=10)
    axis.invert_yaxis()
    axis.set_aspect("equal")
