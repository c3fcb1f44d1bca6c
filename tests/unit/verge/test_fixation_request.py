import math

import pytest

from foveacam_hardware.contract import InvalidInput, OutOfRange
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_pipeline.verge.values import DirectionTarget, PixelTarget, RectangleTarget, Target
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.looking.fixations.request import check_target, target_of
from foveacam_server.resources.looking.fixations.schema import FixationRequest, Pixel, Rectangle
from foveacam_server.rig.refusals import check_direction
from foveacam_server.rig.schema import Direction

RECTANGLE = Rectangle(x_px=10.0, y_px=20.0, width_px=30.0, height_px=40.0)


@pytest.mark.parametrize(
    ("request_", "target"),
    [
        (FixationRequest(pixel=Pixel(x_px=1.5, y_px=2.0), label="a"), PixelTarget(x_px=1.5, y_px=2.0)),
        (
            FixationRequest(rectangle=RECTANGLE),
            RectangleTarget(x_px=10.0, y_px=20.0, width_px=30.0, height_px=40.0),
        ),
        (
            FixationRequest(direction=Direction(ax_deg=2.0, ay_deg=-1.0), pixel=None),
            DirectionTarget(ax_rad=math.radians(2.0), ay_rad=math.radians(-1.0)),
        ),
    ],
)
def test_request_becomes_the_target_that_it_names(request_: FixationRequest, target: Target) -> None:
    assert target_of(request_) == target


@pytest.mark.parametrize(
    ("request_", "found"),
    [
        (FixationRequest(), "none"),
        (FixationRequest(pixel=Pixel(x_px=1.0, y_px=1.0), rectangle=RECTANGLE), "pixel and rectangle"),
    ],
)
def test_request_must_name_one_target(request_: FixationRequest, found: str) -> None:
    with pytest.raises(InvalidInput, match=f"found {found}"):
        target_of(request_)


@pytest.mark.parametrize("angle_deg", [10.0, -10.0, 0.0])
def test_ten_degrees_are_still_allowed(angle_deg: float) -> None:
    check_direction(math.radians(angle_deg), math.radians(-angle_deg))


@pytest.mark.parametrize("angle_deg", [10.0001, -10.0001, 90.0, float("nan")])
def test_more_than_ten_degrees_is_refused_with_value_and_range(angle_deg: float) -> None:
    with pytest.raises(OutOfRange, match="-10 to 10 degrees"):
        check_direction(0.0, math.radians(angle_deg))


def test_rectangle_that_leaves_the_image_is_refused() -> None:
    calibration = load_calibration(SHIPPED / "sim-rig120.json")
    target = RectangleTarget(x_px=1430.0, y_px=10.0, width_px=20.0, height_px=10.0)
    with pytest.raises(OutOfRange, match="1450"):
        check_target(target, calibration)
