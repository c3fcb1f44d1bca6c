"""The pictures of a session: drawn when a step ends, kept as PNG files beside what they show."""

import logging
from collections.abc import Callable, Mapping
from pathlib import Path

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.storage.disk import write_file
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document

TITLES = {
    "coverage": "Where the board was seen, and how it was tilted",
    "wide_residuals": "What the lens model leaves",
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
"""In the order in which they are shown."""
MEASURED = frozenset({"coverage", "wide_residuals", "settle"})
"""Those that show what was measured, whatever was fitted to it."""

_log = logging.getLogger(__name__)


Maker = Callable[[], bytes]
"""Draws one picture and gives its PNG."""


def draw(session: CalibrationSession, makers: Mapping[str, Maker]) -> None:
    """Draw and keep pictures by their names; one that cannot be drawn stops nobody."""
    for name, make in makers.items():
        png = drawn(session, name, make)
        if png is not None:
            write_picture(session, name, png)


def drawn(session: CalibrationSession, name: str, make: Maker) -> bytes | None:
    """Return the PNG of a picture that is not kept yet; None when it cannot be drawn."""
    try:
        return make()
    except FoveaError as error:
        _log.warning("session %s: picture %s was not drawn: %s", session.id, name, error)
        return None


def write_picture(session: CalibrationSession, name: str, png: bytes) -> None:
    """Keep one picture: written whole, then renamed."""
    path = _path(session, name)
    path.parent.mkdir(exist_ok=True)
    write_file(path, png)


def picture_documents(session: CalibrationSession, *, url: str) -> list[Document]:
    """Return the pictures there are; the address changes when the picture does."""
    documents = []
    for name, title in TITLES.items():
        path = _path(session, name)
        if path.is_file():
            version = path.stat().st_mtime_ns // 1_000_000
            documents.append({"name": name, "title": title, "url": f"{url}/pictures/{name}.png?v={version}"})
    return documents


def picture_path(session: CalibrationSession, name: str) -> Path:
    """Return the file of one picture or raise `NotFound`."""
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
