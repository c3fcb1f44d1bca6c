"""How often both foveae can be triggered: the budget of one look, from the move to the next trigger."""

from dataclasses import dataclass

from foveacam_hardware.contract.errors import InvalidInput

MARGIN_US = 500
"""Between the end of one look and the next move."""
SAME_SHARE = 0.01
"""By how much of the longer one both eyes' exposures may differ: each camera rounds to lines of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TriggerBudget:
    """One pulse exposes both eyes, as long as the longer exposure; looks may follow each other so closely."""

    pulse_us: float
    interval_us: float

    @property
    def interval_ms(self) -> float:
        """The same in ms."""
        return self.interval_us / 1e3

    @property
    def rate_hz(self) -> float:
        """Looks a second."""
        return 1e6 / self.interval_us


def trigger_budget(
    exposures_us: tuple[float, float], most_rates_hz: tuple[float, float], *, settle_us: float
) -> TriggerBudget:
    """Return the budget of (left, right): settle, then the slower eye's exposure or frame, then a margin.

    `most_rates_hz`: at which each camera can deliver; its readout overlaps the next move, not the next frame.
    Raise InvalidInput for times and rates that cannot be.
    """
    if not (min(exposures_us) > 0.0 and min(most_rates_hz) > 0.0 and settle_us >= 0.0):
        raise InvalidInput(
            f"trigger budget: exposures {exposures_us} µs and rates {most_rates_hz} Hz must be above 0, "
            f"the settle time {settle_us} µs not below; give what both cameras run with"
        )
    eyes = zip(exposures_us, most_rates_hz, strict=True)
    slowest_us = max(max(exposure_us, 1e6 / rate_hz) for exposure_us, rate_hz in eyes)
    return TriggerBudget(pulse_us=max(exposures_us), interval_us=settle_us + slowest_us + MARGIN_US)


def same_exposure(left_ns: int, right_ns: int) -> bool:
    """Tell whether one pulse can expose both eyes: their exposures are alike but for rounding."""
    return abs(left_ns - right_ns) <= SAME_SHARE * max(left_ns, right_ns)
