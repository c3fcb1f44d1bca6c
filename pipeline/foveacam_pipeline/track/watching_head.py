"""Head wrapper for other procedures: passes their wide frames to a tracker, and lets others look between."""

from collections.abc import Callable

from foveacam_hardware.contract import Frame, Head, LookOptions, Sighting, StereoVolts


class WatchingHead:
    """Wraps a head and calls `see_wide` with every wide frame that it returns.

    `before_look`: called before each look, for looks of the caller's own with the wrapped head.
    """

    def __init__(
        self,
        head: Head,
        see_wide: Callable[[Frame], None],
        *,
        before_look: Callable[[], None] = lambda: None,
    ) -> None:
        self._head = head
        self._see_wide = see_wide
        self._before_look = before_look

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Look with the wrapped head."""
        self._before_look()
        sighting = self._head.look(volts, options=options)
        self._see_wide(sighting.wide)
        return sighting

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        frame = self._head.wide(max_age_ms=max_age_ms)
        self._see_wide(frame)
        return frame

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set exposure and gain of both foveae."""
        self._head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the drive filters."""
        return self._head.set_low_pass(cutoff_hz)
