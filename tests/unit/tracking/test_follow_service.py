"""The service of followed targets without a rig: when it refuses, and what it says of a lost target."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_hardware.contract import Busy, Frame, Role, VirtualClock
from foveacam_pipeline.track.acquire import ClickTrack
from foveacam_pipeline.track.follow import Follower
from foveacam_pipeline.track.image_tracker import TrackBox
from foveacam_pipeline.track.position_filter import PositionEstimate
from foveacam_pipeline.track.target import FollowState, TargetReport
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.values import DirectionTarget
from foveacam_server.resources.looking.follows.follow_job import FollowTools
from foveacam_server.resources.looking.follows.followed import FollowedRecord
from foveacam_server.resources.looking.follows.schema import FollowRequest
from foveacam_server.resources.looking.follows.service import FollowService
from foveacam_server.rig.live_views import RecentFrames
from foveacam_server.rig.schema import Direction

BOX_PX = 64, 48


class Emitted:
    """Keeps the kinds of the events, and of the jobs that were asked for."""

    def __init__(self) -> None:
        self.kinds: list[str] = []

    def emit(self, kind: str, message: str, **data: object) -> None:
        self.kinds.append(kind)

    def handle(self, kind: str, handler: object, **options: object) -> None:
        return

    def submit(self, kind: str) -> SimpleNamespace:
        self.kinds.append(kind)
        return SimpleNamespace(id="job-1")


class Nothing:
    """Knows no depth."""

    def around(self, target: object, *, reach_tan: float) -> DepthSamples:
        return DepthSamples.none()


def service_of(emitted: Emitted, *, looping: bool = False) -> FollowService:
    hardware = SimpleNamespace(
        check_may_move=lambda: None,
        recent_wide=RecentFrames(),
        halted=False,
        use=SimpleNamespace(wanted=False),
    )
    return FollowService(
        FollowTools(
            hardware=cast(Any, hardware),
            calibration=cast(Any, SimpleNamespace(current=CALIBRATION, require=lambda: CALIBRATION)),
            jobs=cast(Any, emitted),
            events=cast(Any, emitted),
            clock=VirtualClock(),
            targets=cast(Any, None),
            context=Nothing(),
            viewer=None,
            on_distance=lambda _: None,
            looping=lambda: looping,
        )
    )


def ahead(state: FollowState) -> FollowedRecord:
    """A target that stands 4 m ahead."""
    estimate = PositionEstimate(
        t_ns=0,
        position_rig_m=np.array([0.0, 0.0, 4.0]),
        velocity_rig_m_s=np.zeros(3),
        covariance=np.eye(6),
    )
    report = TargetReport(
        target_id="fol-1",
        state=state,
        estimate=estimate,
        looks=9,
        hits=8,
        last_hit_ns=0,
        score=0.9,
        wide_score=None,
    )
    return FollowedRecord(
        id="fol-1",
        label="poster",
        target=DirectionTarget(ax_rad=0.0, ay_rad=0.0),
        box_px=BOX_PX,
        tracker="template",
        priority=1.0,
        state=state.value,
        report=report,
    )


def test_no_target_is_followed_beside_a_running_loop() -> None:
    emitted = Emitted()
    service = service_of(emitted, looping=True)

    with pytest.raises(Busy, match="the vergence loop has the eyes"):
        service.follow(FollowRequest(direction=Direction(ax_deg=0.0, ay_deg=0.0)))

    assert not service.following
    assert emitted.kinds == []


def test_without_a_loop_a_target_is_followed() -> None:
    emitted = Emitted()
    service = service_of(emitted)

    service.follow(FollowRequest(direction=Direction(ax_deg=0.0, ay_deg=0.0)))

    assert service.following
    assert emitted.kinds == ["follow.started", "following"]


def test_a_search_gives_way_to_another_job_and_begins_anew_afterwards() -> None:
    emitted, head = Emitted(), PlaneHead(z_m=4.0, texture=noise_texture(), binning=2)
    service = service_of(emitted)
    record = ahead(FollowState.FOLLOWED)
    record.report, record.state = None, "finding"
    record.click = ClickTrack(head.wide(), TrackBox(x_px=720.0, y_px=540.0))
    service._records.add(record)
    follower, job = Follower(CALIBRATION, clock=head.clock), service._job
    use = job._tools.hardware.use

    use.wanted = True  # type: ignore[misc]  # the stub's
    job._find(record, follower, head)
    assert head.looks == 0
    assert (record.state, record.click is None, emitted.kinds) == ("finding", False, [])

    use.wanted = False  # type: ignore[misc]  # the stub's
    job._find(record, follower, head)
    assert list(follower.targets) == [record.id]
    assert service.get(record.id).state == "followed"
    assert record.click is None


@pytest.mark.parametrize(
    ("state", "has_box"),
    [(FollowState.FOLLOWED, True), (FollowState.LOST, False), (FollowState.OUT_OF_FIELD, False)],
)
def test_only_a_target_that_is_seen_has_a_box_in_the_wide_view(state: FollowState, has_box: bool) -> None:
    service = service_of(Emitted())
    service._records.add(ahead(state))
    frame = Frame(image=np.zeros((4, 6), np.uint8), role=Role.WIDE, seq=7, t_ns=0, exposure_ns=1)

    (box,) = service.boxes(frame)

    assert box.slot == "poster"
    assert (box.bbox_px is not None) == has_box
    if box.bbox_px is not None:
        assert box.bbox_px[2:] == BOX_PX
