"""Judges whether a live view comes at the rate that it should, and why it does not."""

from dataclasses import dataclass

from foveacam_hardware.contract import CameraLink, CameraSettings

SLOW_SHARE = 0.5
"""Share of the expected rate below which a view counts as slow."""
SLOW_AFTER_NS = 3_000_000_000
"""Time for which a view must be slow before it counts: a look of both eyes may halve a rate for a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedRate:
    """The rate at which a view should come, and what explains a lower one."""

    rate_hz: float
    reason: str


class ViewPace:
    """Whether one view is slow. Not thread-safe."""

    def __init__(self) -> None:
        self.expected: ExpectedRate | None = None
        self._slow_since_ns: int | None = None

    def expect(self, expected: ExpectedRate | None, *, rate_hz: float, now_ns: int) -> None:
        """Compare the measured rate with the expected one; None: no rate is promised now."""
        self.expected = expected
        if expected is None or rate_hz >= SLOW_SHARE * expected.rate_hz:
            self._slow_since_ns = None
        elif self._slow_since_ns is None:
            self._slow_since_ns = now_ns

    def slow_reason(self, now_ns: int) -> str | None:
        """Return why the view has been slow for `SLOW_AFTER_NS`; None while it has not."""
        if self.expected is None or self._slow_since_ns is None:
            return None
        return self.expected.reason if now_ns - self._slow_since_ns >= SLOW_AFTER_NS else None


def expected_rate(
    limit_hz: float, settings: CameraSettings, *, link: CameraLink, simulated: bool
) -> ExpectedRate:
    """Return the rate of a live view: the server's limit, or that which the camera is set to.

    `limit_hz`: at which the server asks for pictures.
    """
    rate_hz = min(limit_hz, settings.frame_rate_hz)
    exposure_ms = settings.exposure_ns / 1e6
    if exposure_ms > 1e3 / (SLOW_SHARE * rate_hz):
        reason = f"an exposure of {exposure_ms:.0f} ms allows {1e3 / exposure_ms:.1f} a second at most"
    elif link.reason:
        reason = link.reason
    elif simulated:
        reason = "this computer draws the simulated scene no faster; other programs and pages may slow it"
    else:
        reason = "the camera delivers no more, or the computer is busy"
    return ExpectedRate(rate_hz=rate_hz, reason=reason)
