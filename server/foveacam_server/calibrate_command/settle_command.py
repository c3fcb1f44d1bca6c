"""`foveacam calibrate settle-time`: how long the rig waits after every move, and who says so."""

import json
from typing import Annotated

import typer

from foveacam_hardware.contract import InvalidInput
from foveacam_server.calibrate_command.choices import CalibrateOptions, SessionOption, on_rig

app = typer.Typer(add_completion=False)


@app.command(name="settle-time")
@on_rig(usual_scene="calibration")
def settle_time(
    wish: CalibrateOptions,
    *,
    apply: Annotated[
        bool, typer.Option("--apply", help="wait as long as the session has measured, from now on")
    ] = False,
    rig_file: Annotated[
        bool, typer.Option("--rig-file", help="wait as long as the rig's file says, from now on")
    ] = False,
    session: SessionOption = None,
) -> None:
    """Show or change how long the rig waits after every move; nothing is measured for it."""
    from foveacam_server.calibrate_command.rig import RigChoice, opened_shop
    from foveacam_server.calibrate_command.runs import found_session
    from foveacam_server.calibrating.settle_measured import measured_time
    from foveacam_server.calibrating.settle_times import settle_time_document

    if apply and rig_file:
        raise InvalidInput("settle-time: --apply and --rig-file exclude each other; give one of them")
    choice = RigChoice.of(wish)
    with opened_shop(choice) as shop:
        if apply:
            measured = measured_time(found_session(shop, session))
            measured.check_filter(choice.drive.low_pass_hz)
            shop.settle_times.keep(measured)
        if rig_file:
            shop.settle_times.forget(shop.rig_id)
        known = shop.settle_times.of(shop.rig_id)
    in_use = known if known is not None and known.suits(choice.drive.low_pass_hz) else None
    found = settle_time_document(in_use, rig_file_us=choice.drive.settle_us)
    if wish.as_json:
        typer.echo(json.dumps(found))
        return
    typer.echo(f"{shop.rig_id} waits {found['settle_us'] / 1e3:g} ms after every move: {found['source']}")
