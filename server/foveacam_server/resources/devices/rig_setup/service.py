"""Holds and checks the draft of a rig file; writes, restores and opens rig files.

Callable from any thread.
"""

import logging
import shlex
import threading
from pathlib import Path

from tomlkit.exceptions import ParseError

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput
from foveacam_hardware.rig_config import BAD_RIG_ID, RIG_ID, SimulatedRigConfig, load_rig_config
from foveacam_server.checks.needs import RigNeeds, needs_of
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.schema import RequestModel
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.devices.rig_setup.draft_checks import faults_of
from foveacam_server.resources.devices.rig_setup.draft_file import draft_of, is_simulated, merge_draft
from foveacam_server.resources.devices.rig_setup.rig_files import (
    RigFileFolder,
    TomlTable,
    content_of,
    difference,
    hash_of,
)
from foveacam_server.resources.devices.rig_setup.schema import (
    DraftDocument,
    DraftFault,
    RigDraft,
    RigFileDocument,
    RigFileEntry,
    RigFiles,
    SceneEntry,
)
from foveacam_server.rig.chosen_rig import ChosenRig, check_simulation, shipped_scenes
from foveacam_server.rig.hardware import HardwareThread

HOLDER = "the set-up of another rig"
NAMELESS = "my-rig"


_log = logging.getLogger(__name__)
FILE, FORM, VERSION = "draft.json", "foveacam-rig-draft", 1


class StoredDraft(RequestModel):
    """A draft; `path`, `text`: the rig file that it began from, with its content then; null: a new file."""

    draft: RigDraft = RigDraft()
    path: str | None = None
    text: str | None = None


def load_draft(folder: Path) -> StoredDraft | None:
    """Return the stored draft; None without a readable one."""
    try:
        return read_document(folder / FILE, StoredDraft, form=FORM, version=VERSION)
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _log.warning("a new draft of a rig is begun: %s cannot be read (%s)", FILE, error)
        return None


def store_draft(folder: Path, stored: StoredDraft) -> None:
    """Write a draft; raise as `write_whole`."""
    document = {"format": FORM, "version": VERSION, **stored.as_json()}
    write_document(folder / FILE, document, what="the draft of the rig")


