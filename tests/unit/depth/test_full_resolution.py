"""Which fixations a look at full resolution can be ordered for, and where it looks."""

import pytest

from foveacam_hardware.contract import InvalidInput
from foveacam_server.resources.looking.fixations.full_resolution import point_of
from foveacam_server.resources.looking.fixations.schema import (
    AlternativeDocument,
    Basis,
    FixationDocument,
    TargetPlace,
)


def fixation(**more: object) -> FixationDocument:
    document: dict[str, object] = {
        "id": "fix-1",
        "job_id": "job-1",
        "created_utc": "2026-01-01T00:00:00.000Z",
        "request": {},
        "target": TargetPlace(ax_deg=1.0, ay_deg=2.0, x_px=800.0, y_px=600.0),
        "state": "verged",
        "reason": "",
        "distance_m": 4.0,
        "distance_sigma_m": 0.01,
        "point_rig_m": (0.07, 0.14, 3.99),
        "basis": "both_foveae",
        "residual_px": 0.1,
        "score": 0.9,
        "duration_ms": 300.0,
        "steps": [],
        "calibration_id": "a" * 32,
        "target_id": None,
        "cloud_id": None,
    }
    return FixationDocument.model_validate(document | more)


def alternative(basis: Basis) -> AlternativeDocument:
    point = (0.1, 0.2, 7.99)
    return AlternativeDocument(
        basis=basis, distance_m=8.0, distance_sigma_m=0.02, point_rig_m=point, probability=0.4
    )


def test_it_looks_at_the_answer_or_at_the_alternative_that_was_chosen() -> None:
    assert point_of(fixation()).point_rig_m == (0.07, 0.14, 3.99)
    chosen = fixation(alternatives=[alternative("both_foveae")], chosen_alternative=0)
    assert (point_of(chosen).point_rig_m, point_of(chosen).distance_m) == ((0.1, 0.2, 7.99), 8.0)


def test_what_one_fovea_does_not_see_is_refused() -> None:
    with pytest.raises(InvalidInput, match="one fovea does not see it"):
        point_of(fixation(basis="fovea_and_wide"))
    hidden = fixation(alternatives=[alternative("fovea_and_wide")], chosen_alternative=0)
    with pytest.raises(InvalidInput, match="one fovea does not see it"):
        point_of(hidden)


def test_what_has_no_known_distance_is_refused() -> None:
    nothing = {"distance_m": None, "distance_sigma_m": None, "point_rig_m": None}
    with pytest.raises(InvalidInput, match="no distance of it is known"):
        point_of(fixation(basis="bound", **nothing))
