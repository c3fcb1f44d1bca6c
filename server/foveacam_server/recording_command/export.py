"""`foveacam recording export`: a film of a recording."""

import os
from pathlib import Path

import cv2
from rich.table import Table

from foveacam_hardware.contract import InvalidInput, Role
from foveacam_pipeline.capture.recording.movie import MovieCodec, MovieSpec, Progress, export_movie
from foveacam_pipeline.capture.recording.reader import Recording

WIDE = ""
"""Shows the wide stream, whatever its name."""


def export_wish(
    *, show: str | None, fps: float | None, codec: str | None, start_s: float, end_s: float | None
) -> MovieSpec:
    """Return what was asked; raise `InvalidInput` for a codec that there is not."""
    try:
        chosen = None if codec is None else MovieCodec(codec)
    except ValueError as error:
        raise InvalidInput(
            f"export: there is no codec {codec!r} here; choose {', '.join(MovieCodec)} or leave it out"
        ) from error
    return MovieSpec(show=show or WIDE, fps=fps, codec=chosen, start_s=start_s, end_s=end_s)


def film(file: Path, wish: MovieSpec, target: Path, *, progress: Progress) -> dict[str, object]:
    """Make the film and return what was made."""
    quiet_encoders()
    with Recording(file) as recording:
        show = wish.show or _wide_stream(recording)
        asked = MovieSpec(show=show, fps=wish.fps, codec=wish.codec, start_s=wish.start_s, end_s=wish.end_s)
        made = export_movie(recording, asked, target, progress=progress)
    return {
        "file": str(made.path),
        "shows": show,
        "codec": made.codec.value,
        "fps": round(made.fps, 3),
        "frames": made.frames,
        "width": made.width,
        "height": made.height,
        "bytes": target.stat().st_size,
    }


def quiet_encoders() -> None:
    """Keep encoders that are tried and lacking from writing to the terminal; we say what there is."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # read when the first film is opened
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


def _wide_stream(recording: Recording) -> str:
    wide = recording.stream_of_role(Role.WIDE)
    if wide is None:
        raise InvalidInput(
            f"export: there is no wide stream; say --show and {', '.join(recording.streams) or 'none'}"
        )
    return wide.name


def film_table(found: dict[str, object]) -> Table:
    """Return what was made, for people."""
    table = Table(title=str(found["file"]))
    table.add_column("what")
    table.add_column("value", justify="right")
    for name, value in found.items():
        if name != "file":
            table.add_row(name, str(value))
    return table
