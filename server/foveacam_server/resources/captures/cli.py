"""The command `foveacam capture [PLAN] --name NAME [--resume | --watch | --cancel] [--server URL]`."""

from pathlib import Path
from typing import Annotated

import typer

from foveacam_hardware.contract import InvalidInput
from foveacam_server.commands.options import RigOptions, on_rig


@on_rig(usual_scene="bench")
def capture(
    rig_options: RigOptions,
    plan: Annotated[
        Path | None, typer.Argument(help="plan (.json), or set points as text; without one, a grid")
    ] = None,
    *,
    name: Annotated[str, typer.Option(help="name of the capture; becomes its folder")],
    resume: Annotated[bool, typer.Option("--resume", help="go on with the capture of that name")] = False,
    estimate: Annotated[
        bool, typer.Option("--estimate", help="say how long and how large it gets, and take nothing")
    ] = False,
    columns: Annotated[int | None, typer.Option(help="points across; usually 9")] = None,
    rows: Annotated[int | None, typer.Option(help="points down; usually 9")] = None,
    half_width_deg: Annotated[
        float | None, typer.Option(help="from the middle to the outermost points; usually all there is")
    ] = None,
    half_height_deg: Annotated[float | None, typer.Option(help="the same, down")] = None,
    distance_m: Annotated[
        float | None, typer.Option(help="where both eyes meet; usually the scene's average, measured")
    ] = None,
    each_point: Annotated[bool, typer.Option("--each-point", help="verge anew at every point")] = False,
    exposure_ms: Annotated[
        list[float] | None, typer.Option(help="exposure; given again, a bracket at every point")
    ] = None,
    stack: Annotated[int | None, typer.Option(help="frames of every exposure, kept as their mean")] = None,
    rail_mm: Annotated[
        list[float] | None, typer.Option(help="place on the rail; given again, a scan from each")
    ] = None,
    label: Annotated[str, typer.Option(help="a line for people")] = "",
    codec: Annotated[str, typer.Option(help="tiff (full pace) or png (half the room)")] = "tiff",
    server: Annotated[
        str | None,
        typer.Option(help="have a running server take it with its rig, such as http://127.0.0.1:8000"),
    ] = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="show how far the server is with it; Ctrl-C lets it go on")
    ] = False,
    cancel: Annotated[
        bool, typer.Option("--cancel", help="end the server's capture; what was taken is kept")
    ] = False,
) -> None:
    """Take a raster of both foveae into a dataset; Ctrl-C leaves a valid partial one."""
    from foveacam_server.resources.captures.cli_remote import CaptureAction, run_at
    from foveacam_server.resources.captures.cli_run import CaptureOrder, codec_of, plan_of, run_order

    grid = {
        "columns": columns,
        "rows": rows,
        "half_width_deg": half_width_deg,
        "half_height_deg": half_height_deg,
    }
    verging = {
        "mode": None if distance_m is None else "given",
        "distance_m": distance_m,
        "each_point": each_point or None,
    }
    options = {
        "points": {key: value for key, value in grid.items() if value is not None},
        "verging": {key: value for key, value in verging.items() if value is not None},
        "exposures_ms": exposure_ms,
        "stack_frames": stack,
        "rail_positions_mm": rail_mm,
    }
    flags = {"--resume": resume, "--watch": watch, "--cancel": cancel, "--estimate": estimate}
    given = [flag for flag, wanted in flags.items() if wanted]
    if len(given) > 1:
        raise InvalidInput(f"{' and '.join(given)}: one thing at a time; leave the others out")
    if server is None and (watch or cancel):
        raise InvalidInput(f"{given[0]}: it is about a server's capture; say whose with --server URL")
    begun = None if not given or estimate else given[0]
    order = CaptureOrder(
        name=name,
        plan=plan_of(plan, {key: value for key, value in options.items() if value}, begun=begun),
        label=label,
        codec=codec_of(codec),
        estimate=estimate,
    )
    if server is None:
        run_order(rig_options, order)
    else:
        run_at(
            rig_options,
            order,
            CaptureAction(given[0].lstrip("-")) if given else CaptureAction.TAKE,
            server=server,
        )
