"""`foveacam calibrate`: one command for each calibration step, and for the settle time in use.

A simulated rig runs in virtual time, so a step takes as long as its computation, unless `--real-time`.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_server.commands.calibrate_records import app as records_app
from foveacam_server.commands.options import (
    LabelOption,
    RigOptions,
    SessionOption,
    on_rig,
    parse_pair,
)
from foveacam_server.foundation.plain_words import validated
from foveacam_server.resources.calibrating.sessions import options as of_step

app = typer.Typer(
    name="calibrate",
    help="Calibrate a rig: wide camera, mirrors, rectification; drift, check, records, report.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

ROOM = "calibration"
"""Scene with boards and markers in which the simulated rig is calibrated."""

BoardOption = Annotated[str | None, typer.Option(help="inner corners of the board, such as 9x6")]
SquareOption = Annotated[float | None, typer.Option(help="side of a square of the board, mm")]
MarkerOption = Annotated[float | None, typer.Option(help="side of a marker, mm: a ChArUco board")]
DictionaryOption = Annotated[
    str | None, typer.Option(help="of the markers, as the board was printed: 4X4_50, 6X6_250 ...")
]
LegacyOption = Annotated[
    bool, typer.Option("--legacy-pattern", help="a ChArUco board as OpenCV drew it before 4.6")
]
ImagesOption = Annotated[Path | None, typer.Option(help="folder of images to use instead of the rig")]
PatternOption = Annotated[str, typer.Option(help="which images of the folder, such as 'left*'")]
ModelOption = Annotated[str | None, typer.Option(help="lens model: five or rational")]
ViewsOption = Annotated[int | None, typer.Option(help="how many views of the board to take")]
StationOption = Annotated[list[str] | None, typer.Option(help="where to sweep; may be given again")]
NodesOption = Annotated[str | None, typer.Option(help="poses of the sweep, such as 9x9")]
OrderOption = Annotated[int | None, typer.Option(help="order of the mirrors' polynomial; usually by scores")]


@app.command()
@on_rig(usual_scene=ROOM)
def wide(
    rig_options: RigOptions,
    *,
    images: ImagesOption = None,
    pattern: PatternOption = "*",
    station: Annotated[str | None, typer.Option(help="where the board is shown")] = None,
    board: BoardOption = None,
    square_mm: SquareOption = None,
    marker_mm: MarkerOption = None,
    dictionary: DictionaryOption = None,
    legacy_pattern: LegacyOption = False,
    views: ViewsOption = None,
    model: ModelOption = None,
    session: SessionOption = None,
    label: LabelOption = None,
) -> None:
    """Stage 1: measure the wide camera with a board, or from a folder of images."""
    options = validated(
        of_step.WideOptions,
        {
            "station": station,
            "board": _board(board, square_mm, marker_mm, dictionary, legacy_pattern=legacy_pattern),
            "views": views,
            "model": model,
        },
    )
    run = of_step.WideRun(step="wide", options=options)
    _run_with_board(rig_options, run, session=session, label=label, images=images, pattern=pattern)


@app.command()
@on_rig(usual_scene=ROOM)
def lens(
    rig_options: RigOptions,
    *,
    camera: Annotated[Role, typer.Option(help="camera whose lens to measure; wide as by the command wide")],
    images: ImagesOption = None,
    pattern: PatternOption = "*",
    station: Annotated[str | None, typer.Option(help="where the board is shown")] = None,
    board: BoardOption = None,
    square_mm: SquareOption = None,
    marker_mm: MarkerOption = None,
    dictionary: DictionaryOption = None,
    legacy_pattern: LegacyOption = False,
    views: ViewsOption = None,
    session: SessionOption = None,
    label: LabelOption = None,
) -> None:
    """Measure the lens of any camera with a board; a fovea's is for information, no other step uses it."""
    described = _board(board, square_mm, marker_mm, dictionary, legacy_pattern=legacy_pattern)
    shown = {"station": station, "board": described, "views": views}
    if camera is Role.WIDE:
        wide_options = validated(of_step.WideOptions, shown)
        run: of_step.WideRun | of_step.LensRun = of_step.WideRun(step="wide", options=wide_options)
    else:
        run = of_step.LensRun(
            step="lens", options=validated(of_step.LensOptions, {"camera": camera.value, **shown})
        )
    _run_with_board(rig_options, run, session=session, label=label, images=images, pattern=pattern)


