"""Implements the contract's Head with two triggered foveae and a free-running wide camera.

Steers and exposes through the controller, then identifies the frames of that trigger by their times. Foveae
that are set to software trigger are exposed by commands instead.
"""

import logging
from dataclasses import replace

import numpy as np

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    Clock,
    DeviceFault,
    ExposureReceipt,
    Frame,
    InvalidInput,
    LookOptions,
    Mirrors,
    MirrorVolts,
    PendingExposure,
    Role,
    Sighting,
    StereoVolts,
    Timeout,
    same_exposure,
)
from foveacam_hardware.contract.spans import span
from foveacam_hardware.drivers.commanded_exposure import COMMAND_NS, CommandedExposer, by_command

logger = logging.getLogger(__name__)

READ_TIMEOUT_MS = 1000.0
CLOCK_TOLERANCE_NS = 2_000_000
"""Tolerance of a frame's time, above the error of the controller's clock and far below a frame period."""
MOST_UNCERTAINTY_NS = 10_000_000
"""Largest further tolerance for an uncertain clock; two looks are 14 ms (settling) + 8 (exposure) apart."""
PULSE_DIVISOR = 2
"""The trigger pulse ends by the middle of the exposure, as it must never outlast one."""
LONGEST_AFTER_PULSE_US = 4000
"""Longest exposure beyond the end of the pulse: the controller gives up 5 ms after the pulse."""


