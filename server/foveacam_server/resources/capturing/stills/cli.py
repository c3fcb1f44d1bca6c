"""The command `foveacam still [--server URL] [--name NAME] [--frames N]`."""

from typing import Annotated

import typer

from foveacam_server.commands.options import RigOptions, on_rig


@on_rig(usual_scene="bench")
def still(
    rig_options: RigOptions,
    *,
    name: Annotated[str | None, typer.Option(help="name of the still; usually the date and time")] = None,
    frames: Annotated[int, typer.Option(help="frames of every camera, 1 to 64")] = 5,
    every_frame: Annotated[
        bool, typer.Option("--every-frame", help="keep all frames, not their mean in 16 bits")
    ] = False,
    camera: Annotated[
        list[str] | None, typer.Option(help="wide, left or right; given again, several; usually all")
    ] = None,
    label: Annotated[str, typer.Option(help="a line for people")] = "",
    codec: Annotated[str, typer.Option(help="png or tiff")] = "png",
    server: Annotated[
        str | None,
        typer.Option(help="press the button of a running server, such as http://127.0.0.1:8000"),
    ] = None,
) -> None:
    """Take a stack of every camera at the mirrors' present pose: at rest, unless a server has the rig."""
    from foveacam_server.resources.capturing.stills.cli_run import StillOrder, run_order

    order = StillOrder.checked(
        name=name, frames=frames, every_frame=every_frame, cameras=camera, label=label, codec=codec
    )
    run_order(rig_options, order, server=server)
