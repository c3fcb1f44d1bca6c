"""The pictures of a calibration session: drawn when a step ends, stored as PNG files in its folder."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.storage.disk import write_file
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.calibrating.sessions.schema import PictureDocument
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession

TITLES = {
    "coverage": "Where the board was seen, and how it was tilted",
    "wide_residuals": "What the lens model leaves",
    "lens_left": "Left fovea: what its lens model leaves",
    "lens_right": "Right fovea: what its lens model leaves",
    "mount_drift": "How the mounts drifted during the sweeps",
    "quiver_left": "Left eye: residual of every pose",
    "quiver_right": "Right eye: residual of every pose",
    "loo": "Leave-one-out error by model",
    "warp_left": "Left eye: warp over the field",
    "warp_right": "Right eye: warp over the field",
    "anaglyph_before": "Both eyes before rectification",
    "anaglyph_after": "Both eyes after rectification",
    "epipolar": "Vertical epipolar error over the field",
    "overlay": "The foveae laid over the wide view",
    "settle": "How the mirrors settle",
}
"""Titles of the pictures, in display order."""
MEASURED = frozenset({"coverage", "wide_residuals", "lens_left", "lens_right", "settle"})
"""Pictures of measurements only, independent of the fit."""

_log = logging.getLogger(__name__)


Maker = Callable[[], bytes]
"""Draws one picture and returns its PNG."""


def draw_pictures(session: CalibrationSession, makers: Mapping[str, Maker]) -> None:
    """Draw and store pictures by name; log those that cannot be drawn."""
    for name, make in makers.items():
        png = draw_png(session, name, make)
        if png is not None:
            write_picture(session, name, png)


def draw_png(session: CalibrationSession, name: str, make: Maker) -> bytes | None:
    """Return the PNG of a picture; log and return None when it cannot be drawn."""
    try:
        return make()
    except FoveaError as error:
        _log.warning("session %s: picture %s was not drawn: %s", session.id, name, error)
        return None


def write_picture(session: CalibrationSession, name: str, png: bytes) -> None:
    """Store one picture: written whole, then renamed."""
    path = _path(session, name)
    path.parent.mkdir(exist_ok=True)
    write_file(path, png)


def describe_pictures(session: CalibrationSession, *, url: str) -> list[PictureDocument]:
    """Return the documents of the stored pictures; a picture's URL changes with its content."""
    found = []
    for name, title in TITLES.items():
        path = _path(session, name)
        if path.is_file():
            version = path.stat().st_mtime_ns // 1_000_000
            picture_url = f"{url}/pictures/{name}.png?v={version}"
            found.append(PictureDocument(name=name, title=title, url=picture_url))
    return found


def picture_bytes(session: CalibrationSession, *, fitted: bool) -> dict[str, bytes]:
    """Return the stored pictures as PNGs by name; without `fitted` only those of measurements."""
    paths = {name: _path(session, name) for name in TITLES if fitted or name in MEASURED}
    return {name: path.read_bytes() for name, path in paths.items() if path.is_file()}


def picture_path(session: CalibrationSession, name: str) -> Path:
    """Return the path of one stored picture or raise `NotFound`."""
    path = _path(session, name)
    if name not in TITLES or not path.is_file():
        there = ", ".join(known for known in TITLES if _path(session, known).is_file()) or "none"
        raise NotFound(
            f"session {session.id} has no picture {name!r}; there are: {there}",
            asked=f"picture {name!r}",
            found=there,
        )
    return path


def _path(session: CalibrationSession, name: str) -> Path:
    return session.folder / "pictures" / f"{name}.png"