@app.command()
@on_rig(usual_scene=ROOM)
def mirrors(
    rig_options: RigOptions,
    *,
    station: StationOption = None,
    nodes: NodesOption = None,
    extent_ax_deg: Annotated[float | None, typer.Option(help="outermost gaze across, degrees")] = None,
    extent_ay_deg: Annotated[float | None, typer.Option(help="outermost gaze down, degrees")] = None,
    spacing: Annotated[str | None, typer.Option(help="rim (denser there) or even")] = None,
    restart: Annotated[bool, typer.Option("--restart", help="set earlier sweeps aside")] = False,
    session: SessionOption = None,
) -> None:
    """Stage 2: sweep the mirrors over the field on the markers, or resume an interrupted sweep."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_in_session

    grid = parse_pair(nodes, option="--nodes", example="9x9")
    options = validated(
        of_step.MirrorsOptions,
        {
            "stations": station or None,
            "nodes": None if grid is None else list(grid),
            "extent_ax_deg": extent_ax_deg,
            "extent_ay_deg": extent_ay_deg,
            "spacing": spacing,
            "restart": restart,
        },
    )
    run_in_session(
        rig_options, of_step.MirrorsRun(step="mirrors", options=options), SessionChoice(session=session)
    )


@app.command()
@on_rig(usual_scene=ROOM)
def rectify(
    rig_options: RigOptions,
    *,
    label: LabelOption = None,
    order: OrderOption = None,
    farthest_only: Annotated[
        bool, typer.Option("--farthest-only", help="fit the sweep over the farthest markers alone")
    ] = False,
    activate: Annotated[bool, typer.Option("--activate", help="put the result in force")] = False,
    session: SessionOption = None,
) -> None:
    """Fit stages 2 and 3 to the measurements: volts to angles, and the rectification."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_fit_in_session

    options = validated(
        of_step.FitOptions, {"label": label, "order": order, "use_all_distances": not farthest_only}
    )
    run_fit_in_session(rig_options, options, SessionChoice(session=session), activate=activate)


@app.command()
@on_rig(usual_scene=ROOM)
def check(
    rig_options: RigOptions,
    *,
    poses: Annotated[int | None, typer.Option(help="how many poses outside the sweep")] = None,
    session: SessionOption = None,
) -> None:
    """Check the fitted calibration at poses that no sweep visited."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_in_session

    options = validated(of_step.CheckOptions, {"poses": poses})
    run_in_session(
        rig_options, of_step.CheckRun(step="check", options=options), SessionChoice(session=session)
    )


@app.command()
@on_rig(usual_scene=ROOM)
def settle(
    rig_options: RigOptions,
    *,
    apply: Annotated[bool, typer.Option("--apply", help="put the measured settle time in use")] = False,
    session: SessionOption = None,
) -> None:
    """Measure how fast each mirror axis comes to rest, and its resonance."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_in_session

    run = of_step.SettleRun(step="settle", options=of_step.SettleOptions(apply=apply))
    run_in_session(rig_options, run, SessionChoice(session=session))