class TriggeredHead:
    """Exposes both foveae by one pulse and adds the wide frame of that time; used by one thread."""

    def __init__(
        self,
        mirrors: Mirrors,
        left: Camera,
        right: Camera,
        wide: Camera,
        *,
        clock: Clock,
        settle_us: int,
        pulse_us: int,
    ) -> None:
        self._mirrors = mirrors
        self._left = left
        self._right = right
        self._wide = wide
        self._clock = clock
        self._commands = CommandedExposer(mirrors, clock)
        self.settle_us = settle_us
        self.pulse_us = pulse_us

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        """Steer, settle and expose both foveae; return their frames with a wide frame not older than them."""
        wait_us = self.settle_us if options.settle_us is None else options.settle_us
        with span("mirrors move, settle, expose", settle_us=wait_us):
            receipt = self._expose(volts, wait_us, missing=options.missing)
        with span("frames"):
            return self._sighting(receipt, missing=options.missing)

    def begin(self, volts: StereoVolts, *, settle_us: int) -> PendingExposure:
        """Begin to steer, settle and expose both foveae; the previous frames can be read meanwhile."""
        pulse_us, cameras = self._pulse_us(), self._present(None)
        if by_command(cameras):
            return self._commands.begin(volts, cameras, settle_us=settle_us)
        return self._mirrors.begin_exposure(volts, settle_us=settle_us, pulse_us=pulse_us)

    def frames_of(self, receipt: ExposureReceipt) -> tuple[Frame, Frame]:
        """Return both foveae's frames of a finished exposure."""
        return self.frame_of(Role.LEFT, receipt), self.frame_of(Role.RIGHT, receipt)

    def frame_of(self, role: Role, receipt: ExposureReceipt) -> Frame:
        """Return one fovea's frame of a finished exposure."""
        if role is Role.LEFT:
            return self._frame(self._left, receipt, receipt.volts.left)
        if role is Role.RIGHT:
            return self._frame(self._right, receipt, receipt.volts.right)
        raise InvalidInput("the wide camera runs freely: ask for a frame since a moment instead")

    def wide_since(self, t_ns: int) -> Frame:
        """Return the newest wide frame whose `Frame.t_ns` is `t_ns` or later, waiting for it if necessary."""
        return self._wides_until(t_ns)[-1]

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        """Return a recent wide frame without moving anything."""
        return self._wide.latest(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        """Set exposure and gain of both foveae, with automatic exposure off."""
        for camera in (self._left, self._right):
            by_hand = replace(camera.settings, exposure_auto=AutoMode.OFF)
            camera.configure(replace(by_hand, exposure_ns=exposure_ns, gain_db=gain_db))

    def set_low_pass(self, cutoff_hz: int) -> int:
        """Set the cut-off of the drive filters, Hz; return the previous one."""
        before_hz = self._mirrors.low_pass_hz
        self._mirrors.set_low_pass(cutoff_hz)
        return before_hz

    def _sighting(self, receipt: ExposureReceipt, *, missing: Role | None) -> Sighting:
        """Return all cameras' frames of an exposure."""
        first, *others = (camera.role for camera in self._present(missing))
        frames = {first: self.frame_of(first, receipt)}
        middle_ns = receipt.middle_ns(exposure_ns=self._exposure_ns(missing))
        # The wide camera runs freely: its frame comes up to a period later, and the other fovea is read
        # meanwhile. Where reading takes long, the wide frame comes first: a newer one would replace it.
        wides = self._wides_until(middle_ns) if self._clock.now_ns() >= self._wide_by_ns(middle_ns) else []
        frames |= {role: self.frame_of(role, receipt) for role in others}
        wides = wides or self._wides_until(middle_ns)
        left = frames.get(Role.LEFT) or _black(frames[first], Role.LEFT, receipt.volts.left)
        right = frames.get(Role.RIGHT) or _black(frames[first], Role.RIGHT, receipt.volts.right)
        # the foveae's times come from another clock
        self._read_until(wides, until_ns=max(left.t_ns, right.t_ns))
        *before, wide = wides
        return Sighting(
            left=left,
            right=right,
            wide=wide,
            volts=receipt.volts,
            wide_before=tuple(before),
            missing=missing,
            exposure_after_trigger_ns=receipt.t_exposure_start_ns - receipt.t_trigger_ns,
        )

    def _expose(self, volts: StereoVolts, settle_us: int, *, missing: Role | None) -> ExposureReceipt:
        pulse_us, cameras = self._pulse_us(missing), self._present(missing)
        if by_command(cameras):
            return self._commands.begin(volts, cameras, settle_us=settle_us).wait()
        return self._mirrors.expose(volts, settle_us=settle_us, pulse_us=pulse_us, without=missing)

    def _wides_until(self, t_ns: int) -> list[Frame]:
        """Return the unread wide frames, oldest first; the last one is of `t_ns` or later."""
        frames = [self._wide.read(timeout_ms=READ_TIMEOUT_MS) for _ in range(self._wide.waiting)]
        if not frames:
            age_ms = max(0.0, (self._clock.now_ns() - t_ns) / 1e6)
            frames.append(self._wide.latest(max_age_ms=age_ms))
        self._read_until(frames, until_ns=t_ns)
        return frames

    def _wide_by_ns(self, t_ns: int) -> int:
        """Return when a wide frame of `t_ns` or later has surely ended its exposure."""
        settings = self._wide.settings
        return t_ns + round(1e9 / settings.frame_rate_hz) + settings.exposure_ns

    def _read_until(self, wides: list[Frame], *, until_ns: int) -> None:
        """Append wide frames until one is of `until_ns` or later."""
        while wides[-1].t_ns < until_ns:
            wides.append(self._wide.read(timeout_ms=READ_TIMEOUT_MS))

    def _present(self, missing: Role | None) -> list[Camera]:
        return [camera for camera in (self._left, self._right) if camera.role is not missing]

    def _exposure_ns(self, missing: Role | None) -> int:
        """Return the exposure in force, the longer one where the foveae round differently."""
        return max(camera.settings.exposure_ns for camera in self._present(missing))

    def _pulse_us(self, missing: Role | None = None) -> int:
        cameras = self._present(missing)
        for camera in cameras:
            _require_manual_trigger(camera)
        left_ns, right_ns = cameras[0].settings.exposure_ns, cameras[-1].settings.exposure_ns
        if not same_exposure(left_ns, right_ns):
            raise InvalidInput(
                f"foveae: one pulse exposes both, but left is set to {left_ns / 1e6:g} ms and right to"
                f" {right_ns / 1e6:g} ms; give both the same exposure"
            )
        shorter_us, longer_us = min(left_ns, right_ns) // 1000, max(left_ns, right_ns) // 1000
        return max(min(self.pulse_us, shorter_us // PULSE_DIVISOR), longer_us - LONGEST_AFTER_PULSE_US)

    def _frame(self, camera: Camera, receipt: ExposureReceipt, volts: MirrorVolts) -> Frame:
        """Return the camera's frame of this trigger; frames of earlier triggers are dropped."""
        clock_ns = CLOCK_TOLERANCE_NS + min(receipt.clock_uncertainty_ns, MOST_UNCERTAINTY_NS)
        early_ns, before_ns = camera.settings.exposure_ns // 2 + clock_ns, None
        late_by_ns = early_ns + (COMMAND_NS if by_command([camera]) else 0)
        while True:
            try:
                frame = camera.read(timeout_ms=READ_TIMEOUT_MS)
            except Timeout as silence:
                raise _no_frame(camera, receipt, silence, before_ns=before_ns) from silence
            late_ns = frame.t_ns - receipt.middle_ns(exposure_ns=frame.exposure_ns)
            if -early_ns <= late_ns <= late_by_ns:
                return frame.with_volts(volts, frame_id=receipt.frame_id)
            if late_ns > 0:
                raise DeviceFault(
                    f"camera {camera.role}: the frame of exposure {receipt.frame_id} is missing, the next one"
                    f" came {late_ns / 1e6:.1f} ms after it; check for a second trigger source or lost frames"
                )
            logger.debug("camera %s: dropped a frame %.1f ms old", camera.role, -late_ns / 1e6)
            before_ns = -late_ns


def _no_frame(
    camera: Camera, receipt: ExposureReceipt, silence: Timeout, *, before_ns: int | None
) -> DeviceFault:
    """Return the fault; `before_ns`: how much older the last dropped frame was, None without one."""
    counted = camera.counters
    older = "" if before_ns is None else f"; the one before is {before_ns / 1e6:.1f} ms older"
    return DeviceFault(
        f"camera {camera.role}: exposure {receipt.frame_id} was triggered and no frame came"
        f" ({silence}; since its start {counted.delivered} frames came and {counted.dropped} were lost"
        f"{older}); check its cables and its trigger setting"
    )


def _black(other: Frame, role: Role, volts: MirrorVolts) -> Frame:
    """Return a black frame for a missing camera, of the other fovea's size."""
    return replace(other, image=np.zeros_like(other.image), role=role, volts=volts)


def _require_manual_trigger(camera: Camera) -> None:
    """Raise `InvalidInput` for a fovea that runs freely or sets its exposure itself."""
    if not camera.settings.triggered:
        raise InvalidInput(f"camera {camera.role}: it runs freely; configure it as triggered")
    if camera.settings.exposure_auto is not AutoMode.OFF:
        raise InvalidInput(
            f"camera {camera.role}: it sets its exposure itself, and one pulse exposes both foveae alike;"
            " switch that off"
        )
