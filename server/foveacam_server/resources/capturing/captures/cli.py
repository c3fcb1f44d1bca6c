"""The command `foveacam capture [PLAN] --name NAME [--resume | --watch | --cancel | --estimate]`."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from foveacam_hardware.contract import InvalidInput
from foveacam_server.commands.options import RigOptions, on_rig

if TYPE_CHECKING:
    from foveacam_server.resources.capturing.captures.cli_order import CaptureOrder

PlanArgument = Annotated[
    Path | None, typer.Argument(help="plan (.json), or set points as text; without one, a grid")
]
EstimateOption = Annotated[bool, typer.Option("--estimate", help="print time and size, and capture nothing")]
HalfWidthOption = Annotated[
    float | None, typer.Option(help="from the middle to the outermost points; usually all there is")
]
DistanceOption = Annotated[
    float | None, typer.Option(help="distance at which both gazes meet; usually the scene's mean, measured")
]
ExposureOption = Annotated[
    list[float] | None, typer.Option(help="exposure; given again, a bracket at every point")
]
StackOption = Annotated[int | None, typer.Option(help="frames of every exposure, kept as their mean")]
RailOption = Annotated[
    list[float] | None, typer.Option(help="place on the rail; given again, a scan from each")
]
ServerOption = Annotated[
    str | None,
    typer.Option(help="capture with the rig of a running server, such as http://127.0.0.1:8000"),
]
WatchOption = Annotated[
    bool, typer.Option("--watch", help="show the progress of the server's capture; Ctrl-C does not end it")
]
CancelOption = Annotated[
    bool, typer.Option("--cancel", help="end the server's capture; what was taken is kept")
]


@on_rig(usual_scene="bench")
def capture(
    rig_options: RigOptions,
    plan: PlanArgument = None,
    *,
    name: Annotated[
        str, typer.Option(help="name of the capture; becomes its folder; not needed to estimate")
    ] = "",
    resume: Annotated[bool, typer.Option("--resume", help="resume the capture of that name")] = False,
    estimate: EstimateOption = False,
    columns: Annotated[int | None, typer.Option(help="points across; usually 9")] = None,
    rows: Annotated[int | None, typer.Option(help="points down; usually 9")] = None,
    half_width_deg: HalfWidthOption = None,
    half_height_deg: Annotated[float | None, typer.Option(help="the same, down")] = None,
    distance_m: DistanceOption = None,
    each_point: Annotated[bool, typer.Option("--each-point", help="verge again at every point")] = False,
    exposure_ms: ExposureOption = None,
    stack: StackOption = None,
    rail_mm: RailOption = None,
    label: Annotated[str, typer.Option(help="a line for people")] = "",
    codec: Annotated[str, typer.Option(help="tiff (full pace) or png (half the room)")] = "tiff",
    server: ServerOption = None,
    watch: WatchOption = False,
    cancel: CancelOption = False,
) -> None:
    """Take a raster of both foveae into a dataset; Ctrl-C leaves a valid partial one."""
    from foveacam_server.resources.capturing.captures.cli_order import CaptureOrder, codec_of, plan_of

    flags = {"--resume": resume, "--watch": watch, "--cancel": cancel, "--estimate": estimate}
    flag = _flag_given(flags, server=server)
    if not name and not estimate:
        raise InvalidInput("capture: it has no name; give one with --name, it becomes its folder")
    grid = {
        "columns": columns,
        "rows": rows,
        "half_width_deg": half_width_deg,
        "half_height_deg": half_height_deg,
    }
    options = {
        "points": _given(grid),
        "verging": _verging(distance_m=distance_m, each_point=each_point),
        "exposures_ms": exposure_ms,
        "stack_frames": stack,
        "rail_positions_mm": rail_mm,
    }
    plan_options = {key: value for key, value in options.items() if value}
    order = CaptureOrder(
        name=name,
        plan=plan_of(plan, plan_options, begun=None if estimate else flag),
        label=label,
        codec=codec_of(codec),
        estimate=estimate,
    )
    _run(rig_options, order, flag=flag, server=server)


def _run(rig_options: RigOptions, order: "CaptureOrder", *, flag: str | None, server: str | None) -> None:
    """Capture with a rig of its own, or order it of a server."""
    if server is None:
        from foveacam_server.resources.capturing.captures.cli_run import run_order

        run_order(rig_options, order)
    else:
        from foveacam_server.resources.capturing.captures.cli_remote import CaptureAction, run_at

        action = CaptureAction.TAKE if flag is None else CaptureAction(flag.lstrip("-"))
        run_at(rig_options, order, action, server=server)


def _flag_given(flags: Mapping[str, bool], *, server: str | None) -> str | None:
    """Return the given flag, if any; raise for two, and for a flag about a server without its address."""
    given = [flag for flag, wanted in flags.items() if wanted]
    if len(given) > 1:
        raise InvalidInput(f"{' and '.join(given)}: one at a time; leave the others out")
    if server is None and given and given[0] in ("--watch", "--cancel"):
        raise InvalidInput(f"{given[0]}: it is about a server's capture; name the server with --server URL")
    return given[0] if given else None


def _verging(*, distance_m: float | None, each_point: bool) -> dict[str, object]:  # object: as below
    mode = None if distance_m is None else "given"
    return _given({"mode": mode, "distance_m": distance_m, "each_point": each_point or None})


def _given(options: Mapping[str, object]) -> dict[str, object]:  # object: the plan checks the values
    return {key: value for key, value in options.items() if value is not None}
