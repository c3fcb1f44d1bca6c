"""The length between two points, with correct treatment of the errors that both share."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.measure.point import MeasuredPoint


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredLength:
    """Length and components of the vector between two points, m, rig frame, with standard errors."""

    length_m: float
    length_sigma_m: float
    delta_rig_m: tuple[float, float, float]
    delta_sigma_m: tuple[float, float, float]
    same_look: bool


def length_between(first: MeasuredPoint, second: MeasuredPoint) -> MeasuredLength:
    """Return the length from `first` to `second`.

    Points of one look share its pose errors: a sideways shift cancels, an error of depth scales the length.
    Points of different looks count as independent.
    """
    vector = second.point_rig_m - first.point_rig_m
    same = first.look_id is not None and first.look_id == second.look_id
    cov = _vector_cov(first, second, same=same)
    length_m = float(np.linalg.norm(vector))
    x_m, y_m, z_m = vector.tolist()
    sx_m, sy_m, sz_m = np.sqrt(np.diag(cov)).tolist()
    return MeasuredLength(
        length_m=length_m,
        length_sigma_m=_length_sigma_m(vector, cov),
        delta_rig_m=(x_m, y_m, z_m),
        delta_sigma_m=(sx_m, sy_m, sz_m),
        same_look=same,
    )


def _length_sigma_m(vector: NDArray[np.float64], cov: NDArray[np.float64]) -> float:
    """Return the rms error of the length: first order along the vector, second order across it.

    An error across always lengthens, by |across|^2 / (2 length), which matters for short lengths.
    """
    whole = max(0.0, float(np.trace(cov)))
    length_m = float(np.linalg.norm(vector))
    if length_m <= math.sqrt(whole):
        return math.sqrt(whole)
    along = vector / length_m
    normal = np.eye(3) - np.outer(along, along)
    across = normal @ cov @ normal
    second = (np.trace(across @ across) / 2.0 + (np.trace(across) / 2.0) ** 2) / length_m**2
    return math.sqrt(min(whole, max(0.0, float(along @ cov @ along)) + float(second)))


def _vector_cov(first: MeasuredPoint, second: MeasuredPoint, *, same: bool) -> NDArray[np.float64]:
    if not same:
        return first.cov_m2 + second.cov_m2
    spread = (second.pose_jacobian - first.pose_jacobian) * first.pose_sigma_px
    return np.asarray(first.own_cov_m2 + second.own_cov_m2 + spread @ spread.T, dtype=np.float64)
