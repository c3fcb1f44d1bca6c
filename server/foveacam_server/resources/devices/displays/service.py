"""Stores the pattern that screens show, and lists the connected screens."""

import logging
import threading
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Busy, Clock
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.quantities import rounded
from foveacam_server.foundation.schema import ItemId
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.devices.displays.drawing import PatternDrawing, draw
from foveacam_server.resources.devices.displays.printing import PatternPrint, asked_pattern, print_pattern
from foveacam_server.resources.devices.displays.schema import (
    BlankPattern,
    DisplayDocument,
    DisplayRequest,
    PatternDocument,
    PrintQuery,
    ShownPattern,
    StoredPattern,
)

_log = logging.getLogger(__name__)

FORMAT = "foveacam-display-pattern"
VERSION = 1
SILENT_S = 15.0
"""Time without a message after which a screen is no longer listed."""
MOST = 64
"""Largest number of connected screens."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Screen:
    described: DisplayRequest
    request_ns: int


class PatternDisplayService:
    """The pattern and the screens; callable from any thread."""

    def __init__(self, folder: Path, *, clock: Clock, events: EventLog) -> None:
        self._path = folder / "pattern.json"
        self._clock = clock
        self._events = events
        self._lock = threading.Lock()
        self._screens: dict[str, _Screen] = {}
        self._drawing = _stored_drawing(self._path)

    def pattern(self) -> PatternDocument:
        """Return the pattern that all screens show."""
        return self._drawing.describe()

    def svg(self) -> str:
        """Return the pattern as SVG in millimetres; raise `NotFound` when it is blank."""
        svg = self._drawing.svg()
        if svg is None:
            raise NotFound(
                "no pattern is shown, so there is none to draw",
                asked="the pattern as SVG",
                found="blank",
                remedy="choose one by PUT /api/v1/displays/pattern",
            )
        return svg

    def print(self, query: PrintQuery) -> PatternPrint:
        """Return the print of a query's pattern; without one, that of the pattern that all screens show."""
        return print_pattern(asked_pattern(query) or self._drawing.asked, query)

    def show(self, asked: ShownPattern) -> PatternDocument:
        """Show a pattern on all screens, now and after a restart."""
        drawing = draw(asked)
        kept = {"format": FORMAT, "version": VERSION, **StoredPattern(pattern=asked).as_json()}
        write_document(self._path, kept, what="the pattern of the displays")
        self._drawing = drawing
        document = drawing.describe()
        self._events.emit("display.pattern", f"displays show: {drawing.description}", data=document)
        return document

    def connected(self) -> list[DisplayDocument]:
        """Return the connected screens, by name."""
        self._drop_silent()
        with self._lock:
            screens = list(self._screens.items())
        found = [self._describe(display_id, screen) for display_id, screen in screens]
        return sorted(found, key=lambda display: (display.name, display.id))

    def register(self, display_id: str, described: DisplayRequest) -> PatternDocument:
        """Register a screen or renew its registration, to be repeated within 15 s; return its pattern."""
        self._drop_silent()
        with self._lock:
            known = self._screens.get(display_id)
            if known is None and len(self._screens) >= MOST:
                raise Busy(
                    f"{MOST} displays are connected already",
                    asked="one more display",
                    found=f"{MOST} displays",
                    remedy="close some of them",
                )
            self._screens[display_id] = _Screen(described=described, request_ns=self._clock.now_ns())
        if known is None or known.described != described:
            self._emit(display_id, f"{described.name} shows the calibration pattern")
        return self.pattern()

    def forget(self, display_id: str) -> None:
        """Remove a screen that has left; no effect for an unknown one."""
        with self._lock:
            known = self._screens.pop(display_id, None)
        if known is not None:
            self._emit(display_id, f"{known.described.name} no longer shows the calibration pattern")

    def _drop_silent(self) -> None:
        oldest_ns = self._clock.now_ns() - round(1e9 * SILENT_S)
        with self._lock:
            silent = [name for name, screen in self._screens.items() if screen.request_ns < oldest_ns]
            dropped = [(name, self._screens.pop(name)) for name in silent]
        for display_id, screen in dropped:
            message = f"{screen.described.name} did not register for {SILENT_S:g} s"
            self._emit(display_id, message)

    def _emit(self, display_id: str, message: str) -> None:
        self._events.emit("display.changed", message, data=ItemId(id=display_id))

    def _describe(self, display_id: str, screen: _Screen) -> DisplayDocument:
        described, silent_ns = screen.described, self._clock.now_ns() - screen.request_ns
        width_mm, height_mm = _size_mm(described)
        return DisplayDocument(
            id=display_id,
            name=described.name,
            width_px=described.width_px,
            height_px=described.height_px,
            px_per_mm=described.px_per_mm,
            width_mm=rounded(width_mm, 1),
            height_mm=rounded(height_mm, 1),
            fits=_fits(self.pattern(), width_mm, height_mm),
            silent_s=round(max(0.0, silent_ns / 1e9), 1),
        )


def _size_mm(described: DisplayRequest) -> tuple[float | None, float | None]:
    scale = described.px_per_mm
    if scale is None:
        return None, None
    return described.width_px / scale, described.height_px / scale


def _fits(shown: PatternDocument, width_mm: float | None, height_mm: float | None) -> bool | None:
    if width_mm is None or height_mm is None or shown.width_mm is None or shown.height_mm is None:
        return None
    return shown.width_mm <= width_mm and shown.height_mm <= height_mm


def _stored_drawing(path: Path) -> PatternDrawing:
    blank = draw(BlankPattern(kind="blank"))
    try:
        return draw(read_document(path, StoredPattern, form=FORMAT, version=VERSION).pattern)
    except FileNotFoundError:
        return blank
    except (OSError, ValueError) as error:
        _log.warning("%s is ignored, displays are blank: %s", path, error)
        return blank
