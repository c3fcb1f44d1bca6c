"""`foveacam recording export`: make a film, a ZIP of pictures or an array of a recording."""

from dataclasses import replace
from pathlib import Path

from rich.table import Table

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.formats import (
    FORMATS,
    ExportFormat,
    MovieCodec,
    check_format,
    format_named,
)
from foveacam_pipeline.capture.recording.movie import MovieSpec, Progress, export_movie, shown_streams
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_server.resources.capturing.recordings.films import SEQUENCES
from foveacam_server.resources.capturing.recordings.schema import FilmFacts


def chosen_format(codec: str | None, target: Path) -> ExportFormat:
    """Return the format of an export: by its codec, else by its file's suffix; raise `InvalidInput`."""
    if codec is not None:
        found = format_named(codec)
    else:
        suffix = target.suffix.lower()
        found = next((one for one in FORMATS.values() if one.suffix == suffix), FORMATS["h264"])
    check_format(found)
    return found


def make_film(
    file: Path, spec: MovieSpec, target: Path, *, form: ExportFormat, progress: Progress
) -> FilmFacts:
    """Make the export and return its description."""
    with Recording(file) as recording:
        filled = replace(spec, show=spec.show or _wide_stream(recording), codec=form.codec or MovieCodec.H264)
        if form.codec is not None:
            made = export_movie(recording, filled, target, progress=progress)
            frames, fps, size = made.frames, made.fps, (made.width, made.height)
        else:
            frames = SEQUENCES[form.name](recording, filled, target, progress=progress)
            stream = shown_streams(recording, filled.show)[0]
            fps, size = filled.fps or stream.fps, (stream.form.width, stream.form.height)
    return FilmFacts(
        file=str(target),
        shows=filled.show,
        codec=form.codec or form.name,
        fps=round(fps, 3),
        frames=frames,
        width=size[0],
        height=size[1],
        bytes=target.stat().st_size,
    )


def _wide_stream(recording: Recording) -> str:
    wide = recording.stream_of_role(Role.WIDE)
    if wide is None:
        raise InvalidInput(
            f"export: there is no wide stream; give --show and {', '.join(recording.streams) or 'none'}"
        )
    return wide.name


def film_table(found: FilmFacts) -> Table:
    """Return the description of a film as a table."""
    table = Table(title=found.file)
    table.add_column("what")
    table.add_column("value", justify="right")
    for name, value in found:
        if name != "file":
            table.add_row(name, str(value))
    return table
