"""Tracking of a target's direction, extrapolated at constant speed.

Wide frames and foveae are exposed at different times, and looks take time: a walker crosses a fovea in half a
second. A target that was never seen to move is taken as stationary.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.verge.looking.passing_detector import PassingDetector
from foveacam_pipeline.verge.matching.wide_patch import WidePatch, follow, follow_on

STILL_TAN = 4.0e-4
"""Smaller changes between two measured directions are registration noise: 1.3 wide px."""
SHORTEST_S = 0.005
"""Directions measured at a shorter interval are ignored: they do not determine the speed."""
POINT_HALF_PX = 6.0
"""Half side of the part of a target that shows whether something covers the point itself, wide px."""
TRACK_LENGTH = 5
"""Number of latest directions to which a moving target's track is fitted: longer tracks bend."""


class TargetMotion:
    """Track of one target: its direction over time, (2,) tangents from the rig's origin."""

    def __init__(self, target: NDArray[np.float64], t_ns: int) -> None:
        self._target = target
        self._t_ns = t_ns
        self._speed = np.zeros(2)
        self._directions = deque([(t_ns, target)], maxlen=TRACK_LENGTH)

    @property
    def moves(self) -> bool:
        """Whether the target was seen to move."""
        return bool(np.any(self._speed))

    @property
    def seen_ns(self) -> int:
        """When the direction was last measured."""
        return self._directions[-1][0]

    def at(self, t_ns: int) -> NDArray[np.float64]:
        """Return the predicted direction at `t_ns`, (2,) tangents."""
        return self._target + self._speed * ((t_ns - self._t_ns) / 1e9)

    def left_by(self, target: NDArray[np.float64]) -> bool:
        """Return whether a direction, (2,) tangents, differs from the known one by more than noise."""
        return float(np.abs(target - self._target).max()) > STILL_TAN

    def add_direction(self, target: NDArray[np.float64], t_ns: int) -> None:
        """Add a direction measured at `t_ns`, (2,) tangents; the track is the line through the last few."""
        if t_ns - self._directions[-1][0] < 1e9 * SHORTEST_S:
            return
        if not self.moves and not self.left_by(target):
            return  # stationary: the first direction remains the best known
        self._directions.append((t_ns, target))
        times_s = np.array([(t - t_ns) / 1e9 for t, _ in self._directions])
        line = np.polynomial.polynomial.polyfit(times_s, np.array([seen for _, seen in self._directions]), 1)
        self._target, self._speed, self._t_ns = line[0], line[1], t_ns


class TargetTracker:
    """Tracks the patch of a target through newer wide frames.

    `plain`: whether the patch had to grow until it held some texture. Such a target counts as moving only
    where the wide view has changed at its place: its patch also fits elsewhere, by chance or along an edge.
    `far`: whether a moving target is searched about its track, however far from where it was clicked.
    """

    def __init__(
        self, template: WidePatch, frame: Frame, wide: Intrinsics, *, far: bool = False, plain: bool = False
    ) -> None:
        self._far, self._plain = far, plain
        self._template = template
        self._wide = wide
        self._cut = self._newest = frame
        self._changed = frame.seq, False
        self._place = PassingDetector(wide, template.target, half_px=template.half_px)
        self._point = PassingDetector(wide, template.target, half_px=(POINT_HALF_PX, POINT_HALF_PX))
        self.motion = TargetMotion(template.target, frame.t_ns)

    def follow(self, frame: Frame) -> None:
        """Update the track from a wide frame; ignore a repeated one."""
        if frame.seq == self._newest.seq:
            return
        self._newest = frame
        image = gray(to_uint8(frame))
        if self._far and self.motion.moves:
            target = follow_on(
                self._template,
                image,
                self._wide,
                expected=self.motion.at(frame.t_ns),
                unseen_s=(frame.t_ns - self.motion.seen_ns) / 1e9,
            )
        else:
            elapsed_s = (frame.t_ns - self._cut.t_ns) / 1e9
            target = follow(self._template, image, self._wide, elapsed_s=elapsed_s)
        if target is not None:
            self.add_direction(target, frame.t_ns)

    def add_direction(self, target: NDArray[np.float64], t_ns: int) -> None:
        """Add the target's direction at `t_ns`, (2,) tangents, unless a plain target cannot have moved."""
        known = self.motion.moves or not self._plain
        if known or (self.motion.left_by(target) and self._place_changed()):
            self.motion.add_direction(target, t_ns)

    @property
    def stands(self) -> bool:
        """Whether the target is stationary: it was not seen to move, and its place looks unchanged."""
        return not self.motion.moves and not self._place_changed()

    def covered_in(self, frame: Frame) -> bool:
        """Return whether the point itself looks different in a wide frame, but was not seen to move.

        Something is in front of it then.
        """
        return not self.motion.moves and self._point.differ(self._cut, frame)

    def _place_changed(self) -> bool:
        """Return whether the newest wide frame has changed at the target's first place."""
        if self._changed[0] != self._newest.seq:
            unlike = self._newest.binning != self._cut.binning  # these cannot be compared
            self._changed = self._newest.seq, unlike or self._place.differ(self._cut, self._newest)
        return self._changed[1]
