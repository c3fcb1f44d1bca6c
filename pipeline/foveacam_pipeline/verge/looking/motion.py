"""Track the direction of a target and extrapolate it at constant speed.

Wide frames and foveae are exposed at different times, and looks take time: a walker crosses a fovea in half
a second. A target that was never seen to move stays where it is.
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
"""Smaller changes between two sights are noise of the registration: 1.3 wide px."""
SHORTEST_S = 0.005
"""Sights closer in time than this say nothing of speed."""
SIGHTS = 5
"""So many sights of a moving target make its track: longer ones bend."""


class TargetMotion:
    """The track of one target: (2,) tangents from the rig's origin over time."""

    def __init__(self, target: NDArray[np.float64], t_ns: int) -> None:
        self._target = target
        self._t_ns = t_ns
        self._speed = np.zeros(2)
        self._sights = deque([(t_ns, target)], maxlen=SIGHTS)

    @property
    def moves(self) -> bool:
        """Whether it was seen to move."""
        return bool(np.any(self._speed))

    @property
    def seen_ns(self) -> int:
        """When it was seen last."""
        return self._sights[-1][0]

    def at(self, t_ns: int) -> NDArray[np.float64]:
        """Return its direction at `t_ns`, (2,) tangents."""
        return self._target + self._speed * ((t_ns - self._t_ns) / 1e9)

    def left_by(self, target: NDArray[np.float64]) -> bool:
        """Return whether a target that is at this direction now, (2,) tangents, is not where it stood."""
        return float(np.abs(target - self._target).max()) > STILL_TAN

    def sees(self, target: NDArray[np.float64], t_ns: int) -> None:
        """Take its direction at `t_ns`, (2,) tangents; the track is the line through the last few."""
        if t_ns - self._sights[-1][0] < 1e9 * SHORTEST_S:
            return
        if not self.moves and not self.left_by(target):
            return  # it stands still: the first place stays the best known
        self._sights.append((t_ns, target))
        times_s = np.array([(t - t_ns) / 1e9 for t, _ in self._sights])
        line = np.polynomial.polynomial.polyfit(times_s, np.array([seen for _, seen in self._sights]), 1)
        self._target, self._speed, self._t_ns = line[0], line[1], t_ns


class TargetTracker:
    """Follows the patch through newer wide frames and keeps the target's track.

    `plain`: whether the patch had to grow until it held some texture. Such a target moves only where its
    place in the wide view has changed: its patch also fits elsewhere, as chance or an edge through it has it.
    `far`: whether one that moves is looked for about its track, however far from where it was clicked.
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
        self.motion = TargetMotion(template.target, frame.t_ns)

    def follow(self, frame: Frame) -> None:
        """Take a wide frame; one that was taken before is ignored."""
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
            self.sees(target, frame.t_ns)

    def sees(self, target: NDArray[np.float64], t_ns: int) -> None:
        """Take the direction of the target at `t_ns`, (2,) tangents, if it may have moved there."""
        known = self.motion.moves or not self._plain
        if known or (self.motion.left_by(target) and self._place_changed()):
            self.motion.sees(target, t_ns)

    @property
    def stands(self) -> bool:
        """Whether the target stands still: it was not seen to move, and its place shows what it showed."""
        return not self.motion.moves and not self._place_changed()

    def _place_changed(self) -> bool:
        """Return whether the newest wide frame shows something else at the target's first place."""
        if self._changed[0] != self._newest.seq:
            unlike = self._newest.binning != self._cut.binning  # which cannot be compared
            self._changed = self._newest.seq, unlike or self._place.differ(self._cut, self._newest)
        return self._changed[1]
