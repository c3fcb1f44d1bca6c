"""What is typed: `foveacam confirm-zero pan-tilt|rail --server URL`, for a positioner without switches."""

from enum import StrEnum
from typing import Annotated

import typer

from foveacam_hardware.contract import FoveaError
from foveacam_server.commands.server_rig import server_rig
from foveacam_server.foundation.settings import checked_settings


class ZeroedPositioner(StrEnum):
    """What can stand at its zero."""

    PAN_TILT = "pan-tilt"
    RAIL = "rail"


def confirm_zero(
    positioner: Annotated[ZeroedPositioner, typer.Argument(help="what stands at its zero")],
    server: Annotated[
        str, typer.Option(help="the running server; FOVEACAM_TOKEN is sent to it")
    ] = "http://127.0.0.1:8000",
) -> None:
    """Say that the pan-tilt or the rail stands at its zero: a board without switches does not know."""
    with server_rig(server, token=checked_settings({}).token) as rig:
        noun = rig.api.rail if positioner is ZeroedPositioner.RAIL else rig.api.pan_tilt
        fault = noun.confirm_zero().fault
    if fault is not None:
        raise FoveaError(f"{positioner}: it was said to stand at its zero, and has a fault still: {fault}")
    typer.echo(f"{positioner}: it counts from where it stands, its zero")
