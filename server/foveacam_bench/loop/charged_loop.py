"""A vergence loop on a simulated rig in virtual time, whose looks are charged for computing."""

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.track.following import COMPUTE_S
from foveacam_hardware.contract import Binning, Frame, Head, LookOptions, Sighting, StereoVolts
from foveacam_hardware.rig import Rig
from foveacam_pipeline.continuous_loop.settings import AXES, LoopSettings
from foveacam_pipeline.continuous_loop.vergence_loop import LoopStep, VergenceLoop
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras


def certificate(preset: str) -> Path:
    """Return the shipped calibration of a simulated rig's preset."""
    return SHIPPED / f"sim-{preset}.json"


class ChargedLoop:
    """Steps a loop and charges each step `COMPUTE_S` of the rig's time."""

    def __init__(
        self, rig: Rig, *, preset: str = "rig120", settings: LoopSettings, binning: Binning = 1
    ) -> None:
        if binning > 1:
            bin_cameras(rig, binning)
        self.calibration: Calibration = load_calibration(certificate(preset))
        self.loop = VergenceLoop(self.calibration, clock=rig.clock, settings=settings)
        self.compute_ms: list[float] = []
        """Time of every step without the rig's."""
        self._clock = rig.clock
        self._head = _TimedHead(rig.head)

    def choose(self, pixel: tuple[float, float], *, inverse_z_per_m: float) -> None:
        """Look at a wide pixel."""
        target = np.tan(self.calibration.wide.angles_rad([pixel])[0])
        self.loop.choose(self._head.wide(), target, inverse_z_per_m=inverse_z_per_m)

    def step(self) -> LoopStep:
        """Make one look of the loop."""
        began_s, rig_before_s = time.perf_counter(), self._head.busy_s
        done = self.loop.step(self._head)
        rig_s = self._head.busy_s - rig_before_s
        self.compute_ms.append(1e3 * (time.perf_counter() - began_s - rig_s))
        self._clock.sleep_until_ns(self._clock.now_ns() + round(1e9 * COMPUTE_S))
        return done

    def rest_at(self, commands_rad: NDArray[np.float64]) -> None:
        """Set all commands, (4,) rad, and the references to 0."""
        self.loop.reference_rad[:] = 0.0
        for axis, command_rad in zip(AXES, commands_rad.tolist(), strict=True):
            self.loop.set_command(axis, command_rad)


class _TimedHead:
    """A head that counts the time it is busy, s."""

    def __init__(self, head: Head) -> None:
        self._head = head
        self.busy_s = 0.0

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Look as the head does."""
        began_s = time.perf_counter()
        try:
            return self._head.look(volts, options=options)
        finally:
            self.busy_s += time.perf_counter() - began_s

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame."""
        began_s = time.perf_counter()
        try:
            return self._head.wide(max_age_ms=max_age_ms)
        finally:
            self.busy_s += time.perf_counter() - began_s

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set exposure and gain of both foveae."""
        self._head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the drive filters."""
        return self._head.set_low_pass(cutoff_hz)
