"""The shapes of the operator's corrections."""

from typing import Literal

from foveacam_server.foundation.quantities import Index
from foveacam_server.foundation.schema import RequestModel


class ChoiceRequest(RequestModel):
    """Which alternative of the fixation is the true one, counted from 0."""

    alternative: Index


class CorrectionRequest(RequestModel):
    """Where the target is in truth, seen from the present answer."""

    direction: Literal["nearer", "farther"]
