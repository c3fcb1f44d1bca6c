"""Schema of a suggested target."""

from foveacam_server.foundation.schema import ResponseModel


class SuggestionDocument(ResponseModel):
    """A good target for a first look; `score`: salience relative to the picture's best, which has 1.

    `verified`: both foveae have looked at it and verged; else it is chosen by the wide picture alone.
    """

    x_px: float
    y_px: float
    ax_deg: float
    ay_deg: float
    score: float
    verified: bool
