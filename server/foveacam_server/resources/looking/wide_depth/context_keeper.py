"""Keeps the wide context in force, one for each rig, calibration and pose, and stores it between runs."""

import logging
import math
import threading
from collections.abc import Callable
from pathlib import Path

from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_pipeline.wide_depth.context_file import ContextIdentity, load_context, save_context
from foveacam_pipeline.wide_depth.wide_context import WideContext
from foveacam_server.rig.status import RigStatus

FILE = "context.npz"
PLACE_STEP_M = 1e-3
"""Least movement of the rail that counts as a move: 0.06 degrees at 1 m."""
TURN_STEP_RAD = math.radians(0.02)
"""Least turn of the pan-tilt that counts as a move: one wide px."""

Pose = tuple[int, int, int]
"""Rail position, pan and tilt in multiples of those steps; 0 where there is no such device."""

_log = logging.getLogger(__name__)


class ContextKeeper:
    """Holds the present context; replaces it when the calibration changes or the rig is moved."""

    def __init__(
        self,
        folder: Path,
        *,
        calibration: Callable[[], Calibration | None],
        status: Callable[[], RigStatus],
    ) -> None:
        self._path = folder / FILE
        self._calibration, self._status = calibration, status
        self._lock = threading.Lock()
        self._of: ContextIdentity | None = None
        self._pose: Pose | None = None
        self._named: tuple[Calibration, str] | None = None
        self._context: WideContext | None = None
        self._saved = -1

    def present(self) -> WideContext | None:
        """Return the context for the rig's present pose; None while it is not calibrated or is moving."""
        calibration, status = self._calibration(), self._status()
        pose = pose_of(status)
        if calibration is None or status.rig_id is None or pose is None:
            return None
        with self._lock:
            if self._pose is None or _apart(pose, self._pose):
                self._pose = pose
            if self._named is None or self._named[0] is not calibration:
                self._named = (calibration, calibration.id)  # a hash of its whole content
            of = ContextIdentity(
                rig_id=status.rig_id,
                calibration_id=self._named[1],
                pose=" ".join(str(step) for step in self._pose),
            )
            if self._context is None or of != self._of:
                self._context, self._of = self._opened(calibration, of), of
                self._saved = self._context.revision
            return self._context

    def save(self) -> None:
        """Store the context if it has changed; a failed write is logged, and the context in memory stays."""
        with self._lock:
            context, of = self._context, self._of
            if context is None or of is None or context.revision == self._saved:
                return
            self._saved = context.revision
        try:
            save_context(context, self._path, of=of)
        except OSError as error:
            _log.warning("the wide depth is not stored: %s", error)

    def forget(self) -> None:
        """Drop the present context and delete the stored one."""
        with self._lock:
            with disk_errors("removing the stored wide depth", self._path.parent):
                self._path.unlink(missing_ok=True)
            if self._context is not None:
                self._context.clear()
                self._saved = self._context.revision

    def _opened(self, calibration: Calibration, of: ContextIdentity) -> WideContext:
        context = WideContext(calibration.wide)
        try:
            load_context(context, self._path, of=of)
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:
            _log.warning("the stored wide depth cannot be read: %s", error)
        return context


def pose_of(status: RigStatus) -> Pose | None:
    """Return the rig's pose in steps that count as a move; None while it moves."""
    rail, turn = status.rail, None if status.pan_tilt is None else status.pan_tilt.state
    if (rail is not None and rail.moving) or (turn is not None and turn.moving):
        return None
    position = 0.0 if rail is None or rail.position_m is None else rail.position_m / PLACE_STEP_M
    if turn is None or turn.pose is None:
        return (round(position), 0, 0)
    return (
        round(position),
        round(turn.pose.pan_rad / TURN_STEP_RAD),
        round(turn.pose.tilt_rad / TURN_STEP_RAD),
    )


def _apart(one: Pose, other: Pose) -> bool:
    """Return whether two poses differ by more than rounding."""
    return any(abs(a - b) > 1 for a, b in zip(one, other, strict=True))
