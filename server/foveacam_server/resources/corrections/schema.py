"""The shapes of the operator's corrections."""

from typing import Literal

from foveacam_server.api.models import RequestModel
from foveacam_server.quantities import Index


class ChoiceRequest(RequestModel):
    """Which alternative of the fixation is the true one, counted from 0."""

    alternative: Index


class CorrectionRequest(RequestModel):
    """Where the target is in truth, seen from the present answer."""

    direction: Literal["nearer", "farther"]
