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
from foveacam_pipeline.verge.matching.wide_patch import MOVED_SCORE, WidePatch, fit_at, follow, follow_on

STILL_TAN = 4.0e-4
"""Smaller changes between two measured directions are registration noise: 1.3 wide px."""
SHORTEST_S = 0.005
"""Directions measured at a shorter interval are ignored: they do not determine the speed."""
POINT_HALF_PX = 6.0
"""Half side of the part of a target that shows whether something covers the point itself, wide px."""
GONE_SCORE = 0.65
"""A textured patch that correlates less with the wide view at its place counts as gone: of 380 clicks six had
a distance by other means with less, none of them of the target; right ones had 0.85 and more."""
TRACKED_SCORE = 0.7
"""Least correlation of a moving target's patch with the wide view on its track: of 90 clicks on walkers and
cars the 36 that moved and verged rightly had 0.76 and more; three clicks that verged on something else had
0.16 to 0.68."""
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

    def covered(self, frame: Frame) -> bool:
        """Return whether a wide frame shows something in front of the target.

        The point looks different there, but was not seen to move.
        """
        if self.motion.moves or not self._point.differ(self._cut, frame):
            return False
        return self._plain or self._fits(frame)[0] < MOVED_SCORE

    def shown(self, frame: Frame) -> bool:
        """Return whether a wide frame shows a stationary target as it was; True for one that moves."""
        still = not self.motion.moves
        return not (still and (self.gone(frame) or self._point.differ(self._cut, frame)))

    def gone(self, frame: Frame) -> bool:
        """Return whether a wide frame shows a textured target neither where it was nor on its track."""
        if self._plain:
            return False
        here, on_track = self._fits(frame)
        return here < (MOVED_SCORE if self.motion.moves else GONE_SCORE) and on_track < GONE_SCORE

    def off_track(self, frame: Frame) -> bool:
        """Return whether a wide frame shows something else where a moving textured target is expected."""
        return self.motion.moves and not self._plain and self._fits(frame)[1] < TRACKED_SCORE

    def place_in(self, frame: Frame) -> NDArray[np.float64]:
        """Return where a wide frame shows the target, (2,) tangents: where it was unless it is on its track.

        A passer-by that was taken for the target leaves such a track.
        """
        here, on_track = self._fits(frame)
        if on_track < max(here, MOVED_SCORE):
            return self._template.target
        return self.motion.at(frame.t_ns)

    def _fits(self, frame: Frame) -> tuple[float, float]:
        """Return how well a wide frame shows the target where it was, and on its track: correlations."""
        image, template = gray(to_uint8(frame)), self._template
        here = fit_at(template, image, self._wide, template.target)
        if not self.motion.moves:
            return here, here
        return here, fit_at(template, image, self._wide, self.motion.at(frame.t_ns))

    def _place_changed(self) -> bool:
        """Return whether the newest wide frame has changed at the target's first place."""
        if self._changed[0] != self._newest.seq:
            unlike = self._newest.binning != self._cut.binning  # these cannot be compared
            self._changed = self._newest.seq, unlike or self._place.differ(self._cut, self._newest)
        return self._changed[1]
