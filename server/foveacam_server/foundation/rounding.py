"""Rounds values for JSON: degrees and decimals."""

import math


def deg(angle_rad: float) -> float:
    """Return degrees to 1e-5 (a fortieth of a fovea pixel)."""
    return round(math.degrees(angle_rad), 5)


def rounded(value: float | None, digits: int) -> float | None:
    """Return `value` to so many digits; None when there is none, or none that JSON can carry."""
    return None if value is None or not math.isfinite(value) else round(value, digits)
