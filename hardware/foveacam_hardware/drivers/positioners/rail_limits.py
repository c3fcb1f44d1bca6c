"""Refuses places that a rail cannot reach, whatever its make."""

from foveacam_hardware.contract import OutOfRange, RailLimits

SLACK_M = 1e-9


def check_position(position_m: float, limits: RailLimits, *, name: str) -> None:
    """Raise `OutOfRange` for a place beyond the limits, or one that is no number."""
    if not limits.min_m - SLACK_M <= position_m <= limits.max_m + SLACK_M:
        raise OutOfRange(
            f"{name}: {1e3 * position_m:.1f} mm is outside {1e3 * limits.min_m:g} to"
            f" {1e3 * limits.max_m:g} mm; choose a place inside"
        )
