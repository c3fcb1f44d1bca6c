"""Route of the reach: the outline of each eye's calibrated field in the wide image."""

import math
from typing import Annotated

from fastapi import Query

from foveacam_hardware.contract import Role
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.reach import reach_outline_px
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.resources.looking.reach.schema import ReachDocument
from foveacam_server.rig.ports import CalibrationInForce

NEAREST_M, FARTHEST_M = 0.5, 1e6
"""Limits of the requested distance; at distances of about the baseline the foveae cannot verge."""

router = GuardedRouter(tags=["reach"], reading=Right.VIEW, changing=Right.OPERATE)


Distance = Annotated[
    float | None,
    Query(ge=NEAREST_M, le=FARTHEST_M, description="from the rig, m; without it: infinity"),
]


@router.get("/reach", summary="Where each eye can look", responses=problems(409, 503))
def reach(calibration_in_force: Provided[CalibrationInForce], distance_m: Distance = None) -> ReachDocument:
    """Return the outline of each eye's calibrated field in the wide image."""
    calibration = calibration_in_force.require()
    at_m = math.inf if distance_m is None else distance_m
    return ReachDocument(
        calibration_id=calibration.id,
        distance_m=distance_m,
        left_px=_corners(calibration, Role.LEFT, at_m),
        right_px=_corners(calibration, Role.RIGHT, at_m),
    )


def _corners(calibration: Calibration, role: Role, distance_m: float) -> list[list[float]]:
    outline_px = reach_outline_px(calibration, role, distance_m=distance_m)
    return [[round(x_px, 2), round(y_px, 2)] for x_px, y_px in outline_px.tolist()]
