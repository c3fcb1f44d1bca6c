"""Text of measured values with their standard errors, for one-line descriptions."""

import math


def measured_text(value: float, sigma: float | None, unit: str) -> str:
    """Return a value and its standard error with two significant digits, such as `2.0013 ± 0.0012 m`."""
    if sigma is None or not math.isfinite(sigma) or sigma <= 0.0:
        return f"{value:.4g} {unit}"
    digits = min(9, max(0, 1 - math.floor(math.log10(sigma))))
    return f"{value:.{digits}f} ± {sigma:.{digits}f} {unit}"


def distance_text(distance_m: float | None, sigma_m: float | None) -> str:
    """Return a distance with its standard error; say where it is not known."""
    return "unknown distance" if distance_m is None else measured_text(distance_m, sigma_m, "m")


def shortened(text: str, *, at_most: int = 60) -> str:
    """Return a text on one line, cut where it is longer than `at_most` characters."""
    line = " ".join(text.split())
    return line if len(line) <= at_most else f"{line[: at_most - 1]}…"
