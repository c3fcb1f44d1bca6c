"""Looking at a recording: the next recorded look comes, wherever one wanted to look."""

from foveacam_hardware.contract import (
    PARKED,
    Camera,
    Clock,
    Frame,
    InvalidInput,
    Sighting,
    StereoVolts,
)

SHARE = 0.5
"""Of a frame period: how far apart in time the eyes of one look may be."""


class ReplayHead:
    """Implements the contract's Head. `look` waits for the next recorded exposure of the left eye.

    The volts that are asked are ignored; the sighting carries the recorded ones (parked where none were
    recorded), so that whoever reckons with them reckons right.
    """

    def __init__(self, left: Camera, right: Camera, wide: Camera, *, clock: Clock) -> None:
        self._left = left
        self._right = right
        self._wide = wide
        self._clock = clock
        self.settle_us = 0

    def look(self, volts: StereoVolts, *, settle_us: int | None = None) -> Sighting:
        """Return the next recorded pair, and the wide frame of that moment or the first one after it."""
        left = _since(self._left, self._clock.now_ns(), now_ns=self._clock.now_ns())
        period_ns = 1e9 / self._left.settings.frame_rate_hz
        from_ns = left.t_ns - round(SHARE * period_ns)
        right = _since(self._right, from_ns, now_ns=self._clock.now_ns())
        wide = _since(self._wide, from_ns, now_ns=self._clock.now_ns())
        drive = StereoVolts(left=left.volts or PARKED.left, right=right.volts or PARKED.right)
        return Sighting(left=left, right=right, wide=wide, volts=drive)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        return self._wide.latest(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Refuse, unless nothing would change."""
        for camera in (self._left, self._right):
            now = camera.settings
            if (exposure_ns, gain_db) != (now.exposure_ns, now.gain_db):
                raise InvalidInput(
                    f"camera {camera.role}: asked for {exposure_ns / 1e6:g} ms and {gain_db:g} dB, but it"
                    f" plays a recording made with {now.exposure_ns / 1e6:g} ms; open a rig to expose anew"
                )

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Refuse: the recorded mirrors cannot be filtered anew."""
        raise InvalidInput(
            f"mirrors: asked to run at {cutoff_hz} Hz, but they are those of a recording; open a rig"
        )


def _since(camera: Camera, t_ns: int, *, now_ns: int) -> Frame:
    """Return a frame exposed at `t_ns` or later."""
    frame = camera.latest(max_age_ms=max(0.0, (now_ns - t_ns) / 1e6))
    while frame.t_ns < t_ns:
        frame = camera.read()
    return frame
