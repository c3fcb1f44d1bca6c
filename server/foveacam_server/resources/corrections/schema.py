"""The shapes of the operator's corrections."""

from typing import Annotated, Literal

from pydantic import Field

from foveacam_server.api.models import Asked


class ChoiceRequest(Asked):
    """Which alternative of the fixation is the true one, counted from 0."""

    alternative: Annotated[int, Field(ge=0)]


class CorrectionRequest(Asked):
    """Where the target is in truth, seen from the present answer."""

    direction: Literal["nearer", "farther"]
