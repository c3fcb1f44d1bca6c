"""What a simulated rig's TOML file may say of the person who turns it, where its pan-tilt is manual."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class OperatorConfig(BaseModel):
    """Somebody who turns the rig where it is wanted: after a while, at a pace, not quite there."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    delay_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.8
    """From being asked to beginning to turn."""
    speed_deg_s: Annotated[float, Field(gt=0.0, le=200.0)] = 12.0
    error_deg: Annotated[float, Field(ge=0.0, le=5.0)] = 0.15
    """Standard deviation on either axis; never more than twice as much."""
