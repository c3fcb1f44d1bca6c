"""The shape of the answer about where each eye can look."""

from foveacam_server.api.models import Told


class ReachDocument(Told):
    """Outlines of where each eye can look, corners in wide px; they may leave the image.

    `distance_m`: from the rig's origin, where the outlines are taken; null is infinity.
    """

    calibration_id: str
    distance_m: float | None
    left_px: list[tuple[float, float]]
    right_px: list[tuple[float, float]]
