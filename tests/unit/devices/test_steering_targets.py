"""Where a steering request leads, and what is refused."""

import json
import math

import pytest
from tests.support.scenes.plane_head import CALIBRATION

from foveacam_hardware.contract import InvalidInput, MirrorVolts, OutOfRange, StereoVolts
from foveacam_server.resources.devices.mirrors import steering_messages as messages
from foveacam_server.resources.devices.mirrors.schema import EyeVolts, SteerGaze, VoltsRequest
from foveacam_server.resources.devices.mirrors.targets import gaze_volts, volts_of
from foveacam_server.rig.refusals import check_volts
from foveacam_server.rig.schema import Direction

BEFORE = StereoVolts(left=MirrorVolts(x_v=1.0, y_v=2.0), right=MirrorVolts(x_v=3.0, y_v=4.0))


def test_an_eye_that_is_left_out_stays_as_it_is() -> None:
    wanted = volts_of(VoltsRequest(right=EyeVolts(x_v=-5.0, y_v=6.0)), before=BEFORE)
    assert wanted == StereoVolts(left=BEFORE.left, right=MirrorVolts(x_v=-5.0, y_v=6.0))


def test_the_limit_itself_is_taken_and_more_is_refused_by_eye_and_axis() -> None:
    check_volts(volts_of(VoltsRequest(left=EyeVolts(x_v=-170.0, y_v=170.0)), before=BEFORE), max_v=170.0)
    with pytest.raises(OutOfRange) as refused:
        check_volts(volts_of(VoltsRequest(left=EyeVolts(x_v=0.0, y_v=-171.0)), before=BEFORE), max_v=170.0)
    assert (refused.value.asked, refused.value.found) == ("left y_v = -171", "the mirrors take ±170 V")


@pytest.mark.parametrize("shift_deg", [-0.51, 0.51])
def test_the_eyes_are_shifted_by_half_a_degree_at_most_up_and_down(shift_deg: float) -> None:
    ahead = SteerGaze(direction=Direction(ax_deg=1.0, ay_deg=-2.0), vertical_shift_deg=shift_deg)
    with pytest.raises(OutOfRange, match="vertical_shift_deg"):
        gaze_volts(ahead, CALIBRATION)


def test_a_vertical_shift_lowers_the_left_eye_and_raises_the_right_by_as_much_as_was_asked() -> None:
    level, shifted = (
        gaze_volts(
            SteerGaze(direction=Direction(ax_deg=1.0, ay_deg=-2.0), vertical_shift_deg=shift_deg), CALIBRATION
        )
        for shift_deg in (0.0, 0.4)
    )
    apart_deg = []
    for volts in (level, shifted):
        (_, left_rad), (_, right_rad) = CALIBRATION.gaze_rad(volts)
        apart_deg.append(math.degrees(left_rad - right_rad))
    assert apart_deg[1] - apart_deg[0] == pytest.approx(2 * 0.4, abs=0.01)


def test_of_a_rig_that_is_not_open_no_limit_is_told() -> None:
    check_volts(BEFORE, max_v=0.0)


@pytest.mark.parametrize(
    "message",
    [
        {"type": "steer"},
        {"type": "steer", "held": True, "volts": {}},
        {"type": "steer", "held": True, "volts": {"left": {"x_v": "1", "y_v": 0.0}}},
        {
            "type": "steer",
            "held": True,
            "volts": {"left": {"x_v": 1.0, "y_v": 0.0}},
            "gaze": {"direction": {"ax_deg": 0.0, "ay_deg": 0.0}},
        },
        {"type": "begin", "name": ""},
        {"type": "fly"},
    ],
)
def test_what_is_no_message_is_refused_with_an_example(message: dict[str, object]) -> None:
    with pytest.raises(InvalidInput, match=r"send \{.type.:.steer."):
        messages.parse(json.dumps(message))


def test_a_message_has_an_end() -> None:
    with pytest.raises(InvalidInput, match="4096 characters"):
        messages.parse(json.dumps({"type": "begin", "lease": "x" * 5000}))