class RigSetupService:
    """The server's one draft of a rig file, shared by all pages."""

    def __init__(self, data: Path, rig: ChosenRig, *, replayed: bool, events: EventLog) -> None:
        given = None if rig.name == "sim" else Path(rig.name)
        self._folder = data / "rig_setup"
        self._files = RigFileFolder(data, given=given)
        self._rig = rig
        self._replayed = replayed
        self._events = events
        self._lock = threading.RLock()
        self._stored = self._first(given)

    @property
    def draft(self) -> RigDraft:
        """The present draft."""
        return self._stored.draft

    def viewers_may_stop(self) -> bool:
        """Return whether the chosen rig's file lets viewers, who may not operate, stop the mirrors."""
        try:
            return self._rig.config().access.viewers_may_stop
        except FoveaError:
            return False

    def describe(self) -> DraftDocument:
        """Return the draft, its file and its faults."""
        with self._lock:
            text, proposed = self._texts()
            return DraftDocument(
                draft=self._stored.draft,
                path=str(self._path),
                file_exists=text is not None,
                changed=proposed != text,
                simulated=is_simulated(self._stored.draft),
                faults=self._faults(proposed),
            )

    def begin(self, path: str | None, *, simulated: bool = False) -> DraftDocument:
        """Begin a new draft from a rig file of the list, from the built-in simulated rig, or an empty one."""
        with self._lock:
            self._store(self._begun(None if path is None else self._files.known(path), simulated=simulated))
            return self.describe()

    def put(self, draft: RigDraft) -> DraftDocument:
        """Replace the draft's values; invalid ones are kept and reported as faults."""
        with self._lock:
            self._store(self._stored.model_copy(update={"draft": draft}))
            return self.describe()

    def review(self) -> RigFileDocument:
        """Return the present file, the changes that saving would make, and the changes by others."""
        with self._lock:
            text, proposed = self._texts()
            name, began = self._path.name, self._stored
            meanwhile = began.path is not None and text != began.text
            return RigFileDocument(
                path=str(self._path),
                hash=hash_of(text),
                proposed=proposed,
                changes=difference(text, proposed, name=name),
                meanwhile=difference(began.text, text, name=name) if meanwhile else "",
                versions=self._files.versions(self._path),
                command=f"foveacam serve --rig {shlex.quote(str(self._path))}",
            )

    def table(self, name: str) -> TomlTable:
        """Return one table of the rig file that saving the draft would write."""
        found = content_of(self.review().proposed).get(name)
        return found if isinstance(found, dict) else {}

    def save(self, seen: str | None) -> RigFileDocument:
        """Write the file; raise `EditedMeanwhile` for another hash than `seen`, `InvalidInput` for faults."""
        with self._lock:
            _, proposed = self._texts()
            if faults := self._faults(proposed):
                raise _faulty(faults)
            path = self._path
            self._files.write(path, proposed, seen=seen)
            self._store(self._begun(path))
        self._emit(f"rig file {path.name} was written")
        return self.review()

    def undo(self, seen: str | None) -> RigFileDocument:
        """Restore the last version of the file, and the draft from it; raise as `save`."""
        with self._lock:
            path = self._path
            self._files.put_back(path, seen=seen)
            self._store(self._begun(path))
        self._emit(f"rig file {path.name} is as it was before")
        return self.review()

    def files(self) -> RigFiles:
        """Return the rig files that can be opened."""
        entries = [
            RigFileEntry(
                path=str(path),
                name=path.name,
                open=not self._replayed and str(path) == self._open_path,
                problem=self._files.problem(path),
            )
            for path in self._files.every()
        ]
        simulated = self._rig.name == "sim" and not self._replayed
        return RigFiles(
            files=entries,
            simulated=simulated,
            replayed=self._replayed,
            scenes=[SceneEntry(name=name, title=title) for name, title in shipped_scenes().items()],
            scene=self._rig.scene if simulated else None,
        )

    def open(self, path: str | None, hardware: HardwareThread, *, scene: str | None = None) -> None:
        """Close the rig and open that of a file, or the simulated one; raise `Busy` while a job has it.

        `scene`: a shipped scene for the simulated rig; None: the present one.
        """
        if self._replayed:
            raise Busy(
                "asked to open a rig: this server plays a recording",
                asked="open a rig",
                found="this server plays a recording",
                remedy="start it again with foveacam serve --rig FILE",
            )
        name = "sim" if path is None else str(self._files.known(path))
        if path is not None:
            config = load_rig_config(name)
            if isinstance(config, SimulatedRigConfig):
                check_simulation(config)
        _check_scene(scene, path)
        before = self._rig.name, self._rig.scene
        self._rig.choose(name, scene=scene)
        try:
            hardware.reopen(HOLDER)
        except Busy:
            self._rig.choose(before[0], scene=before[1])
            raise
        self._emit(
            f"the simulated rig was opened in the scene {self._rig.scene}"
            if path is None
            else f"rig file {Path(name).name} was opened"
        )

    def open_needs(self) -> RigNeeds:
        """Return the devices of the open rig; none when its file cannot be read."""
        if self._replayed:
            return RigNeeds(simulated=True)
        try:
            return needs_of(self._rig.config())
        except FoveaError:
            return RigNeeds(simulated=True)

    @property
    def _open_path(self) -> str:
        return str(Path(self._rig.name).absolute())

    @property
    def _path(self) -> Path:
        """Path of the draft's file: that from which it began, or a new one named by the rig's id."""
        stored = self._stored
        if stored.path is not None:
            return Path(stored.path)
        return self._files.named(stored.draft.rig_id if RIG_ID.fullmatch(stored.draft.rig_id) else NAMELESS)

    def _texts(self) -> tuple[str | None, str]:
        """Return the file's present text, and its text with the draft merged."""
        stored = self._stored
        text = self._files.read(self._path)
        if stored.path is None:
            return text, merge_draft(None, stored.draft, before=None)
        try:
            return text, merge_draft(text, stored.draft, before=draft_of(content_of(stored.text)))
        except ParseError as error:
            raise InvalidInput(
                f"rig file {stored.path}: not valid TOML ({error})",
                asked=f"read {stored.path}",
                found=str(error),
                remedy="correct that line",
            ) from error

    def _faults(self, proposed: str) -> list[DraftFault]:
        draft = self._stored.draft
        found = faults_of(draft, content_of(proposed))
        if self._stored.path is not None:
            return found
        if is_simulated(draft) and not RIG_ID.fullmatch(draft.rig_id):
            found.append(DraftFault(field="rig_id", message=BAD_RIG_ID))
        if self._path.exists():
            taken = f"{self._path.name} is there already; choose it above, or another short name"
            found.append(DraftFault(field="rig_id", message=taken))
        return found

    def _first(self, given: Path | None) -> StoredDraft:
        """Return the stored draft, or one of the rig that opens where the command line names another file."""
        stored = load_draft(self._folder)
        if stored is None or (given is not None and stored.path != str(given.absolute())):
            return self._begun(given, simulated=not self._replayed)
        return stored

    def _begun(self, path: Path | None, *, simulated: bool = False) -> StoredDraft:
        """Return a new draft from a file; without one, of the built-in simulated rig, or an empty one."""
        if path is None:
            return StoredDraft(draft=draft_of({}) if simulated else RigDraft())
        text = self._files.read(path)
        return StoredDraft(draft=draft_of(content_of(text)), path=str(path.absolute()), text=text)

    def _store(self, stored: StoredDraft) -> None:
        store_draft(self._folder, stored)
        self._stored = stored

    def _emit(self, message: str) -> None:
        self._events.emit("rig.setup", message)


def _check_scene(scene: str | None, path: str | None) -> None:
    """Raise `InvalidInput` for a scene that is not shipped, or one beside a rig file, which names its own."""
    if scene is None:
        return
    asked = f"open the scene {scene}"
    if path is not None:
        raise InvalidInput(
            asked=asked, found="a rig file names its own scene", remedy="change it in the file"
        )
    if scene not in shipped_scenes():
        names = ", ".join(shipped_scenes())
        raise InvalidInput(asked=asked, found="there is no such scene", remedy=f"use one of {names}")


def _faulty(faults: list[DraftFault]) -> InvalidInput:
    words = "; ".join(f"{fault.field}: {fault.message}" for fault in faults)
    return InvalidInput(
        f"asked to save the rig, and it would not open: {words}",
        asked="save the rig",
        found=words,
        remedy="correct these fields, then save again",
    )
