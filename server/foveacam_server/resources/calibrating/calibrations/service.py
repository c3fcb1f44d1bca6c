"""Determines which calibration is in force: the command line's, else the pinned one, else the rig's newest.

It may change while the server runs: call `require` each time instead of keeping a copy.
"""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

from foveacam_hardware.contract import FoveaError, NotCalibrated, NotConnected
from foveacam_pipeline.calibrate.records.records import CalibrationStore
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.foundation.errors import NotFound, StillOpening
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.schema import ResponseModel
from foveacam_server.resources.calibrating.calibrations.in_force import (
    check_discarded,
    pinned_id,
    read_pin,
    write_pin,
)
from foveacam_server.resources.calibrating.calibrations.schema import CalibrationChosen, CalibrationMissing

_log = logging.getLogger(__name__)

SHIPPED = Path(__file__).parent / "shipped"
"""Calibrations that ship with the program, one per rig id."""

Reach = tuple[float, float, float, float]
"""Smallest ax, largest ax, smallest ay, largest ay, rad."""


class CalibrationService:
    """Loads the calibrations of a rig once it is known; `require` returns the one in force."""

    def __init__(
        self, *, chosen: Path | None, folder: Path, events: EventLog | None, shipped: Path = SHIPPED
    ) -> None:
        self._chosen = chosen
        self._folder = folder
        self._shipped = shipped
        self._events = events
        self._lock = threading.Lock()
        self._known: dict[str, Calibration] = {}
        self._shipped_ids = frozenset[str]()
        self._current: Calibration | None = None
        self._rig_id: str | None = None
        self._brought: Calibration | None = None
        self._on_change: list[Callable[[Calibration], None]] = []
        self.records = CalibrationStore(folder)
        self._reach_rad: Reach | None = None
        self._lost_pin: str | None = None
        self._problem = "the rig is not open yet, so its calibration is not known; try again in a moment"
        self._no_rig: Callable[[], NotConnected] = lambda: StillOpening(self._problem)

    @property
    def current(self) -> Calibration | None:
        """The calibration in force."""
        return self._current

    @property
    def problem(self) -> str | None:
        """Why no calibration is in force; None when one is."""
        return None if self._current is not None else self._problem

    @property
    def reach_rad(self) -> Reach | None:
        """Directions that the calibration in force covers; computed once, as it takes a while."""
        return self._reach_rad

    def require(self) -> Calibration:
        """Return the calibration in force; raise `NotCalibrated`, or `NotConnected` where no rig is open."""
        if self._rig_id is None:
            raise self._no_rig()
        if self._current is None:
            raise NotCalibrated(
                self._problem, asked="a calibrated rig", remedy="load this rig's own with --calibration FILE"
            )
        return self._current

    def every(self) -> list[Calibration]:
        """Return all known calibrations of this rig, newest first."""
        with self._lock:
            known = list(self._known.values())
        return sorted(known, key=lambda calibration: calibration.created, reverse=True)

    def get(self, calibration_id: str) -> Calibration:
        """Return a calibration by its id or raise `NotFound`."""
        known = self._known.get(calibration_id)
        if known is None:
            raise NotFound(
                f"there is no calibration {calibration_id}; see /api/v1/calibrations", asked=calibration_id
            )
        return known

    def on_change(self, callback: Callable[[Calibration], None]) -> None:
        """Call `callback` whenever another calibration comes into force."""
        self._on_change.append(callback)

    def refuse_without_rig(self, error: Callable[[], NotConnected]) -> None:
        """Set the function whose error `require` raises while no rig is known."""
        self._no_rig = error

    def forget_rig(self) -> None:
        """Forget the calibrations of a closed rig, as another one may be opened."""
        with self._lock:
            self._rig_id = self._lost_pin = None
            self._known = {}
            self._current = self._reach_rad = None

    def choose_for(self, rig_id: str, *, brought: Calibration | None = None) -> None:
        """Load the calibrations of the rig `rig_id`; a chosen one of another rig leaves it uncalibrated.

        `brought`: one that comes with the rig itself, as with a recording; only a chosen file has precedence
        over it.
        """
        self._rig_id = rig_id
        self._brought = brought
        self._load(self._shipped / f"{rig_id}.json", rig_id)
        self._shipped_ids = frozenset(self._known)
        for path in sorted(self._folder.glob("*.json")):
            self._load(path, rig_id)
        try:
            current = self._choose(rig_id)
        except FoveaError as error:
            self._problem = str(error)
            missing = CalibrationMissing(detail=str(error))
            self._emit(f"not calibrated: {error}", missing, level=EventLevel.ERROR)
            return
        self._put_in_force(current)

    def add(self, calibration: Calibration) -> None:
        """Store a calibration of this rig; the one in force stays in force, also after a restart."""
        self._check_new(calibration)
        self.records.add(calibration)
        with self._lock:
            self._known[calibration.id] = calibration

    def discard(self, calibration_id: str) -> None:
        """Put a calibration in the trash; raise `Busy` for the one in force, `InvalidInput` for a shipped."""
        calibration = self.get(calibration_id)
        pinned = pinned_id(self._folder, calibration.rig_id)
        check_discarded(
            calibration,
            in_force=calibration is self._current or calibration.id == pinned,
            kept=self.is_kept(calibration.id),
        )
        self.records.discard(calibration.id)
        with self._lock:
            del self._known[calibration.id]

    def is_kept(self, calibration_id: str) -> bool:
        """Return whether a calibration is a file of the data directory, not one that ships."""
        return calibration_id not in self._shipped_ids and self.records.path_of(calibration_id).is_file()

    def discarded(self) -> list[Calibration]:
        """Return the calibrations in the trash, newest first."""
        return list(CalibrationStore(self.records.trash).every(rig_id=self._rig_id).calibrations)

    def restore(self, calibration_id: str) -> Calibration:
        """Restore a calibration from the trash, or raise `NotFound`; the one in force stays in force."""
        if calibration_id not in [known.id for known in self.discarded()]:
            raise NotFound(
                f"there is no calibration {calibration_id} in the trash; see "
                "/api/v1/calibrations?removed=true",
                asked=calibration_id,
            )
        self._check_new(CalibrationStore(self.records.trash).get(calibration_id))
        restored = self.records.restore(calibration_id)
        with self._lock:
            self._known[restored.id] = restored
        return restored

    def activate(self, calibration_id: str) -> Calibration:
        """Put a calibration in force, now and at every start."""
        calibration = self.get(calibration_id)
        write_pin(self._folder, calibration.rig_id, calibration.id)
        lost, self._lost_pin = self._lost_pin, None
        if calibration is not self._current or lost is not None:
            self._put_in_force(calibration)
        return calibration

    def _check_new(self, calibration: Calibration) -> None:
        """Check that it is this rig's; pin the one in force, which a newer one would replace otherwise."""
        if self._rig_id is not None:
            calibration.check_rig(self._rig_id)
        current = self._current
        if current is not None and pinned_id(self._folder, current.rig_id) not in self._known:
            write_pin(self._folder, current.rig_id, current.id)

    def _put_in_force(self, calibration: Calibration) -> None:
        reach_rad = calibration.reach_rad()
        with self._lock:
            self._reach_rad = reach_rad
            self._current = calibration
        for callback in self._on_change:
            callback(calibration)
        words, lost = f"calibration {calibration.id} ({calibration.label}) is in force", self._lost_pin
        self._emit(
            words if lost is None else f"{words}: {lost}",
            CalibrationChosen(id=calibration.id, label=calibration.label, origin=calibration.origin),
            level=EventLevel.INFO if lost is None else EventLevel.WARNING,
        )

    def _emit(self, message: str, data: ResponseModel, *, level: EventLevel = EventLevel.INFO) -> None:
        if self._events is not None:  # None in a command running beside a server
            self._events.emit("rig.calibration", message, level=level, data=data)

    def _choose(self, rig_id: str) -> Calibration:
        if self._chosen is not None:
            chosen = load_calibration(self._chosen)
            chosen.check_rig(rig_id)
            self._known[chosen.id] = chosen
            return chosen
        if self._brought is not None:
            self._brought.check_rig(rig_id)
            self._known[self._brought.id] = self._brought
            return self._brought
        known = self.every()
        pin = read_pin(self._folder, rig_id)
        if pin.calibration_id in self._known:
            return self._known[pin.calibration_id]
        if pin.damage is not None or pin.calibration_id is not None:
            lost = pin.damage or f"calibration {pin.calibration_id}, which was put in force, cannot be read"
            self._lost_pin = f"{lost}; the newest that fits is used, put the right one in force again"
            _log.warning("%s", self._lost_pin)
        if not known:
            raise NotCalibrated(
                f"rig {rig_id} has no calibration: none ships with the program and none lies in "
                f"{self._folder}; calibrate it, or load one with --calibration FILE"
            )
        return known[0]

    def _load(self, path: Path, rig_id: str) -> None:
        try:
            known = load_calibration(path)
        except FoveaError as error:
            if path.exists():  # no calibration may ship for this rig
                _log.warning("%s is passed over: %s", path, error)
            return
        if known.rig_id != rig_id:
            _log.info("%s is passed over: it belongs to rig %s", path, known.rig_id)
            return
        self._known[known.id] = known
