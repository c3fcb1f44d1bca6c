"""`foveacam recording export`: make an MP4 film of a recording."""

from pathlib import Path

from rich.table import Table

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.movie import MovieCodec, MovieSpec, Progress, export_movie
from foveacam_pipeline.capture.recording.reader import Recording
from foveacam_server.resources.recordings.schema import FilmFacts

WIDE = ""
"""`show` value for the wide stream, whatever its name."""


def movie_spec(
    *, show: str | None, fps: float | None, codec: str | None, start_s: float, end_s: float | None
) -> MovieSpec:
    """Return the film's spec from the options; raise `InvalidInput` for an unknown codec."""
    try:
        chosen = MovieCodec.H264 if codec is None else MovieCodec(codec)
    except ValueError as error:
        raise InvalidInput(
            f"export: there is no codec {codec!r} here; choose {', '.join(MovieCodec)} or leave it out"
        ) from error
    return MovieSpec(show=show or WIDE, fps=fps, codec=chosen, start_s=start_s, end_s=end_s)


def make_film(file: Path, spec: MovieSpec, target: Path, *, progress: Progress) -> FilmFacts:
    """Make the film and return its facts."""
    with Recording(file) as recording:
        show = spec.show or _wide_stream(recording)
        filled = MovieSpec(show=show, fps=spec.fps, codec=spec.codec, start_s=spec.start_s, end_s=spec.end_s)
        made = export_movie(recording, filled, target, progress=progress)
    return FilmFacts(
        file=str(made.path),
        shows=show,
        codec=made.codec.value,
        fps=round(made.fps, 3),
        frames=made.frames,
        width=made.width,
        height=made.height,
        bytes=target.stat().st_size,
    )


def _wide_stream(recording: Recording) -> str:
    wide = recording.stream_of_role(Role.WIDE)
    if wide is None:
        raise InvalidInput(
            f"export: there is no wide stream; say --show and {', '.join(recording.streams) or 'none'}"
        )
    return wide.name


def film_table(found: FilmFacts) -> Table:
    """Return the film's facts as a table."""
    table = Table(title=found.file)
    table.add_column("what")
    table.add_column("value", justify="right")
    for name, value in found:
        if name != "file":
            table.add_row(name, str(value))
    return table
