"""Messages of the steering socket: parses the client's, builds the server's."""

import json
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from foveacam_hardware.contract import FoveaError, InvalidInput, MirrorVolts, StereoVolts
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.quantities import Label, deg
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.resources.devices.mirrors.schema import SteerGaze, VoltsRequest
from foveacam_server.resources.devices.mirrors.targets import SHIFT_LIMIT_DEG
from foveacam_server.rig.hand_steering import PARK_S, SILENT_S

MAX_MESSAGE_LENGTH = 4096
EXAMPLE = '{"type":"steer","held":true,"volts":{"left":{"x_v":10.0,"y_v":0.0}}}'


class Begin(RequestModel):
    """The first message: who steers, with the lease's token where the lease is held."""

    type: Literal["begin"]
    name: Label = "somebody"
    lease: Annotated[str, Field(max_length=200)] | None = None


class Steer(RequestModel):
    """A target, and whether the client keeps holding; without a target, a sign of life.

    When not held, the mirrors go to this or the last target and stay there.
    """

    type: Literal["steer"]
    held: bool
    volts: VoltsRequest | None = None
    gaze: SteerGaze | None = None

    @model_validator(mode="after")
    def _one_place(self) -> "Steer":
        if self.volts is not None and self.gaze is not None:
            raise ValueError("give volts or a gaze, not both")
        return self


_FROM_CLIENT: TypeAdapter[Begin | Steer] = TypeAdapter(Annotated[Begin | Steer, Field(discriminator="type")])


def parse(text: str) -> Begin | Steer:
    """Parse a client's message; raise `InvalidInput` when it cannot be used."""
    if len(text) > MAX_MESSAGE_LENGTH:
        raise InvalidInput(f"a message has at most {MAX_MESSAGE_LENGTH} characters, found {len(text)}")
    try:
        return _FROM_CLIENT.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "message"
        raise InvalidInput(f"{place}: {first['msg']}", remedy=f"send {EXAMPLE}") from error


def hello(*, max_v: float, calibrated: bool) -> str:
    """Return the answer to `begin`: the limits, and the timeout of a silent client."""
    return json.dumps(
        {
            "type": "hello",
            "max_v": max_v,
            "calibrated": calibrated,
            "shift_limit_deg": SHIFT_LIMIT_DEG,
            "silent_after_s": SILENT_S,
            "park_after_s": PARK_S,
        }
    )


def state(
    *,
    status: str,
    reason: str | None,
    by: str | None,
    pose: StereoVolts | None,
    target: StereoVolts | None,
    gaze_rad: tuple[float, float] | None,
) -> str:
    """Return the session's state, who holds the mirrors, and the mirrors' pose; null: unknown.

    `gaze_rad`: mean direction (ax, ay) of both eyes.
    """
    return json.dumps(
        {
            "type": "state",
            "status": status,
            "reason": reason,
            "by": by,
            "pose": None if pose is None else _volts(pose),
            "target": None if target is None else _volts(target),
            "gaze": None if gaze_rad is None else {"ax_deg": deg(gaze_rad[0]), "ay_deg": deg(gaze_rad[1])},
        }
    )


def problem(error: FoveaError) -> str:
    """Return the answer to a refused message: the problem document as in REST."""
    return json.dumps({**problem_of(error).document().model_dump(exclude_unset=True), "type": "problem"})


def _volts(volts: StereoVolts) -> dict[str, dict[str, float]]:
    return {"left": _eye(volts.left), "right": _eye(volts.right)}


def _eye(volts: MirrorVolts) -> dict[str, float]:
    return {"x_v": round(volts.x_v, 4), "y_v": round(volts.y_v, 4)}
