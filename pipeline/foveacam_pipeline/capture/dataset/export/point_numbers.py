"""The numbers of an exposure as Hugging Face and OME-Zarr store them: its point, times, gazes, volts."""

from foveacam_hardware.contract import Role
from foveacam_pipeline.capture.dataset.reader import DatasetPoint

NUMBERS = ("point", "scan", "column", "row", "bracket", "left_t_ns", "right_t_ns", "exposure_ns")
ANGLES = (
    "left_ax_rad", "left_ay_rad", "right_ax_rad", "right_ay_rad", "left_x_v", "left_y_v", "right_x_v",
    "right_y_v", "aim_ax_rad", "aim_ay_rad", "distance_m", "rail_m",
)  # fmt: skip


def numbers_of(point: DatasetPoint, bracket: int) -> dict[str, int | float | None]:
    """Return the numbers of one bracket of a point by the names of `NUMBERS` and `ANGLES`."""
    place = point.place
    left, right = (
        next((f for f in point.frames if f.role is role and f.bracket == bracket), None)
        for role in (Role.LEFT, Role.RIGHT)
    )
    gazes = (left and left.gaze_rad, right and right.gaze_rad)
    drives = (left and left.volts_v, right and right.volts_v)
    numbers = (place.index, place.scan, place.column, place.row, bracket)
    times = (
        None if left is None else left.t_ns,
        None if right is None else right.t_ns,
        None if left is None else left.exposure_ns,
    )
    pairs = [value for pair in (*gazes, *drives, place.aim_rad) for value in (pair or (None, None))]
    return {
        **dict(zip(NUMBERS, (*numbers, *times), strict=True)),
        **dict(zip(ANGLES, (*pairs, place.distance_m, place.rail_m), strict=True)),
    }
