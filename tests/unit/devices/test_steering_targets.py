"""Where a steering request leads, and what is refused."""

import json

import pytest

from foveacam_hardware.contract import InvalidInput, MirrorVolts, OutOfRange, StereoVolts
from foveacam_server.resources.devices.mirrors import steering_messages as messages
from foveacam_server.resources.devices.mirrors.schema import EyeVolts, VoltsRequest
from foveacam_server.resources.devices.mirrors.targets import volts_of
from foveacam_server.rig.refusals import check_volts

BEFORE = StereoVolts(left=MirrorVolts(x_v=1.0, y_v=2.0), right=MirrorVolts(x_v=3.0, y_v=4.0))


def test_an_eye_that_is_left_out_stays_as_it_is() -> None:
    wanted = volts_of(VoltsRequest(right=EyeVolts(x_v=-5.0, y_v=6.0)), before=BEFORE)
    assert wanted == StereoVolts(left=BEFORE.left, right=MirrorVolts(x_v=-5.0, y_v=6.0))


def test_the_limit_itself_is_taken_and_more_is_refused_by_eye_and_axis() -> None:
    check_volts(volts_of(VoltsRequest(left=EyeVolts(x_v=-170.0, y_v=170.0)), before=BEFORE), max_v=170.0)
    with pytest.raises(OutOfRange) as refused:
        check_volts(volts_of(VoltsRequest(left=EyeVolts(x_v=0.0, y_v=-171.0)), before=BEFORE), max_v=170.0)
    assert (refused.value.asked, refused.value.found) == ("left y_v = -171", "the mirrors take ±170 V")


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