@app.command(name="all")
@on_rig(usual_scene=ROOM)
def run_all(
    rig_options: RigOptions,
    *,
    nodes: NodesOption = None,
    station: StationOption = None,
    views: ViewsOption = None,
    label: LabelOption = None,
    order: OrderOption = None,
    without_settle: Annotated[
        bool, typer.Option("--without-settle", help="leave out the settle characterisation")
    ] = False,
    apply_settle: Annotated[
        bool,
        typer.Option(
            "--apply-settle/--no-apply-settle",
            help="put the measured settle time in use",
        ),
    ] = True,
    activate: Annotated[
        bool, typer.Option("--activate/--no-activate", help="put the result in force")
    ] = True,
    session: SessionOption = None,
) -> None:
    """Calibrate from scratch: all steps in order."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_in_session

    grid = parse_pair(nodes, option="--nodes", example="9x9")
    options = validated(
        of_step.AllOptions,
        {
            "wide": validated(of_step.WideOptions, {"views": views}),
            "mirrors": validated(
                of_step.MirrorsOptions,
                {"stations": station or None, "nodes": None if grid is None else list(grid)},
            ),
            "fit": validated(of_step.FitOptions, {"label": label, "order": order}),
            "settle": not without_settle,
            "apply_settle": apply_settle,
            "activate": activate,
        },
    )
    run = of_step.AllRun(step="all", options=options)
    run_in_session(rig_options, run, SessionChoice(session=session, label=label, begin=True))


@app.command()
@on_rig(usual_scene="bench")
def drift(
    rig_options: RigOptions,
    *,
    distance_m: Annotated[
        float | None,
        typer.Option(help="distance of the scene's centre, if known", min=0.5),
    ] = None,
    apply: Annotated[bool, typer.Option("--apply", help="correct a significant drift")] = False,
) -> None:
    """Measure the drift of the eyes since their calibration, by a look into the scene."""
    from foveacam_server.commands.calibrate_runs import run_drift

    run_drift(rig_options, distance_m=distance_m, apply=apply)


@app.command(name="settle-time")
@on_rig(usual_scene="calibration")
def settle_time(
    rig_options: RigOptions,
    *,
    apply: Annotated[
        bool, typer.Option("--apply", help="use the session's measured settle time from now on")
    ] = False,
    rig_file: Annotated[
        bool, typer.Option("--rig-file", help="use the rig file's settle time from now on")
    ] = False,
    session: SessionOption = None,
) -> None:
    """Show or change the settle time, which the rig waits after every move; measures nothing."""
    from foveacam_server.commands.calibrate_runs import find_session
    from foveacam_server.commands.calibration_data import open_data
    from foveacam_server.commands.rig import RigChoice
    from foveacam_server.resources.calibrating.sessions.descriptions import measured_time
    from foveacam_server.resources.devices.settle_time.schema import SettleTimeDocument

    if apply and rig_file:
        raise InvalidInput("settle-time: --apply and --rig-file exclude each other; give one of them")
    choice = RigChoice.of(rig_options)
    with open_data(choice, lock=apply or rig_file) as data:
        if apply:
            measured = measured_time(find_session(data, session))
            measured.check_filter(choice.drive.low_pass_hz)
            data.settle_times.store(measured)
        if rig_file:
            data.settle_times.remove(data.rig_id)
        known = data.settle_times.of(data.rig_id)
    in_use = known if known is not None and known.suits(choice.drive.low_pass_hz) else None
    found = SettleTimeDocument.of(in_use, rig_file_us=choice.drive.settle_us)
    if rig_options.as_json:
        typer.echo(json.dumps(found.as_json()))
        return
    typer.echo(f"{data.rig_id} waits {found.settle_us / 1e3:g} ms after every move: {found.source}")


app.registered_commands.extend(records_app.registered_commands)


def _run_with_board(
    rig_options: RigOptions,
    run: of_step.WideRun | of_step.LensRun,
    *,
    session: str | None,
    label: str | None,
    images: Path | None,
    pattern: str,
) -> None:
    """Run a step on a board, in the session or a new one: with the rig, or on image files."""
    from foveacam_server.commands.calibrate_runs import SessionChoice, run_in_session, run_on_images

    chosen = SessionChoice(session=session, label=label, begin=True)
    if images is None:
        run_in_session(rig_options, run, chosen)
        return
    if run.options.board is None:
        raise InvalidInput("--images: say which board they show, such as --board 9x6 --square-mm 25")
    run_on_images(rig_options, images, run.options, chosen, pattern=pattern)


def _board(
    corners: str | None,
    square_mm: float | None,
    marker_mm: float | None,
    dictionary: str | None,
    *,
    legacy_pattern: bool,
) -> Mapping[str, str | float | None] | None:
    """Return the options of a board, not validated yet."""
    size = parse_pair(corners, option="--board", example="9x6")
    markers = {"marker_mm": marker_mm, "dictionary": dictionary, "legacy_pattern": legacy_pattern or None}
    given = {name: value for name, value in markers.items() if value is not None}
    if size is None and square_mm is None and not given:
        return None
    if size is None or square_mm is None:
        raise InvalidInput("a board needs --board and --square-mm, such as --board 9x6 --square-mm 25")
    kind = "charuco" if given else "checkerboard"
    return {"kind": kind, "columns": size[0], "rows": size[1], "square_mm": square_mm, **given}
