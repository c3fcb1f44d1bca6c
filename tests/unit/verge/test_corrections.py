"""What an operator's correction leaves of the distances, and what is kept of it."""

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_server.resources.looking.fixations.corrections import kind_of, limits_of, remaining_range
from foveacam_server.resources.looking.fixations.schema import (
    FixationDocument,
    FixationOrder,
    Pixel,
    Rectangle,
)

PIXEL = Pixel(x_px=1.0, y_px=2.0)
RECTANGLE = Rectangle(x_px=1.0, y_px=2.0, width_px=3.0, height_px=4.0)


def fixation(distance_m: float | None = 2.0, sigma_m: float = 0.1, **more: object) -> FixationDocument:
    request = {"pixel": {"x_px": 1.0, "y_px": 2.0}}
    measured = {"distance_m": distance_m, "distance_sigma_m": sigma_m, "bound": None}
    ids = {"id": "fix-1", "job_id": "job-1", "calibration_id": "c", "target_id": None, "cloud_id": None}
    target = {"ax_deg": 0.0, "ay_deg": 0.0, "x_px": 1.0, "y_px": 2.0}
    end = {"state": "verged", "reason": "", "created_utc": "2026-01-01T00:00:00.000Z", "steps": []}
    rest = {"point_rig_m": None, "residual_px": None, "score": None, "duration_ms": None}
    document = {**ids, "target": target, **end, **rest, "request": request, **measured, **more}
    return FixationDocument.model_validate(document)


def test_three_sigma_about_the_answer_are_left_out() -> None:
    nearer = limits_of(remaining_range(fixation(), "nearer"))
    farther = limits_of(remaining_range(fixation(), "farther"))
    assert nearer.nearest_m == 0.0
    assert nearer.farthest_m == pytest.approx(1.7)
    assert farther.nearest_m == pytest.approx(2.3)
    assert farther.farthest_m is None


def test_sure_answer_is_left_out_with_a_hundredth_of_its_distance() -> None:
    assert remaining_range(fixation(sigma_m=1e-4), "farther").nearest_m == pytest.approx(2.02)


def test_corrections_narrow_what_earlier_ones_left() -> None:
    request = {"pixel": {"x_px": 1.0, "y_px": 2.0}, "within": {"nearest_m": 1.5, "farthest_m": None}}
    left = remaining_range(fixation(request=request), "nearer")
    assert left.nearest_m == 1.5
    assert left.farthest_m == pytest.approx(1.7)


def test_limits_are_halved_in_disparity() -> None:
    bound = {"nearest_m": 2.0, "farthest_m": 6.0}
    assert remaining_range(fixation(None, bound=bound), "nearer").farthest_m == pytest.approx(3.0)
    open_bound = {"nearest_m": 2.0, "farthest_m": None}
    assert remaining_range(fixation(None, bound=open_bound), "farther").nearest_m == pytest.approx(4.0)


def test_chosen_alternative_is_the_answer_that_is_corrected() -> None:
    rest = {"basis": "both_foveae", "point_rig_m": (0.0, 0.0, 1.0), "probability": 0.5}
    others = [{"distance_m": z_m, "distance_sigma_m": 0.1, **rest} for z_m in (2.0, 4.0)]
    found = fixation(alternatives=others, chosen_alternative=1)
    assert remaining_range(found, "nearer").farthest_m == pytest.approx(3.7)


def test_nothing_left_or_nothing_known_is_told_in_words() -> None:
    request = {"pixel": {"x_px": 1.0, "y_px": 2.0}, "within": {"nearest_m": 1.9, "farthest_m": None}}
    with pytest.raises(InvalidInput, match="nothing nearer remains"):
        remaining_range(fixation(request=request), "nearer")
    with pytest.raises(InvalidInput, match="neither a distance nor limits"):
        remaining_range(fixation(None), "nearer")


@pytest.mark.parametrize(
    ("order", "kind"),
    [
        (FixationOrder(pixel=PIXEL), None),
        (FixationOrder(pixel=PIXEL, corrects="fix-1"), "click"),
        (FixationOrder(rectangle=RECTANGLE, corrects="fix-1"), "rectangle"),
        (FixationOrder(rectangle=RECTANGLE, corrects="fix-1", correction="farther"), "farther"),
    ],
)
def test_kind_of_a_correction_follows_from_its_request(order: FixationOrder, kind: str | None) -> None:
    assert kind_of(order) == kind
