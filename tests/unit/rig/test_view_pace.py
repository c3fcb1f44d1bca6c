"""Whether a live view comes as fast as it should: judged against what is promised, with a reason."""

from dataclasses import replace

import pytest
from tests.support.devices.fake_rig import FakeRig, Pictures

from foveacam_hardware.contract import PARKED, CameraLink, CameraPhase, CameraSettings, Role, VirtualClock
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.live_views import SESSION_WIDE_HZ, LiveRates, LiveViews
from foveacam_server.rig.status import CLOSED, FrameRate, RigState, RigStatus, rig_status
from foveacam_server.rig.view_pace import SLOW_AFTER_NS, ExpectedRate, ViewPace, expected_rate

PROMISED = ExpectedRate(rate_hz=15.0, reason="the reason")
S = 1_000_000_000


def judged(*rates_hz: float, expected: ExpectedRate | None = PROMISED) -> str | None:
    """Return the reason after one rate a second."""
    pace = ViewPace()
    for second, rate_hz in enumerate(rates_hz):
        pace.expect(expected, rate_hz=rate_hz, now_ns=second * S)
    return pace.slow_reason((len(rates_hz) - 1) * S)


def test_a_view_is_slow_once_it_has_had_less_than_half_of_its_rate_for_three_seconds() -> None:
    assert judged(7.4, 2.0, 0.0) is None
    assert judged(7.4, 2.0, 0.0, 2.0) == "the reason"
    assert SLOW_AFTER_NS == 3 * S


def test_a_view_at_half_of_its_rate_is_not_slow_and_one_good_second_begins_anew() -> None:
    assert judged(7.5, 7.5, 7.5, 7.5, 7.5) is None
    assert judged(2.0, 2.0, 8.0, 2.0, 2.0, 2.0) is None


def test_a_view_to_which_no_rate_is_promised_is_never_slow() -> None:
    assert judged(0.0, 0.0, 0.0, 0.0, 0.0, expected=None) is None


@pytest.mark.parametrize(
    ("settings", "link", "simulated", "rate_hz", "reason"),
    [
        (CameraSettings(exposure_ns=5_000_000), CLOSED, True, 15.0, "simulated scene"),
        (CameraSettings(exposure_ns=5_000_000), CLOSED, False, 15.0, "the camera delivers no more"),
        (CameraSettings(exposure_ns=5_000_000, frame_rate_hz=5.0), CLOSED, True, 5.0, "simulated scene"),
        (CameraSettings(exposure_ns=200_000_000), CLOSED, True, 15.0, "200 ms allows 5.0 a second"),
        (
            CameraSettings(exposure_ns=5_000_000),
            CameraLink(phase=CameraPhase.DEGRADED, reason="frames are incomplete", since_ns=0, epoch=1),
            False,
            15.0,
            "frames are incomplete",
        ),
    ],
)
def test_the_expected_rate_is_the_smaller_of_limit_and_setting_and_names_what_limits_it(
    settings: CameraSettings, link: CameraLink, simulated: bool, rate_hz: float, reason: str
) -> None:
    found = expected_rate(15.0, settings, link=link, simulated=simulated)
    assert found.rate_hz == rate_hz
    assert reason in found.reason


@pytest.fixture
def status() -> RigStatus:
    rig = FakeRig(VirtualClock())
    rates = {role: FrameRate() for role in Role}
    return rig_status(rig, state=RigState.READY, problems=(), rates=rates, gaze=PARKED)


def promised(
    status: RigStatus, watching: set[str], *, looks: bool = True, in_session: bool = False
) -> dict[str, float | None]:
    sink, clock = Pictures(watching=watching), VirtualClock()
    views = LiveViews(sink=sink, clock=clock, limits=LiveRates(), overlay=lambda _: None)
    views.start_wide_period(in_session=in_session)
    views.wait_s(wide=True, looks=looks)
    views.expect(status)
    return {view: None if rate is None else rate.rate_hz for view, rate in sink.expected.items()}


def test_rates_are_promised_to_views_that_are_watched_and_that_nothing_holds_up(status: RigStatus) -> None:
    everything = {"wide", "left", "right"}
    assert promised(status, everything) == {"wide": 15.0, "left": 15.0, "right": 15.0}
    assert promised(status, {"wide"}) == {"wide": 15.0, "left": None, "right": None}
    assert promised(status, everything, looks=False) == {"wide": 15.0, "left": None, "right": None}
    assert promised(status, everything, in_session=True)["wide"] == SESSION_WIDE_HZ
    cameras = tuple(replace(camera, connected=camera.role is not Role.LEFT) for camera in status.cameras)
    assert promised(replace(status, cameras=cameras), everything)["left"] is None


def test_no_rate_is_promised_to_the_view_of_a_camera_without_one(status: RigStatus) -> None:
    absent = CameraSettings(exposure_ns=0, frame_rate_hz=0.0)
    cameras = tuple(replace(camera, settings=absent) for camera in status.cameras)
    nothing = {"wide": None, "left": None, "right": None}
    assert promised(replace(status, cameras=cameras), {"wide", "left", "right"}) == nothing


def test_the_hub_states_what_it_expects_of_a_view_and_why_it_is_slow() -> None:
    clock = VirtualClock(10 * S)
    hub = FrameHub(clock=clock)
    found = []
    for _ in range(5):
        hub.expect("wide", PROMISED)
        found.append((hub.status("wide").expected_hz, hub.status("wide").slow_reason))
        clock.sleep_until_ns(clock.now_ns() + S)
    assert found == [(15.0, None)] * 3 + [(15.0, "the reason")] * 2
    hub.expect("wide", None)
    assert (hub.status("wide").expected_hz, hub.status("wide").slow_reason) == (None, None)
