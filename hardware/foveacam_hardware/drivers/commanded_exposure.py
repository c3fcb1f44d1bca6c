"""Exposes the foveae by commands to their cameras, for a rig whose cameras have no trigger cable.

The mirrors rest before the commands are sent, and until the frames have come or cannot come any more. If
another caller steers a mirror meanwhile, the picture is blurred: no controller prevents it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from foveacam_hardware.contract import (
    Camera,
    Clock,
    ExposureReceipt,
    Mirrors,
    StereoVolts,
    Stopped,
    TriggerSource,
)

COMMAND_NS = 150_000_000
"""Longest time from a command to the start of its exposure, over a busy network to a slow camera."""
STEP_NS = 1_000_000
DRAIN_MS = 100.0


def by_command(cameras: Sequence[Camera]) -> bool:
    """Return whether all of these cameras wait for a command instead of the controller's pulse."""
    return all(camera.settings.trigger_source is TriggerSource.SOFTWARE for camera in cameras)


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandedExposure:
    """An exposure that was commanded; implements `PendingExposure`."""

    receipt: ExposureReceipt
    cameras: Sequence[Camera]
    latest_ns: int
    parks: int
    mirrors: Mirrors
    clock: Clock

    def wait(self) -> ExposureReceipt:
        """Wait until it is over; raise `Stopped` when the mirrors were parked meanwhile."""
        while not all(camera.waiting for camera in self.cameras) and self.clock.now_ns() < self.latest_ns:
            self.clock.sleep_until_ns(self.clock.now_ns() + STEP_NS)
        if self.mirrors.state.parks != self.parks:
            raise Stopped("foveae: the mirrors were parked during the exposure; look again")
        return self.receipt


class CommandedExposer:
    """Steers, waits for the mirrors to settle, and commands the cameras to expose; used by one thread."""

    def __init__(self, mirrors: Mirrors, clock: Clock) -> None:
        self._mirrors = mirrors
        self._clock = clock
        self._count = 0

    def begin(self, volts: StereoVolts, cameras: Sequence[Camera], *, settle_us: int) -> CommandedExposure:
        """Expose these cameras once the mirrors rest at `volts`; return when the exposure has been commanded.

        Raise what `Mirrors.steer` and `Camera.software_trigger` raise.
        """
        parks = self._mirrors.state.parks
        actual = self._mirrors.steer(volts, unless_parked_since=parks)
        self._clock.sleep_until_ns(self._clock.now_ns() + settle_us * 1000)
        for camera in cameras:
            while camera.waiting:  # frames of earlier exposures
                camera.read(timeout_ms=DRAIN_MS)
        began_ns = self._clock.now_ns()
        for camera in cameras:
            camera.software_trigger()
        self._count += 1
        longest_ns = max(camera.settings.exposure_ns for camera in cameras)
        return CommandedExposure(
            receipt=ExposureReceipt(
                frame_id=self._count, t_trigger_ns=began_ns, t_exposure_start_ns=began_ns, volts=actual
            ),
            cameras=cameras,
            latest_ns=began_ns + COMMAND_NS + longest_ns,
            parks=parks,
            mirrors=self._mirrors,
            clock=self._clock,
        )
