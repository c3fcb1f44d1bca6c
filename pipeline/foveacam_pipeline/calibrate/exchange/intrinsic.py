"""Conversion of the authors' intrinsic records to our intrinsics and back."""

import base64
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.calibrate.exchange.canonical import Json
from foveacam_pipeline.calibrate.exchange.documents import TypedArray
from foveacam_pipeline.calibrate.exchange.record import ExchangeRecord, RecordKind
from foveacam_pipeline.models.intrinsics import Intrinsics

COEFFICIENTS = (4, 5, 8, 12, 14)
"""Numbers of distortion coefficients of OpenCV's models."""


def intrinsics_of(record: ExchangeRecord, *, size: tuple[int, int] | None = None) -> Intrinsics:
    """Return the wide camera's intrinsics of a record; refuse one of another `size`: (width, height), px."""
    record.check(kind=RecordKind.INTRINSIC, role=Role.WIDE)
    solve = record.intrinsic().calibration
    found = solve.sensor_size.width, solve.sensor_size.height
    if size is not None and found != size:
        raise InvalidInput(
            f"record {record.id} is of a camera of {found[0]} x {found[1]} px, this one has "
            f"{size[0]} x {size[1]}; give the record of this camera"
        )
    matrix = _checked_matrix(_values(solve.camera_matrix), record.id)
    coefficients = _values(solve.dist_coeffs).ravel()
    if len(coefficients) not in COEFFICIENTS:
        raise InvalidInput(
            f"record {record.id}: {len(coefficients)} distortion coefficients, {COEFFICIENTS} are known; "
            "export the record again"
        )
    return Intrinsics(
        width=found[0],
        height=found[1],
        fx_px=float(matrix[0, 0]),
        fy_px=float(matrix[1, 1]),
        cx_px=float(matrix[0, 2]),
        cy_px=float(matrix[1, 2]),
        distortion=tuple(float(value) for value in coefficients),
    )


def intrinsic_record(
    intrinsics: Intrinsics,
    *,
    created_utc: str,
    label: str | None = None,
    rms_px: float | None = None,
    views: Sequence[tuple[ArrayLike, ArrayLike]] = (),
) -> ExchangeRecord:
    """Return our intrinsics as a record; `views`: rotation and translation vectors, (3,) each, if known."""
    solve: dict[str, Json] = {
        "sensor_size": {"width": intrinsics.width, "height": intrinsics.height},
        "camera_matrix": typed_array(intrinsics.matrix),
        "dist_coeffs": typed_array(np.array([intrinsics.distortion])),
        "rvecs": [typed_array(np.asarray(view[0], dtype=np.float64).reshape(3, 1)) for view in views],
        "tvecs": [typed_array(np.asarray(view[1], dtype=np.float64).reshape(3, 1)) for view in views],
    }
    if rms_px is not None:
        solve["rms"] = rms_px
    return ExchangeRecord(
        kind=RecordKind.INTRINSIC,
        inner={"kind": RecordKind.INTRINSIC.value, "calibration": solve},
        created_utc=created_utc,
        label=label,
        role=Role.WIDE,
    )


def typed_array(values: NDArray[np.float64]) -> dict[str, Json]:
    """Return the document of a float64 array in the authors' format."""
    data = np.ascontiguousarray(values, dtype="<f8")
    return {
        "type": "Float64Array",
        "buffer": base64.b64encode(data.tobytes()).decode("ascii"),
        "props": {"shape": list(data.shape), "channels": 1},
    }


def _values(field: TypedArray | list[float] | list[list[float]]) -> NDArray[np.float64]:
    return field.values() if isinstance(field, TypedArray) else np.array(field, dtype=np.float64)


def _checked_matrix(matrix: NDArray[np.float64], record_id: str) -> NDArray[np.float64]:
    if matrix.shape == (9,):
        matrix = matrix.reshape(3, 3)
    plain_camera = matrix.shape == (3, 3) and bool(
        (matrix[[0, 1], [0, 1]] > 0.0).all()
        and np.array_equal(matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]], [0.0, 0.0, 0.0, 0.0, 1.0])
    )
    if not plain_camera:
        raise InvalidInput(
            f"record {record_id}: its camera matrix {matrix.tolist()} is no camera's "
            "(fx, 0, cx; 0, fy, cy; 0, 0, 1 is needed); export the record again"
        )
    return matrix
