"""The command `foveacam look X Y [--server URL] [--save FILE]`."""

from pathlib import Path
from typing import Annotated

import typer

from foveacam_server.commands.options import RigOptions, on_rig

XArgument = Annotated[
    float,
    typer.Argument(metavar="X", help="place in the wide view, px from its left: unbinned, as REST has it"),
]
YArgument = Annotated[float, typer.Argument(metavar="Y", help="the same, from its top")]
SaveOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="also write its shape: .ply (points), .glb (textured surface) or .png (depth as a picture)",
    ),
]
ServerOption = Annotated[
    str | None,
    typer.Option(help="look with the rig of a running server, such as http://127.0.0.1:8000"),
]


@on_rig(usual_scene="bench")
def look(
    rig_options: RigOptions,
    x_px: XArgument,
    y_px: YArgument,
    *,
    save: SaveOption = None,
    server: ServerOption = None,
) -> None:
    """Point both foveae at a place of the wide view; print its distance and how it is known."""
    from foveacam_server.resources.looking.fixations.cli_order import LookOrder

    order = LookOrder.checked(x_px, y_px, save=save)
    if server is None:
        from foveacam_server.resources.looking.fixations.cli_run import run_look

        run_look(rig_options, order)
    else:
        from foveacam_server.resources.looking.fixations.cli_remote import run_look_at

        run_look_at(rig_options, order, server=server)
