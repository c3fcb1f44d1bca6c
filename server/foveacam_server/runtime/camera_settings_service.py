"""Settings of cameras as the operator wants them: changed, kept by serial number, asked again at a start."""

import logging
from collections.abc import Mapping, Sequence
from concurrent.futures import Future

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraPhase,
    CameraSettings,
    DeviceFault,
    FoveaError,
    InvalidInput,
    Role,
    StorageFull,
    ValueRange,
)
from foveacam_server.runtime import refusals
from foveacam_server.runtime.camera_change import (
    FOVEAE,
    SENT,
    WISHED,
    CameraChange,
    refuse_own_exposure,
)
from foveacam_server.runtime.camera_pair import PairDifference, differences
from foveacam_server.runtime.camera_records import CameraRecord, CameraRecords
from foveacam_server.runtime.events import EventLevel, EventLog
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.hardware_commands import answer_of
from foveacam_server.runtime.pair_exposure import PairExposure, PairSettings, find_exposure
from foveacam_server.runtime.ports import AssembledRig
from foveacam_server.runtime.rig_status import RigStatus

_log = logging.getLogger(__name__)

OPEN = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)


class CameraSettingsService:
    """Changes settings through the hardware thread, one camera or both foveae at once."""

    def __init__(self, records: CameraRecords, *, events: EventLog) -> None:
        self._records = records
        self._events = events
        self._before: dict[str, CameraSettings] = {}
        self._owed: dict[Role, CameraSettings] = {}
        self._seeking: set[Role] = set()
        """Cameras that set their exposure once, and have not ended; the hardware thread's."""

    def owe(self, settings: Mapping[Role, CameraSettings]) -> None:
        """Give cameras that were lost in the middle of a change these settings once they are back."""
        self._owed.update(settings)

    def restore(self, rig: AssembledRig) -> None:
        """Give each camera that was opened for the first time what was kept for it; hardware thread only."""
        for camera in (rig.wide, rig.left, rig.right):
            if camera.link.phase not in OPEN:
                continue
            serial = camera.info.serial
            if camera.role in self._owed:
                camera.configure(self._owed.pop(camera.role))
            if serial in self._before:
                continue
            self._before[serial] = camera.settings
            record = self._records.of(serial)
            if record is not None:
                self._ask_again(camera, record)

    def notice(self, rig: AssembledRig) -> None:
        """Keep the exposure of each camera that has found one; hardware thread only."""
        for camera in (rig.wide, rig.left, rig.right):
            if camera.role in self._seeking and camera.settings.exposure_auto is AutoMode.OFF:
                self._seeking.discard(camera.role)
                found_ms = camera.settings.exposure_ns / 1e6
                message = f"camera {camera.role.value} found an exposure of {found_ms:.3g} ms"
                try:
                    self._records.keep(self._with_exposure(camera))
                except (StorageFull, DeviceFault) as error:  # nobody waits for it: it counts until the end
                    self._tell(f"{message}, which is not kept: {error}", [camera], level=EventLevel.WARNING)
                else:
                    self._tell(message, [camera])

    def change(self, hardware: HardwareThread, roles: tuple[Role, ...], wish: CameraChange) -> "Future[None]":
        """Change cameras, all or none; raise `Busy` and `InvalidInput` at once, others by the future."""
        if not wish.changes:
            raise InvalidInput(
                "asked to change a camera, and no setting is named; send at least one",
                asked="a change of a camera",
                found="no setting",
                remedy=f"send one of {', '.join(SENT)}",
            )
        _check_free(hardware)

        def work(rig: AssembledRig) -> None:
            cameras = [_camera(rig, role) for role in roles]
            self._change_all(cameras, wish)
            hardware.refresh(rig)

        return hardware.submit(work)

    def seek(self, hardware: HardwareThread) -> PairExposure:
        """Find one exposure for both foveae by looking, and keep it; takes looks, so call it off the loop.

        Raise what looks raise, and `Busy`; the foveae are then as they were.
        """
        _check_free(hardware)
        self._check_alike(hardware.status)
        before = {camera.role: camera.settings for camera in hardware.status.cameras}
        with hardware.session("the search for an exposure", cancelled=lambda: False) as head:
            found = find_exposure(head, _pair(hardware.status), gaze=hardware.gaze)

        def work(rig: AssembledRig) -> None:
            cameras = [rig.left, rig.right]
            try:
                with self._records.keeping([self._with_exposure(camera) for camera in cameras]):
                    pass
            except FoveaError:
                _put_back([(camera, before[camera.role]) for camera in cameras])
                raise
            level = EventLevel.INFO if found.good else EventLevel.WARNING
            self._tell(found.told, cameras, level=level)
            hardware.refresh(rig)

        answer_of(hardware.submit(work), asked="the exposure that was found")
        return found

    def _check_alike(self, status: RigStatus) -> None:
        apart = [found.setting for found in self.divergence(status) if found.setting != "exposure_ms"]
        if apart:
            raise InvalidInput(
                f"asked for one exposure of both foveae, and they differ in {', '.join(apart)}; give both the"
                " same, then ask again",
                asked="one exposure for both foveae",
                found=f"they differ in {', '.join(apart)}",
                remedy="give both the same settings",
            )

    def reset(self, hardware: HardwareThread, role: Role) -> "Future[None]":
        """Forget what was kept for a camera, and run it as the rig file says."""
        _check_free(hardware)

        def work(rig: AssembledRig) -> None:
            camera = _camera(rig, role)
            found, before = camera.settings, self._before.get(camera.info.serial)
            if before is not None:
                camera.configure(before)
            try:
                self._records.forget(camera.info.serial)
            except FoveaError:
                _put_back([(camera, found)])
                raise
            self._seeking.discard(role)
            self._tell(f"camera {role.value} runs as the rig file says", [camera], reset=True)
            hardware.refresh(rig)

        return hardware.submit(work)

    def kept(self, serial: str) -> bool:
        """Tell whether anything is kept for a camera."""
        return self._records.of(serial) is not None

    def divergence(self, status: RigStatus) -> tuple[PairDifference, ...]:
        """Return in what the foveae differ; nothing while one of them is missing."""
        pair = {camera.role: camera for camera in status.cameras if camera.role in FOVEAE}
        if len(pair) < len(FOVEAE) or any(not camera.ranges.pixel_formats for camera in pair.values()):
            return ()
        left, right = pair[Role.LEFT], pair[Role.RIGHT]
        return differences(left.settings, right.settings, ranges=left.ranges)

    def _change_all(self, cameras: list[Camera], wish: CameraChange) -> None:
        done: list[tuple[Camera, CameraSettings]] = []
        try:
            with self._records.keeping([self._record(camera, wish.lasting) for camera in cameras]):
                for camera in cameras:
                    before = camera.settings
                    self._configure(camera, wish)
                    done.append((camera, before))
        except FoveaError:
            _put_back(done)  # all or none
            raise
        for camera in cameras:
            if "exposure_auto" in wish.changes:
                self._seeking.discard(camera.role)
            if wish.exposure_auto is AutoMode.ONCE:
                self._seeking.add(camera.role)
        self._tell(f"camera {' and '.join(camera.role.value for camera in cameras)} changed", cameras)

    def _configure(self, camera: Camera, wish: CameraChange) -> None:
        asked = wish.applied_to(camera.settings)
        refuse_own_exposure(camera, asked)
        camera.configure(asked)

    def _record(self, camera: Camera, changes: Mapping[str, object]) -> CameraRecord:
        serial = camera.info.serial
        before = self._records.of(serial) or CameraRecord(serial=serial)
        return before.model_copy(update=dict(changes))

    def _with_exposure(self, camera: Camera) -> CameraRecord:
        by_hand = {"exposure_ns": camera.settings.exposure_ns, "exposure_auto": AutoMode.OFF}
        return self._record(camera, by_hand)

    def _ask_again(self, camera: Camera, record: CameraRecord) -> None:
        wish = CameraChange(**{name: getattr(record, name) for name in WISHED})
        try:
            self._configure(camera, wish)
        except FoveaError as error:
            _log.warning("camera %s does not take what was kept for it: %s", camera.role, error)
            self._events.emit(
                "camera.settings",
                f"camera {camera.role.value} does not take what was kept for it, the rig file counts:"
                f" {error}",
                level=EventLevel.WARNING,
                data={"roles": [camera.role.value], "reset": True},
            )

    def _tell(
        self, message: str, cameras: list[Camera], *, reset: bool = False, level: EventLevel = EventLevel.INFO
    ) -> None:
        roles = [camera.role.value for camera in cameras]
        self._events.emit("camera.settings", message, level=level, data={"roles": roles, "reset": reset})


def _check_free(hardware: HardwareThread) -> None:
    if hardware.busy_with is not None:
        raise refusals.in_use("change a camera", hardware.busy_with)


def _put_back(changed: Sequence[tuple[Camera, CameraSettings]]) -> None:
    for camera, before in changed:
        camera.configure(before)


def _camera(rig: AssembledRig, role: Role) -> Camera:
    return {Role.WIDE: rig.wide, Role.LEFT: rig.left, Role.RIGHT: rig.right}[role]


def _pair(status: RigStatus) -> PairSettings:
    """Return what both foveae run with, which is the same."""
    left, right = (next(camera for camera in status.cameras if camera.role is role) for role in FOVEAE)
    spans_ns = (left.ranges.exposure_ns, right.ranges.exposure_ns)
    both_ns = ValueRange(low=max(span.low for span in spans_ns), high=min(span.high for span in spans_ns))
    return PairSettings(exposure_ns=left.settings.exposure_ns, gain_db=left.settings.gain_db, span_ns=both_ns)
