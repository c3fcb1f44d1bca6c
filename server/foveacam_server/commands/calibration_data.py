"""Access of commands to the calibrations of a data directory, with or without a running server."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.calibrate.records.records import CalibrationStore
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.commands.rig import RigChoice
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.acceptances.records import AcceptanceRecords
from foveacam_server.resources.calibrating.calibrations.in_force import check_discarded, pinned_id, write_pin
from foveacam_server.resources.calibrating.calibrations.schema import CalibrationDocument
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED, CalibrationService
from foveacam_server.resources.calibrating.drift_checks.records import DriftRecords
from foveacam_server.resources.calibrating.sessions.sessions import SessionCollection
from foveacam_server.rig.settle_times import SettleTimes

CURRENT = "current"


class CalibrationData:
    """The calibration records of one data directory; takes no lock."""

    def __init__(self, data: Path, *, shipped: Path = SHIPPED) -> None:
        self.folder = data / "calibrations"
        self.records = CalibrationStore(self.folder)
        self.sessions = SessionCollection(self.folder / "sessions")
        self.drift = DriftRecords(self.folder / "drift")
        self.acceptances = AcceptanceRecords(self.folder / "acceptances")
        self._shipped = shipped

    def every(self) -> list[Calibration]:
        """Return all calibrations: the directory's, newest first, then those shipped with the program."""
        return [*self.records.every().calibrations, *self._list_shipped()]

    def _list_shipped(self) -> list[Calibration]:
        found = []
        for path in sorted(self._shipped.glob("*.json")):
            try:
                found.append(load_calibration(path))
            except FoveaError:
                continue
        return found

    def find(self, wanted: str) -> Calibration:
        """Return the calibration whose id begins with `wanted`; `current`: the only rig's one in force."""
        known = {calibration.id: calibration for calibration in self.every()}
        if wanted == CURRENT:
            found = [calibration for calibration in known.values() if self._in_force(calibration)]
            own = {calibration.rig_id for calibration in self.records.every().calibrations}
            found = [calibration for calibration in found if calibration.rig_id in own]
        else:
            found = [known[name] for name in known if wanted and name.startswith(wanted)]
        if len(found) == 1:
            return found[0]
        if not found:
            raise NotFound(
                f"calibration {wanted!r}: none in {self.folder}; see `foveacam calibrate list`", asked=wanted
            )
        ids = ", ".join(calibration.id for calibration in found)
        raise InvalidInput(f"calibration {wanted!r}: it may be any of {ids}; give one id in full")

    def add(self, calibration: Calibration) -> None:
        """Store a calibration; its rig's one in force stays in force, a rig's first comes into force."""
        in_force = self._in_force_for(calibration.rig_id)
        if in_force is not None:  # first, so that a full disk leaves the one in force
            write_pin(self.folder, in_force.rig_id, in_force.id)
        self.records.add(calibration)

    def discard(self, calibration: Calibration) -> None:
        """Move a calibration to the trash; refuse the one in force and those shipped with the program."""
        check_discarded(calibration, in_force=self._in_force(calibration), kept=self._is_kept(calibration))
        self.records.discard(calibration.id)

    def restore(self, wanted: str) -> Calibration:
        """Restore the calibration whose id begins with `wanted` from the trash; do not put it in force."""
        found = CalibrationStore(self.records.trash).get(wanted)
        self.add(found)
        return self.records.restore(found.id)

    def describe(self, calibration: Calibration) -> CalibrationDocument:
        """Return a calibration's REST document, without its health."""
        return CalibrationDocument.of(
            calibration, kept=self._is_kept(calibration), current=self._in_force(calibration)
        )

    def _is_kept(self, calibration: Calibration) -> bool:
        shipped = [known.id for known in self._list_shipped()]
        return calibration.id not in shipped and self.records.path_of(calibration.id).is_file()

    def _in_force(self, calibration: Calibration) -> bool:
        found = self._in_force_for(calibration.rig_id)
        return found is not None and found.id == calibration.id

    def _in_force_for(self, rig_id: str) -> Calibration | None:
        of_rig = [known for known in self.every() if known.rig_id == rig_id]
        pinned = pinned_id(self.folder, rig_id)
        chosen = next((known for known in of_rig if known.id == pinned), None)
        return chosen or max(of_rig, key=lambda known: known.created, default=None)


@dataclass(frozen=True, slots=True, kw_only=True)
class DataDirectory:
    """Calibrations, sessions and settle times of one rig in a data directory, for a command."""

    rig_id: str
    baseline_m: float
    calibration: CalibrationService
    sessions: SessionCollection
    drift_folder: Path
    settle_times: SettleTimes


@contextmanager
def open_data(choice: RigChoice, *, lock: bool) -> Iterator[DataDirectory]:
    """Open the data directory for one command; with `lock`, raise `Busy` while a server uses it.

    A command locks it to change values that a server holds in memory (the calibration and the settle time in
    use), or to measure with a rig in a session. All others can run beside a server: they write new files, or
    into folders with a separate lock.
    """
    folder = choice.settings.data / "calibrations"
    with ExitStack() as stack:
        events = None
        if lock:
            events = EventLog(stack.enter_context(Store(choice.settings.data)))
            stack.callback(events.close)
        calibration = CalibrationService(chosen=choice.settings.calibration, folder=folder, events=events)
        calibration.choose_for(choice.rig_id)
        yield DataDirectory(
            rig_id=choice.rig_id,
            baseline_m=choice.baseline_m,
            calibration=calibration,
            sessions=SessionCollection(folder / "sessions"),
            drift_folder=folder / "drift",
            settle_times=SettleTimes(folder / "settle"),
        )
