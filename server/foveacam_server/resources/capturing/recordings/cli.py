"""The commands `foveacam record FILE`, `foveacam recording info FILE`, `… recording export FILE OUT`."""

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

from foveacam_pipeline.capture.recording.bounds import LONGEST_S
from foveacam_pipeline.storage.free_space import RESERVE_TEXT
from foveacam_server.commands.options import JsonOption, RigOptions, on_rig
from foveacam_server.foundation.schema import ResponseModel

app = typer.Typer(
    name="recording",
    help="Recordings (.fcap): what one holds, and a film of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

SECONDS_HELP = f"how long; it ends sooner, whole, at the {RESERVE_TEXT}"
TARGET_HELP = "film (.mp4, .mov), pictures (.zip) or array (.npy) to make"
CODEC_HELP = "h264 (the usual one), hevc, vp9, av1, mpeg4; for .mov prores, prores_hq, prores_4444"
WIDE = ""
"""Default of `show`: the wide stream, whatever its name."""
FileArgument = Annotated[Path, typer.Argument(help="recording: .fcap, or the authors' older .fovea")]


@on_rig(usual_scene="bench")
def record(
    rig_options: RigOptions,
    file: Annotated[Path, typer.Argument(help="file to make; it must end in .fcap")],
    *,
    seconds: Annotated[float, typer.Option(help=SECONDS_HELP, min=0.1, max=LONGEST_S)] = 10.0,
    ax_deg: Annotated[float, typer.Option(help="where to look, degrees to the right")] = 0.0,
    ay_deg: Annotated[float, typer.Option(help="where to look, degrees down")] = 0.0,
    distance_m: Annotated[
        float | None, typer.Option(help="where both eyes meet; usually infinity", min=0.5)
    ] = None,
    compress: Annotated[
        bool,
        typer.Option(
            "--compress",
            help="each frame by zlib; may not keep up at the full rate; the authors' reader cannot read it",
        ),
    ] = False,
    packed: Annotated[
        bool, typer.Option("--packed", help="grey of twelve bits in three bytes for two pixels")
    ] = False,
) -> None:
    """Record all three cameras, with the mirrors' pose at every exposure."""
    from foveacam_server.resources.capturing.recordings.cli_record import (
        RecordingSpec,
        record_rig,
        record_table,
    )

    spec = RecordingSpec(
        file=file,
        seconds=seconds,
        direction_deg=(ax_deg, ay_deg),
        distance_m=distance_m,
        compress=compress,
        packed=packed,
    )
    columns = (TextColumn("recording"), BarColumn(), TextColumn("{task.fields[note]}"))
    with _progress(*columns, silent=rig_options.as_json) as progress:
        task = progress.add_task("recording", total=seconds, note="opening the rig")
        found = record_rig(
            rig_options, spec, report=lambda done_s, note: progress.update(task, completed=done_s, note=note)
        )
    _print(found, record_table(found), as_json=rig_options.as_json)


@app.command()
def info(file: FileArgument, *, as_json: JsonOption = False) -> None:
    """Describe a recording: streams, times, rig, losses."""
    from foveacam_server.resources.capturing.recordings.information import information, information_shown

    found = information(file)
    _print(found, information_shown(found), as_json=as_json)


@app.command()
def export(
    file: FileArgument,
    target: Annotated[Path, typer.Argument(help=TARGET_HELP)],
    *,
    show: Annotated[
        str | None, typer.Option(help="a stream's name, side-by-side or anaglyph; usually the wide stream")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(help="frames a second, resampled in time; usually as recorded")
    ] = None,
    codec: Annotated[str | None, typer.Option(help=CODEC_HELP)] = None,
    start_s: Annotated[float, typer.Option(help="where to begin, seconds", min=0.0)] = 0.0,
    end_s: Annotated[float | None, typer.Option(help="where to end, seconds", min=0.0)] = None,
    undistorted: Annotated[
        bool, typer.Option("--undistorted", help="without the distortion of the wide lens")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Export a film of one stream, of both eyes side by side or as an anaglyph; or pictures, or an array."""
    from foveacam_pipeline.capture.recording.movie import MovieSpec
    from foveacam_server.resources.capturing.recordings.export import chosen_format, film_table, make_film

    form = chosen_format(codec, target)
    spec = MovieSpec(show=show or WIDE, fps=fps, start_s=start_s, end_s=end_s, undistorted=undistorted)
    columns = (TextColumn("encoding"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with _progress(*columns, silent=as_json) as progress:
        task = progress.add_task("encoding", total=None)
        found = make_film(
            file,
            spec,
            target,
            form=form,
            progress=lambda done, total: progress.update(task, completed=done, total=total),
        )
    _print(found, film_table(found), as_json=as_json)


def _progress(*columns: ProgressColumn, silent: bool) -> Progress:
    """Return a bar that disappears at the end; a disabled one when silent or without a terminal."""
    console = Console(stderr=True)
    return Progress(*columns, console=console, transient=True, disable=silent or not console.is_terminal)


def _print(found: ResponseModel, shown: RenderableType, *, as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps(found.as_json(), allow_nan=False))
    else:
        Console().print(shown)
