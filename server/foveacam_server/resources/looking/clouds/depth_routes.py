"""Route of the depth at a wide pixel, from the newest depth map that covers it."""

from typing import Annotated

from fastapi import Query

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.names import age_s
from foveacam_server.foundation.quantities import Pixels
from foveacam_server.resources.looking.clouds.collection import CloudCollection
from foveacam_server.resources.looking.clouds.schema import DepthDocument
from foveacam_server.rig.ports import CalibrationInForce

router = GuardedRouter(tags=["depth"], reading=Right.VIEW, changing=Right.OPERATE)


PixelQuery = Annotated[Pixels, Query(description="wide pixel; the first one's centre is 0")]


@router.get("/depth", summary="Depth at a wide pixel", responses=problems(404, 409, 503))
def depth(
    x_px: PixelQuery,
    y_px: PixelQuery,
    calibration_in_force: Provided[CalibrationInForce],
    clouds: Provided[CloudCollection],
) -> DepthDocument:
    """Return distance and point at a wide pixel that a fovea has looked at."""
    calibration = calibration_in_force.require()
    reading = clouds.patches.at(x_px, y_px, wide=calibration.wide)
    return DepthDocument(
        x_px=x_px,
        y_px=y_px,
        distance_m=round(reading.distance_m, 6),
        distance_sigma_m=round(reading.distance_sigma_m, 6),
        point_rig_m=reading.point_rig_m,
        fixation_id=reading.fixation_id,
        age_s=round(age_s(reading.created_utc), 1),
    )
