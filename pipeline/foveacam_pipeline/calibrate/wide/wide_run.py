"""Procedure that captures views of a board automatically while the operator shows it to one camera."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import cv2
import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import PARKED, Clock, Frame, Head, Role, Timeout
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.calibrate.wide.auto_capture import STATE_NOTES, AutoCapture, AutoCaptureVerdict
from foveacam_pipeline.calibrate.wide.board_detector import BoardView, detect_board, explain_absence
from foveacam_pipeline.calibrate.wide.board_pose import TILTS
from foveacam_pipeline.calibrate.wide.boards import Board
from foveacam_pipeline.calibrate.wide.coverage import COLUMNS, ROWS, BoardCoverage, CoverageTracker
from foveacam_pipeline.calibrate.wide.fit_wide import least_views
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples, thumbnail, views_path

_ENOUGH_VIEWS = 15
_ENOUGH_COVERAGE = 0.9
IDLE_TIMES = 3.0
"""Factor on the time between images while the board shows a view that is known already."""
_LOOK_NS = 250_000_000
"""Longest time that an image counts towards a timeout, so that slow computers get as many images as fast
ones."""

GREEN, AMBER, BLUE = (80, 220, 100), (255, 190, 60), (90, 170, 255)
PICTURE_SCALE = 0.5
_VEIL = 0.22
_BAND = 30
_DARK = (17, 20, 26)
_SHIFT = 3

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class WideSettings:
    """Number of views, and the time limits of the capture.

    `views`: enough, whatever their coverage; fewer suffice when nothing new has been shown for `patience_s`,
    or for `content_s` once the image is covered and the board was tilted every way; an image that takes
    longer counts as a quarter of a second. `every_s`: time between images, thrice that while nothing changes.
    `still_px`: maximum movement of a corner of a still board. `frames`: averaged for a view. `folder`: where
    views are stored as they are captured, and from where an earlier run continues. `role`: the camera; a
    fovea looks where its mirror rests at 0 V.
    """

    views: int = 40
    patience_s: float = 20.0
    content_s: float = 6.0
    every_s: float = 0.08
    still_px: float = 0.4
    frames: int = 3
    folder: Path | None = None
    role: Role = Role.WIDE


@runtime_checkable
class SampleWatcher(Protocol):
    """A watcher that receives every captured view."""

    def sample(self, sample_id: str) -> None:
        """Report a new view of the board."""
        ...


def calibrate_wide(
    head: Head, board: Board, *, clock: Clock, watch: ProcedureWatcher, settings: WideSettings | None = None
) -> WideSamples:
    """Capture views until there are enough; raise Timeout when no board, or too little of it, is shown.

    Views captured before a cancellation or timeout are in `settings.folder`, and count in the next run.
    """
    settings = settings or WideSettings()
    samples = load_samples(board, settings.folder, settings.role)
    run = _CaptureRun(head, samples, settings, watch)
    now_ns = news_ns = clock.now_ns()
    waited_ns = 0
    while len(samples) < settings.views:
        raise_if_cancelled(watch, doing="taking views of the board")
        before, before_ns = len(samples), now_ns
        pause_s = run.look()
        now_ns = clock.now_ns()
        waited_ns += min(now_ns - before_ns, _LOOK_NS)
        if len(samples) > before:
            news_ns, waited_ns = now_ns, 0
        elif waited_ns > run.patience_s * 1e9:
            run.finish_or_raise(waited_s=1e-9 * (now_ns - news_ns))
            break
        clock.sleep_until_ns(now_ns + int(pause_s * 1e9))
    return samples


def load_samples(board: Board, folder: Path | None, role: Role = Role.WIDE) -> WideSamples:
    """Return the views of an earlier run in a folder, or none; those of another board are refused."""
    samples = WideSamples(board, role=role)
    if folder is not None and views_path(folder, role).exists():
        for sample in WideSamples.load(folder, role):
            samples.add(sample)
    return samples


class _CaptureRun:
    """State of one run: the views, their coverage and the automatic capture."""

    def __init__(
        self, head: Head, samples: WideSamples, settings: WideSettings, watch: ProcedureWatcher
    ) -> None:
        self._head, self._samples, self._settings, self._watch = head, samples, settings, watch
        self._capture = AutoCapture(still_px=settings.still_px, frames=settings.frames)
        self._covering = CoverageTracker((sample.view for sample in samples), role=samples.role)
        self._last: NDArray[np.uint8] | None = None
        self._seen = False
        self._report(AutoCaptureVerdict(state="no board"))

    @property
    def patience_s(self) -> float:
        """Time to wait for a new view before the capture ends."""
        cover, enough = self._covering.coverage, len(self._samples) >= _ENOUGH_VIEWS
        content = enough and cover.fraction >= _ENOUGH_COVERAGE and cover.tilts_covered == len(TILTS)
        return self._settings.content_s if content else self._settings.patience_s

    def look(self) -> float:
        """Read one image, add its view when captured, and return the pause before the next image, s."""
        frame = self._read_frame()
        image = _eight_bits(frame)
        gray = _gray(image)
        board = self._samples.board
        quick = detect_board(gray, board, effort="live")
        verdict = self._capture.add_image(
            quick,
            t_ns=frame.t_ns,
            exact=lambda: detect_board(gray, board),
            is_new=self._covering.is_new,
        )
        self._last, self._seen = gray, self._seen or quick is not None
        if verdict.view is not None:
            self._add_view(verdict.view, verdict.frames, image)
        self._report(verdict)
        cover = self._covering.coverage
        overlay = draw_overlay(image, quick, cover=cover, words=STATE_NOTES[verdict.state])
        self._watch.show(self._samples.role.value, overlay)
        idle = verdict.state in ("taken", "nothing new")
        return self._settings.every_s * (IDLE_TIMES if idle else 1.0)

    def _read_frame(self) -> Frame:
        role = self._samples.role
        if role is Role.WIDE:
            return self._head.wide(max_age_ms=0.5e3 * self._settings.every_s)
        sighting = self._head.look(PARKED)
        return sighting.left if role is Role.LEFT else sighting.right

    def finish_or_raise(self, *, waited_s: float) -> None:
        """Return when there are enough views, else raise Timeout with the reason."""
        taken, least = len(self._samples), least_views(self._samples.role)
        camera = f"{self._samples.role.value} calibration"
        if taken >= least:
            logger.info("nothing new for %.0f s: %d views", waited_s, taken)
            return
        if not self._seen and self._last is not None:
            found = explain_absence(self._last, self._samples.board)
            raise Timeout(
                f"{camera}: no {self._samples.board} was found in {waited_s:.0f} s; {found}",
                asked=str(self._samples.board),
                found=found,
                remedy=f"show the board to the {self._samples.role.value} camera, and check its size",
            )
        raise Timeout(
            f"{camera}: nothing new was shown for {waited_s:.0f} s; {taken} views were taken, "
            f"{least} are the least; show the board in other places and tilts, held still each time"
        )

    def _add_view(self, view: BoardView, frames: int, image: NDArray[np.uint8]) -> None:
        sample = WideSample(view=view, thumbnail_jpeg=thumbnail(image, view), frames=frames)
        self._samples.add(sample)
        self._covering.add(view)
        if self._settings.folder is not None:
            self._samples.save(self._settings.folder)
        if isinstance(self._watch, SampleWatcher):
            self._watch.sample(sample.id)

    def _report(self, verdict: AutoCaptureVerdict) -> None:
        note = f"{STATE_NOTES[verdict.state]}; {self._covering.coverage}"
        self._watch.progress(len(self._samples), total=self._settings.views, note=note)


def _eight_bits(frame: Frame) -> NDArray[np.uint8]:
    if frame.image.dtype == np.uint8:
        return np.asarray(frame.image, dtype=np.uint8)
    return np.asarray(frame.image >> (frame.bits - 8), dtype=np.uint8)


def _gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def draw_overlay(
    image: NDArray[np.uint8], view: BoardView | None, *, cover: BoardCoverage, words: str
) -> NDArray[np.uint8]:
    """Return the picture, (h/2, w/2, 3) uint8 RGB, with covered parts tinted green, corners and a note."""
    small = cv2.resize(image, None, fx=PICTURE_SCALE, fy=PICTURE_SCALE, interpolation=cv2.INTER_AREA)
    base = cv2.cvtColor(small, cv2.COLOR_GRAY2RGB) if small.ndim == 2 else small.copy()
    height, width = base.shape[:2]
    veil = cv2.resize((cover.cells > 0).astype(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST)
    lined = base.copy()
    for x in range(1, COLUMNS):
        cv2.line(lined, (x * width // COLUMNS, 0), (x * width // COLUMNS, height - 1), GREEN, 1)
    for y in range(1, ROWS):
        cv2.line(lined, (0, y * height // ROWS), (width - 1, y * height // ROWS), GREEN, 1)
    base = cv2.addWeighted(base, 1.0 - _VEIL, lined, _VEIL, 0.0)
    green = cv2.addWeighted(base, 1.0 - _VEIL, np.full_like(base, GREEN), _VEIL, 0.0)
    picture: NDArray[np.uint8] = np.where(veil[..., None] > 0, green, base).astype(np.uint8)
    if view is not None:
        _draw_corners(picture, view)
    _draw_note(picture, words, AMBER if view is None else GREEN)
    return picture


def _draw_corners(picture: NDArray[np.uint8], view: BoardView) -> None:
    points = np.rint(view.corners_px * PICTURE_SCALE * (1 << _SHIFT)).astype(int)
    rows = view.ids // view.board.columns
    for row in np.unique(rows):
        cv2.polylines(picture, [points[rows == row].astype(np.int32)], False, BLUE, 1, cv2.LINE_AA, _SHIFT)
    for x, y in points.tolist():
        cv2.circle(picture, (x, y), 3 << _SHIFT, AMBER, 1, cv2.LINE_AA, _SHIFT)


def _draw_note(picture: NDArray[np.uint8], words: str, colour: tuple[int, int, int]) -> None:
    height, width = picture.shape[:2]
    cv2.rectangle(picture, (0, height - _BAND), (width - 1, height - 1), _DARK, -1)
    cv2.putText(picture, words, (12, height - 10), cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, 1, cv2.LINE_AA)
