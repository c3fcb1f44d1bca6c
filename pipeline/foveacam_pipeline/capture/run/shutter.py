"""Exposes both foveae shot after shot: the mirrors move on as soon as an exposure ends, while it is read out.

A shot whose frames do not come is taken again, a stated number of times.
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
from foveacam_pipeline.capture.run.access import CaptureRig, RigAccess, trigger_head
from foveacam_pipeline.capture.run.values import FoveaPair, ShotPlan

logger = logging.getLogger(__name__)

MARGIN_US = 500
"""Between the end of one readout and the next exposure's."""


class ShotTaker:
    """Takes shots through a `RigAccess`; not for two threads at a time."""

    def __init__(self, access: RigAccess, *, tries: int) -> None:
        self._access = access
        self._tries = tries
        self._under_way: tuple[ShotPlan, PendingExposure] | None = None
        self._stands: StereoVolts | None = None
        self._before: tuple[CameraSettings, CameraSettings] | None = None
        self._asked_ns: int | None = None
        self._ended_ns = access.clock.now_ns()
        self.retaken = 0
        """Shots that had to be taken again."""

    @property
    def ended_ns(self) -> int:
        """When the last exposure ended, or was given up: from then on a wide frame belongs to the next."""
        return self._ended_ns

    def take(self, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        """Take one shot and return its frames; the following one has then begun, where that can be."""
        return self._access.moving(lambda rig: self._until_there(rig, shot, following))

    def wide_since(self, t_ns: int) -> Frame:
        """Return the newest wide frame exposed at `t_ns` or later."""
        return self._access.still(lambda rig: trigger_head(rig).wide_since(t_ns))

    def drop(self) -> None:
        """Let what is under way end, and forget it; the next shot steers anew."""
        if self._under_way is not None:
            self._access.still(lambda _: self._forget())
        self._stands = None
        self._ended_ns = self._access.clock.now_ns()

    def close(self) -> None:
        """End what is under way, and let both cameras expose as they did before."""
        self.drop()
        before, self._before, self._asked_ns = self._before, None, None
        if before is not None:
            self._access.still(lambda rig: _configure((rig.left, rig.right), before))

    def _until_there(self, rig: CaptureRig, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        last: FoveaError | None = None
        for _ in range(self._tries):
            try:
                return self._once(rig, shot, following)
            except (Timeout, DeviceFault) as error:
                logger.info("a shot is taken again: %s", error)
                last = error
                self._forget()
                self._stands = None
                self.retaken += 1
        self.retaken -= 1
        raise DeviceFault(
            f"capture: an exposure was tried {self._tries} times and its frames did not come ({last});"
            " mend that, then resume",
            asked="an exposure of both foveae",
            found=str(last),
            remedy="mend that, then resume the capture",
        ) from last

    def _once(self, rig: CaptureRig, shot: ShotPlan, following: ShotPlan | None) -> FoveaPair:
        head = trigger_head(rig)
        exposure = self._begun(rig, head, shot)
        self._under_way = None
        receipt = exposure.wait()
        exposure_ns = max(eye.settings.exposure_ns for eye in (rig.left, rig.right))
        self._ended_ns = receipt.end_ns(exposure_ns=exposure_ns)
        if following is not None and _overlap(shot, following):
            self._under_way = following, self._begin(rig, head, following)
        left, right = head.frames_of(receipt)
        return FoveaPair(left=left, right=right)

    def _begun(self, rig: CaptureRig, head: TriggerHead, shot: ShotPlan) -> PendingExposure:
        if self._under_way is not None and self._under_way[0] == shot:
            return self._under_way[1]
        self._forget()
        return self._begin(rig, head, shot)

    def _begin(self, rig: CaptureRig, head: TriggerHead, shot: ShotPlan) -> PendingExposure:
        self._access.check_may_move()
        self._expose_for(rig, shot.exposure_ns)
        moves = shot.volts != self._stands
        self._stands = shot.volts
        return head.begin(shot.volts, settle_us=wait_after_move_us(rig, head) if moves else 0)

    def _expose_for(self, rig: CaptureRig, exposure_ns: int | None) -> None:
        eyes = rig.left, rig.right
        if exposure_ns is None or exposure_ns == self._asked_ns:  # not what it took: cameras round to lines
            return
        if self._before is None:
            self._before = rig.left.settings, rig.right.settings
        left, right = (
            replace(eye.settings, exposure_ns=exposure_ns, exposure_auto=AutoMode.OFF) for eye in eyes
        )
        _configure(eyes, (left, right))
        self._asked_ns = exposure_ns

    def _forget(self) -> None:
        under_way, self._under_way = self._under_way, None
        if under_way is None:
            return
        try:
            under_way[1].wait()
        except FoveaError as error:
            logger.info("an exposure that nobody waits for failed: %s", error)


def _configure(eyes: tuple[Camera, Camera], settings: tuple[CameraSettings, CameraSettings]) -> None:
    for eye, wanted in zip(eyes, settings, strict=True):
        eye.configure(wanted)


def _overlap(shot: ShotPlan, following: ShotPlan) -> bool:
    """Tell whether the second may begin while the first is read out: the mirrors move, the cameras stay."""
    return shot.volts != following.volts and shot.exposure_ns == following.exposure_ns


def wait_after_move_us(rig: CaptureRig, head: TriggerHead) -> int:
    """Return the wait after a move: until the mirrors stand, and both sensors have been read out."""
    waits_us = [head.settle_us]
    for eye in (rig.left, rig.right):
        period_us = math.ceil(1e6 / eye.ranges.frame_rate_hz.high)
        waits_us.append(period_us - eye.settings.exposure_ns // 1000 + MARGIN_US)
    return max(waits_us)
