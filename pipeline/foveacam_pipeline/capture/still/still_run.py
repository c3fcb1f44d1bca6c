"""Takes a still: exposes at the present gaze until every camera has delivered its frames or is given up.

A camera that stalls does not affect the others: each has a stack of its own.
"""

import logging
from typing import Protocol

from foveacam_hardware.contract import Cancelled, DeviceFault, FoveaError, Frame, Role, Stopped, Timeout
from foveacam_pipeline.capture.dataset import PlanPosition, Shot
from foveacam_pipeline.capture.run.access import CaptureRig, RigAccess, trigger_head
from foveacam_pipeline.capture.run.describe import (
    conditions_document,
    pan_tilt_pose,
    rail_position_m,
    rig_document,
)
from foveacam_pipeline.capture.run.shots import StackMean
from foveacam_pipeline.capture.run.shutter import wait_after_move_us
from foveacam_pipeline.capture.still.values import (
    MissingFrames,
    Still,
    StillFrame,
    StillKeep,
    StillPlan,
    missing_frames_error,
)
from foveacam_pipeline.workers.progress import ProgressWatcher

logger = logging.getLogger(__name__)

TRIES = 3
"""Consecutive exposures without a frame after which a camera is given up."""


class StillWatcher(ProgressWatcher, Protocol):
    """The operator's side of a still, whose steps are frames; called on the still's own thread."""

    def show_frames(self, frames: tuple[Frame, ...]) -> None:
        """Receive the frames that were just captured."""
        ...


def take_still(access: RigAccess, plan: StillPlan, *, watch: StillWatcher) -> Still:
    """Capture the stacks of a plan without moving the mirrors.

    The frames of a camera that stalls are kept, and `missing` describes the rest. Raise its error when no
    frame arrived at all, Cancelled when the watcher cancels, and Stopped when the stop forbids to expose.
    """
    run = _StillRun(access, plan, watch)
    access.run_still(lambda rig: trigger_head(rig))  # a rig that plays a recording is refused
    while run.capture_round():
        pass
    missing = tuple(stack.missing(plan.frames) for stack in run.stacks.values() if stack.incomplete)
    if not any(stack.came for stack in run.stacks.values()):
        raise missing_frames_error(missing, more="there is nothing to keep")
    return access.run_still(lambda rig: run.result(rig, missing))


class _StillRun:
    """One still in progress."""

    def __init__(self, access: RigAccess, plan: StillPlan, watch: StillWatcher) -> None:
        self._access, self._plan, self._watch = access, plan, watch
        self.stacks = {role: _FrameStack(role, plan) for role in plan.roles}
        self._since_ns = access.clock.now_ns()
        self._settles = True

    def capture_round(self) -> bool:
        """Capture one frame of every camera that lacks some; return whether there was such a camera."""
        if self._watch.cancelled():
            raise Cancelled("the still was cancelled; nothing of it is kept")
        owing = [stack for stack in self.stacks.values() if stack.incomplete and not stack.given_up]
        foveae = [stack for stack in owing if stack.role is not Role.WIDE]
        if foveae:
            self._access.run_moving(lambda rig: self._expose(rig, foveae))
        if (wide := self.stacks.get(Role.WIDE)) in owing and wide is not None:
            self._access.run_still(lambda rig: self._add_wide(rig, wide))
        if not owing:
            return False
        self._watch.show_frames(tuple(stack.newest for stack in owing if stack.newest is not None))
        done = sum(stack.came for stack in self.stacks.values())
        failing = [str(stack.error) for stack in owing if stack.error is not None]
        self._watch.progress(
            done, total=self._plan.frames * len(self.stacks), note=failing[0] if failing else "taking frames"
        )
        return True

    def result(self, rig: CaptureRig, missing: tuple[MissingFrames, ...]) -> Still:
        """Return the captured frames with the description of the rig."""
        pose = pan_tilt_pose(rig)
        stacks = self.stacks.values()
        exposures = tuple(exposure for stack in stacks for exposure in stack.exposures)
        return Still(
            plan=self._plan,
            shots=tuple(shot for stack in stacks for shot in stack.shots()),
            exposures=exposures,
            missing=missing,
            place=PlanPosition(
                index=0,
                rail_m=rail_position_m(rig),
                pan_rad=None if pose is None else pose.pan_rad,
                tilt_rad=None if pose is None else pose.tilt_rad,
            ),
            rig=rig_document(rig),
            conditions=conditions_document(rig),
        )

    def _expose(self, rig: CaptureRig, foveae: "list[_FrameStack]") -> None:
        """Expose both foveae by one pulse, and add the frame of each to its stack."""
        try:
            head = trigger_head(rig)
            settle_us = wait_after_move_us(rig, head) if self._settles else 0
            receipt = head.begin(rig.mirrors.state.volts, settle_us=settle_us).wait()
        except (Stopped, Cancelled):
            raise
        except FoveaError as error:
            for stack in foveae:
                stack.add_failure(error)
            return
        self._settles = False
        for stack in foveae:
            camera = rig.left if stack.role is Role.LEFT else rig.right
            try:
                stack.add(head.frame_of(stack.role, receipt), gain_db=camera.settings.gain_db)
            except FoveaError as error:
                stack.add_failure(error)

    def _add_wide(self, rig: CaptureRig, stack: "_FrameStack") -> None:
        """Add a wide frame that is newer than the last."""
        try:
            frame = trigger_head(rig).wide_since(self._since_ns)
            self._since_ns = frame.t_ns + 1
            stack.add(frame, gain_db=rig.wide.settings.gain_db)
        except FoveaError as error:
            stack.add_failure(error)


