"""Reads the target and the distance limits of a fixation request, and checks them."""

import math

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.values import (
    DirectionTarget,
    DistanceRange,
    PixelTarget,
    RectangleTarget,
    Target,
)
from foveacam_server.resources.looking.fixations.schema import FixationRequest, Pixel, Rectangle
from foveacam_server.rig.refusals import check_direction
from foveacam_server.rig.schema import Direction


def target_of(request: FixationRequest) -> Target:
    """Return the target that a request names; exactly one of pixel, rectangle and direction."""
    match request.pixel, request.rectangle, request.direction:
        case Pixel() as pixel, None, None:
            return PixelTarget(**pixel.model_dump())
        case None, Rectangle() as box, None:
            return RectangleTarget(**box.model_dump())
        case None, None, Direction() as direction:
            return DirectionTarget(
                ax_rad=math.radians(direction.ax_deg), ay_rad=math.radians(direction.ay_deg)
            )
    given = [kind for kind in ("pixel", "rectangle", "direction") if getattr(request, kind) is not None]
    found = " and ".join(given) or "none"
    raise InvalidInput(
        f"a fixation needs exactly one of pixel, rectangle and direction, found {found}",
        asked="a fixation",
        found=found,
        remedy='send one of them, such as {"pixel": {"x_px": 720, "y_px": 540}}',
    )


def depth_range_of(request: FixationRequest) -> DistanceRange | None:
    """Return the limits of the distance in a request; None when it has none.

    Raise `InvalidInput` when the range is empty.
    """
    if request.within is None:
        return None
    nearest_m = request.within.nearest_m
    farthest_m = math.inf if request.within.farthest_m is None else request.within.farthest_m
    if not 0.0 <= nearest_m < farthest_m:
        raise InvalidInput(
            f"within: nearest_m = {nearest_m:g} and farthest_m = {farthest_m:g} leave no distance",
            asked=f"{nearest_m:g} to {farthest_m:g} m",
            found="an empty range",
            remedy="send a nearest_m of 0 or more and a larger farthest_m, or none",
        )
    return DistanceRange(nearest_m=nearest_m, farthest_m=farthest_m)


def check_target(target: Target, calibration: Calibration) -> None:
    """Raise `OutOfRange` when the target is outside the wide image, or beyond the mirrors' specification."""
    wide = calibration.wide
    match target:
        case PixelTarget():
            wide.check_pixel(target.x_px, target.y_px)
        case RectangleTarget():
            wide.check_rectangle(
                target.x_px, target.y_px, width_px=target.width_px, height_px=target.height_px
            )
        case DirectionTarget():
            check_direction(target.ax_rad, target.ay_rad)


def direction_of(target: Target, calibration: Calibration) -> tuple[float, float]:
    """Return the direction (ax, ay), rad, of the target's centre."""
    match target:
        case DirectionTarget():
            return target.ax_rad, target.ay_rad
        case PixelTarget():
            centre = (target.x_px, target.y_px)
        case RectangleTarget():
            centre = (target.x_px + target.width_px / 2.0, target.y_px + target.height_px / 2.0)
    ax_rad, ay_rad = calibration.wide.angles_rad([centre])[0].tolist()
    return ax_rad, ay_rad
