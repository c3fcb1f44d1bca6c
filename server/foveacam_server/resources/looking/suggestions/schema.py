"""The shape of a suggestion."""

from foveacam_server.foundation.schema import ResponseModel


class SuggestionDocument(ResponseModel):
    """A good target for a first look; `score`: how well it stands out, 1 as the best of the picture."""

    x_px: float
    y_px: float
    ax_deg: float
    ay_deg: float
    score: float