class _FrameStack:
    """The frames of one camera."""

    def __init__(self, role: Role, plan: StillPlan) -> None:
        self.role = role
        self._plan = plan
        self._failures = 0
        self._mean: StackMean | None = None
        self._frames: list[Frame] = []
        self.exposures: list[StillFrame] = []
        self.newest: Frame | None = None
        self.error: FoveaError | None = None
        """Why the last frame did not arrive; None if it did."""

    @property
    def came(self) -> int:
        """Number of frames."""
        return len(self.exposures)

    @property
    def incomplete(self) -> bool:
        """Whether it lacks frames."""
        return self.came < self._plan.frames

    @property
    def given_up(self) -> bool:
        """Whether the camera is given up, after too many failures or an error that a retry cannot fix."""
        if self.error is None:
            return False
        return self._failures >= TRIES or not isinstance(self.error, Timeout | DeviceFault)

    def add(self, frame: Frame, *, gain_db: float) -> None:
        """Add a frame; raise DeviceFault for one that differs in size or depth from those before."""
        self._check_alike(frame)
        self.exposures.append(StillFrame.of(frame, gain_db=gain_db))
        self.newest, self.error, self._failures = frame, None, 0
        if self._plan.keep is StillKeep.ALL or self._plan.frames == 1:
            self._frames.append(frame)
        elif self._mean is None:
            self._mean = StackMean(frame)
            self._frames = [frame]
        else:
            self._mean.add(frame)

    def add_failure(self, error: FoveaError) -> None:
        """Count a frame that did not arrive."""
        logger.info("still: camera %s: %s", self.role, error)
        self.newest, self.error = None, error
        self._failures += 1

    def missing(self, asked: int) -> MissingFrames:
        """Return a description of the missing frames."""
        reason = self.error or DeviceFault(f"camera {self.role}: it gave fewer frames than were asked")
        return MissingFrames(role=self.role, came=self.came, asked=asked, reason=reason)

    def shots(self) -> list[Shot]:
        """Return what is stored: every frame, or the mean of all frames; a single frame unchanged."""
        if self._mean is not None and self.came > 1:
            return [Shot(frame=self._mean.frame())]
        return [Shot(frame=frame, stack=number) for number, frame in enumerate(self._frames)]

    def _check_alike(self, frame: Frame) -> None:
        before = self._frames[0] if self._frames else None
        if before is None:
            return
        shapes = [(each.image.shape, each.image.dtype, each.bits) for each in (before, frame)]
        if shapes[0] != shapes[1]:
            raise DeviceFault(
                f"camera {self.role}: its pictures changed their size or depth in the middle of a stack; "
                "take the still again, and leave its format alone meanwhile"
            )
