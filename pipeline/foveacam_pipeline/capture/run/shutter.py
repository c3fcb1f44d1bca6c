"""Exposes both foveae shot by shot: the mirrors move to the next point while the last image is read out.

A shot whose frames do not arrive is repeated, a given number of times.
"""

import logging
import math
from dataclasses import replace

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraSettings,
    DeviceFault,
    FoveaError,
    Frame,
    PendingExposure,
    StereoVolts,
    Timeout,
    TriggerHead,
)
from foveacam_hardware.contract.spans import span
from foveacam_pipeline.capture.run.access import CaptureRig, RigAccess, trigger_head
from foveacam_pipeline.capture.run.values import FoveaPair, ShotPlan

logger = logging.getLogger(__name__)

MARGIN_US = 500
"""Time between the end of one readout and the next one's."""


class ShotTaker:
    """Takes shots through a `RigAccess`; for use by one thread at a time."""

    def __init__(self, access: RigAccess, *, tries: int) -> None:
        self._access = access
        self._tries = tries
        self._pending: tuple[ShotPlan, PendingExposure] | None = None
        self._commanded: StereoVolts | None = None
        self._before: tuple[CameraSettings, CameraSettings] | None = None
        self._asked_ns: int | None = None
        self._ended_ns = access.clock.now_ns()

    @property
    def ended_ns(self) -> int:
        """When the last exposure ended or was discarded; later wide frames belong to the next shot."""
        return self._ended_ns

    def capture_shot(self, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        """Take one shot and return its frames; the following shot has then begun where that is possible."""
        return self._access.run_moving(lambda rig: self._capture_with_retries(rig, shot, following))

    def wide_since(self, t_ns: int) -> Frame:
        """Return the newest wide frame exposed at `t_ns` or later."""
        return self._access.run_still(lambda rig: trigger_head(rig).wide_since(t_ns))

    def discard_pending(self) -> None:
        """Let a pending exposure end without using it; the next shot steers anew."""
        if self._pending is not None:
            self._access.run_still(lambda _: self._await_pending())
        self._commanded = None
        self._ended_ns = self._access.clock.now_ns()

    def close(self) -> None:
        """End a pending exposure, and restore the settings of both cameras."""
        self.discard_pending()
        before, self._before, self._asked_ns = self._before, None, None
        if before is not None:
            self._access.run_still(lambda rig: _configure((rig.left, rig.right), before))

    def _capture_with_retries(self, rig: CaptureRig, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        last: FoveaError | None = None
        for _ in range(self._tries):
            try:
                return self._capture_once(rig, shot, following)
            except (Timeout, DeviceFault) as error:
                logger.info("a shot is taken again: %s", error)
                last = error
                self._await_pending()
                self._commanded = None
        raise DeviceFault(
            f"capture: an exposure was tried {self._tries} times and its frames did not come ({last})",
            asked="an exposure of both foveae",
            found=str(last),
            remedy="correct that, then resume the capture",
        ) from last

    def _capture_once(self, rig: CaptureRig, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        head = trigger_head(rig)
        exposure = self._begun_exposure(rig, head, shot)
        self._pending = None
        with span("mirrors move, settle, expose"):
            receipt = exposure.wait()
        exposure_ns = max(eye.settings.exposure_ns for eye in (rig.left, rig.right))
        self._ended_ns = receipt.end_ns(exposure_ns=exposure_ns)
        if following is not None and _may_overlap(shot, following):
            self._pending = following, self._begin(rig, head, following)
        with span("frames"):
            left, right = head.frames_of(receipt)
        return FoveaPair(left=left, right=right)

    def _begun_exposure(self, rig: CaptureRig, head: TriggerHead, shot: ShotPlan) -> PendingExposure:
        if self._pending is not None and self._pending[0] == shot:
            return self._pending[1]
        self._await_pending()
        return self._begin(rig, head, shot)

    def _begin(self, rig: CaptureRig, head: TriggerHead, shot: ShotPlan) -> PendingExposure:
        self._access.check_may_move()
        self._expose_for(rig, shot.exposure_ns)
        moves = shot.volts != self._commanded
        self._commanded = shot.volts
        return head.begin(shot.volts, settle_us=wait_after_move_us(rig, head) if moves else 0)

    def _expose_for(self, rig: CaptureRig, exposure_ns: int | None) -> None:
        eyes = rig.left, rig.right
        if exposure_ns is None or exposure_ns == self._asked_ns:  # as requested: cameras round
            return
        if self._before is None:
            self._before = rig.left.settings, rig.right.settings
        left, right = (
            replace(eye.settings, exposure_ns=exposure_ns, exposure_auto=AutoMode.OFF) for eye in eyes
        )
        _configure(eyes, (left, right))
        self._asked_ns = exposure_ns

    def _await_pending(self) -> None:
        pending, self._pending = self._pending, None
        if pending is None:
            return
        try:
            pending[1].wait()
        except FoveaError as error:
            logger.info("a discarded exposure failed: %s", error)


def _configure(eyes: tuple[Camera, Camera], settings: tuple[CameraSettings, CameraSettings]) -> None:
    for eye, wanted in zip(eyes, settings, strict=True):
        eye.configure(wanted)


def _may_overlap(shot: ShotPlan, following: ShotPlan) -> bool:
    """Return whether the second shot may begin during the first one's readout: only the mirrors change."""
    return shot.volts != following.volts and shot.exposure_ns == following.exposure_ns


def wait_after_move_us(rig: CaptureRig, head: TriggerHead) -> int:
    """Return the wait after a move: until the mirrors have settled, and both sensors have been read out."""
    waits_us = [head.settle_us]
    for eye in (rig.left, rig.right):
        period_us = math.ceil(1e6 / eye.ranges.frame_rate_hz.high)
        waits_us.append(period_us - eye.settings.exposure_ns // 1000 + MARGIN_US)
    return max(waits_us)
