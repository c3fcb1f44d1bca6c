"""Followed targets whose image tracker holds a place beside their middle, on a painted rig."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.plane_head import PlaneHead, noise_texture

from foveacam_hardware.contract import LookOptions, Sighting, StereoVolts
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track import trackers
from foveacam_pipeline.track.follow import Follower
from foveacam_pipeline.track.image_tracker import GreyImage, ImageTracker, TrackBox, TrackMatch
from foveacam_pipeline.track.target import FollowedTarget, FollowState
from foveacam_pipeline.track.template_tracker import TemplateTracker
from foveacam_pipeline.verge.aim import aim_at, volts_for

pytestmark = pytest.mark.slow

Z_M = 6.0
SPEED_M_S = 0.8
LATE_NS = 80_000_000


def walking(t_ns: int) -> tuple[float, float]:
    return -0.4 + SPEED_M_S * t_ns / 1e9, 0.0


class LateWideHead(PlaneHead):
    """Sees the wide frame of each look some time after the foveae's, as a camera does that runs freely."""

    late_ns = 30_000_000

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        sighting = super().look(volts, options=options)
        self.clock.sleep_until_ns(self.clock.now_ns() + self.late_ns)
        return replace(sighting, wide=self.wide())


class BesideTracker:
    """Tells a place to the left of what it was started at, as one that learned what is there."""

    def __init__(self, tracker: ImageTracker, *, beside_px: float) -> None:
        self._tracker = tracker
        self._beside_px = beside_px
        self.refusals = 0

    def start(self, image: GreyImage, box: TrackBox) -> None:
        self._tracker.start(image, box)

    def update(self, image: GreyImage, near: tuple[float, float] | None) -> TrackMatch | None:
        found = self._tracker.update(image, None)
        return None if found is None else replace(found, x_px=found.x_px - self._beside_px)

    def avoid(self, places_px: Sequence[tuple[float, float]]) -> None:
        self._tracker.avoid(places_px)

    def refuse(self) -> None:
        self.refusals += 1
        self._tracker.refuse()


def followed(head: PlaneHead) -> Follower:
    """Follow the middle of the plane from a look at it."""
    calibration = head.calibration
    x_m, y_m = head.shift_m(head.clock.now_ns() + head.look_ns)
    gazes = aim_at(calibration, np.array([x_m, y_m]) / Z_M, 1.0 / Z_M)
    sighting = head.look(volts_for(calibration, gazes))
    follower = Follower(calibration, clock=head.clock)
    follower.add(
        FollowedTarget(
            "one",
            sighting,
            (x_m, y_m, Z_M),
            calibration=calibration,
            wide=gray(to_uint8(sighting.wide)),
            velocity_rig_m_s=(SPEED_M_S, 0.0, 0.0),
        )
    )
    return follower


def errors_m(head: PlaneHead, follower: Follower, steps: int) -> list[float]:
    """Return how far the target was from where it was expected, before every look at it."""
    found, target = [], follower.targets["one"]
    for _ in range(steps):
        t_ns = head.clock.now_ns() + head.look_ns
        x_m, y_m = head.shift_m(t_ns)
        found.append(float(np.linalg.norm(target.at(t_ns).position_rig_m - np.array([x_m, y_m, Z_M]))))
        follower.step(head)
    return found


def test_the_wide_view_is_learned_where_the_target_is_in_its_frame() -> None:
    head = LateWideHead(z_m=Z_M, texture=noise_texture(), shift_m=walking)
    head.late_ns = LATE_NS
    target = followed(head).targets["one"]
    for _ in range(5):
        head.clock.sleep_until_ns(head.clock.now_ns() + head.look_ns)
        frame = head.wide()
        target.see_wide(frame, gray(to_uint8(frame)))
        told_m = Z_M * target.at(frame.t_ns).tangents
        assert told_m == pytest.approx(head.shift_m(frame.t_ns), abs=0.01)  # it moved by 0.06 m until then


@pytest.mark.parametrize("beside_px", [25.0, 45.0, 60.0])
def test_a_tracker_beside_the_middle_does_not_draw_the_foveae_away(
    beside_px: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[BesideTracker] = []

    def beside() -> BesideTracker:
        made.append(BesideTracker(TemplateTracker(), beside_px=beside_px))
        return made[-1]

    monkeypatch.setattr(trackers, "TemplateTracker", beside)
    head = LateWideHead(z_m=Z_M, texture=noise_texture(), shift_m=walking)
    follower = followed(head)
    found_m = errors_m(head, follower, 22)
    report = follower.reports()[0]
    assert (report.state, made[0].refusals) == (FollowState.FOLLOWED, 0)
    assert report.looks - report.hits <= 1
    assert max(found_m[10:]) < 0.03
