"""The command `foveacam confirm-zero pan-tilt|rail --server URL`, for a positioner without switches."""

from enum import StrEnum
from typing import Annotated

import typer

from foveacam_hardware.contract import FoveaError
from foveacam_server.commands.server_rig import server_rig
from foveacam_server.foundation.settings import checked_settings


class ZeroedPositioner(StrEnum):
    """Positioners whose zero can be confirmed."""

    PAN_TILT = "pan-tilt"
    RAIL = "rail"


def confirm_zero(
    positioner: Annotated[ZeroedPositioner, typer.Argument(help="positioner that stands at its zero")],
    server: Annotated[
        str, typer.Option(help="the running server; FOVEACAM_TOKEN is sent to it")
    ] = "http://127.0.0.1:8000",
) -> None:
    """Confirm that the pan-tilt or the rail stands at its zero, for a board without reference switches."""
    with server_rig(server, token=checked_settings({}).token) as rig:
        noun = rig.api.rail if positioner is ZeroedPositioner.RAIL else rig.api.pan_tilt
        fault = noun.confirm_zero().fault
    if fault is not None:
        raise FoveaError(f"{positioner}: its zero was confirmed, but it still has a fault: {fault}")
    typer.echo(f"{positioner}: its present position is now its zero")
