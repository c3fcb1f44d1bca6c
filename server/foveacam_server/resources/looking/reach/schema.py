"""Schema of the reach of each eye."""

from typing import Annotated, TypeAlias

from pydantic import Field

from foveacam_server.foundation.schema import ResponseModel

Corner: TypeAlias = Annotated[list[float], Field(min_length=2, max_length=2)]
"""(x, y), wide px."""


class ReachDocument(ResponseModel):
    """Outlines of each eye's calibrated field, corners in wide px; they may extend beyond the image.

    `distance_m`: from the rig's origin, where the outlines are taken; null is infinity.
    """

    calibration_id: str
    distance_m: float | None
    left_px: list[Corner]
    right_px: list[Corner]
