"""Changes camera settings, stores them by serial number and restores them at every start."""

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
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.resources.devices.cameras.changes import (
    FOVEAE,
    REST_NAMES,
    SETTING_NAMES,
    CameraChange,
    refuse_own_exposure,
)
from foveacam_server.resources.devices.cameras.pair import PairDifference, differences
from foveacam_server.resources.devices.cameras.pair_exposure import PairExposure, PairSettings, find_exposure
from foveacam_server.resources.devices.cameras.records import CameraRecord, CameraRecords
from foveacam_server.resources.devices.cameras.schema import CamerasConfigured
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig
from foveacam_server.rig.status import RigStatus

_log = logging.getLogger(__name__)

OPEN = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)


class CameraSettingsService:
    """Changes settings of one camera, or of both foveae at once, through the hardware thread."""

    def __init__(self, records: CameraRecords, *, events: EventLog) -> None:
        self._records = records
        self._events = events
        self._before: dict[str, CameraSettings] = {}
        self._pending: dict[Role, CameraSettings] = {}
        self._seeking: set[Role] = set()
        """Cameras whose automatic exposure `once` is still running; used in the hardware thread only."""

    def restore_when_back(self, settings: Mapping[Role, CameraSettings]) -> None:
        """Store settings to apply to cameras that were lost during a change, when they reconnect."""
        self._pending.update(settings)

    def restore(self, rig: AssembledRig) -> None:
        """Apply the stored settings to each newly opened camera; hardware thread only."""
        for camera in (rig.wide, rig.left, rig.right):
            if camera.link.phase not in OPEN:
                continue
            serial = camera.info.serial
            if camera.role in self._pending:
                camera.configure(self._pending.pop(camera.role))
            if serial in self._before:
                continue
            self._before[serial] = camera.settings
            record = self._records.get(serial)
            if record is not None:
                self._restore_record(camera, record)

    def notice(self, rig: AssembledRig) -> None:
        """Store the exposure of each camera whose automatic `once` has finished; hardware thread only."""
        for camera in (rig.wide, rig.left, rig.right):
            if camera.role in self._seeking and camera.settings.exposure_auto is AutoMode.OFF:
                self._seeking.discard(camera.role)
                found_ms = camera.settings.exposure_ns / 1e6
                message = f"camera {camera.role.value} found an exposure of {found_ms:.3g} ms"
                try:
                    self._records.write(self._with_exposure(camera))
                except (
                    StorageFull,
                    DeviceFault,
                ) as error:  # logged: no request waits for it
                    self._emit(f"{message}, which is not kept: {error}", [camera], level=EventLevel.WARNING)
                else:
                    self._emit(message, [camera])

    def forget(self) -> None:
        """Forget the cameras of a closed rig, but keep their stored settings; hardware thread only."""
        self._before.clear()
        self._pending.clear()
        self._seeking.clear()

    def change(
        self, hardware: HardwareThread, roles: tuple[Role, ...], change: CameraChange
    ) -> "Future[None]":
        """Change all cameras or none; raise `Busy`, `InvalidInput` at once, other errors by the future."""
        if not change.changes:
            raise InvalidInput(
                "asked to change a camera, and no setting is named",
                asked="a change of a camera",
                found="no setting",
                remedy=f"send at least one of {', '.join(REST_NAMES)}",
            )
        hardware.use.check_free("change a camera")

        def work(rig: AssembledRig) -> None:
            cameras = [_camera(rig, role) for role in roles]
            self._change_all(cameras, change)
            hardware.refresh(rig)

        return hardware.submit(work)

    def find_pair_exposure(self, hardware: HardwareThread) -> PairExposure:
        """Find one exposure for both foveae by several looks and store it; blocks, so not on the event loop.

        Raise `Busy` or any error of a look; the foveae then have their earlier settings.
        """
        hardware.use.check_free("change a camera")
        self._check_alike(hardware.status)
        before = {camera.role: camera.settings for camera in hardware.status.cameras}
        with hardware.session("the search for an exposure", cancelled=lambda: False) as head:
            found = find_exposure(head, _pair(hardware.status), gaze=hardware.gaze)

        def work(rig: AssembledRig) -> None:
            cameras = [rig.left, rig.right]
            try:
                with self._records.writing([self._with_exposure(camera) for camera in cameras]):
                    pass
            except FoveaError:
                _put_back([(camera, before[camera.role]) for camera in cameras])
                raise
            level = EventLevel.INFO if found.good else EventLevel.WARNING
            self._emit(found.summary, cameras, level=level)
            hardware.refresh(rig)

        answer_of(hardware.submit(work), asked="the exposure that was found")
        return found

    def _check_alike(self, status: RigStatus) -> None:
        apart = [found.setting for found in self.divergence(status) if found.setting != "exposure_ms"]
        if apart:
            raise InvalidInput(
                f"asked for one exposure of both foveae, and they differ in {', '.join(apart)}",
                asked="one exposure for both foveae",
                found=f"they differ in {', '.join(apart)}",
                remedy="give both the same settings, then ask again",
            )

    def reset(self, hardware: HardwareThread, role: Role) -> "Future[None]":
        """Delete a camera's stored settings and apply the rig file's."""
        hardware.use.check_free("change a camera")

        def work(rig: AssembledRig) -> None:
            camera = _camera(rig, role)
            found, before = camera.settings, self._before.get(camera.info.serial)
            if before is not None:
                camera.configure(before)
            try:
                self._records.delete(camera.info.serial)
            except FoveaError:
                _put_back([(camera, found)])
                raise
            self._seeking.discard(role)
            self._emit(f"camera {role.value} has the rig file's settings again", [camera], reset=True)
            hardware.refresh(rig)

        return hardware.submit(work)

    def has_record(self, serial: str) -> bool:
        """Return whether settings of a camera are stored."""
        return self._records.get(serial) is not None

    def divergence(self, status: RigStatus) -> tuple[PairDifference, ...]:
        """Return the settings in which the foveae differ; none while one of them is missing."""
        pair = {camera.role: camera for camera in status.cameras if camera.role in FOVEAE}
        if len(pair) < len(FOVEAE) or any(not camera.ranges.pixel_formats for camera in pair.values()):
            return ()
        left, right = pair[Role.LEFT], pair[Role.RIGHT]
        return differences(left.settings, right.settings, ranges=left.ranges)

    def _change_all(self, cameras: list[Camera], change: CameraChange) -> None:
        done: list[tuple[Camera, CameraSettings]] = []
        try:
            with self._records.writing([self._record(camera, change.lasting) for camera in cameras]):
                for camera in cameras:
                    before = camera.settings
                    self._configure(camera, change)
                    done.append((camera, before))
        except FoveaError:
            _put_back(done)  # all or none
            raise
        for camera in cameras:
            if "exposure_auto" in change.changes:
                self._seeking.discard(camera.role)
            if change.exposure_auto is AutoMode.ONCE:
                self._seeking.add(camera.role)
        self._emit(f"camera {' and '.join(camera.role.value for camera in cameras)} changed", cameras)

    def _configure(self, camera: Camera, change: CameraChange) -> None:
        asked = change.applied_to(camera.settings)
        refuse_own_exposure(camera, asked)
        camera.configure(asked)

    def _record(self, camera: Camera, changes: Mapping[str, object]) -> CameraRecord:
        serial = camera.info.serial
        before = self._records.get(serial) or CameraRecord(serial=serial)
        return before.model_copy(update=dict(changes))

    def _with_exposure(self, camera: Camera) -> CameraRecord:
        by_hand = {"exposure_ns": camera.settings.exposure_ns, "exposure_auto": AutoMode.OFF}
        return self._record(camera, by_hand)

    def _restore_record(self, camera: Camera, record: CameraRecord) -> None:
        change = CameraChange(**{name: getattr(record, name) for name in SETTING_NAMES})
        try:
            self._configure(camera, change)
        except FoveaError as error:
            _log.warning("camera %s does not take what was kept for it: %s", camera.role, error)
            self._events.emit(
                "camera.settings",
                f"camera {camera.role.value} does not take what was kept for it, the rig file counts:"
                f" {error}",
                level=EventLevel.WARNING,
                data=CamerasConfigured(roles=[camera.role.value], reset=True),
            )

    def _emit(
        self, message: str, cameras: list[Camera], *, reset: bool = False, level: EventLevel = EventLevel.INFO
    ) -> None:
        data = CamerasConfigured(roles=[camera.role.value for camera in cameras], reset=reset)
        self._events.emit("camera.settings", message, level=level, data=data)


def _put_back(changed: Sequence[tuple[Camera, CameraSettings]]) -> None:
    for camera, before in changed:
        camera.configure(before)


def _camera(rig: AssembledRig, role: Role) -> Camera:
    return {Role.WIDE: rig.wide, Role.LEFT: rig.left, Role.RIGHT: rig.right}[role]


def _pair(status: RigStatus) -> PairSettings:
    """Return the common settings of both foveae."""
    left, right = (next(camera for camera in status.cameras if camera.role is role) for role in FOVEAE)
    spans_ns = (left.ranges.exposure_ns, right.ranges.exposure_ns)
    both_ns = ValueRange(low=max(span.low for span in spans_ns), high=min(span.high for span in spans_ns))
    return PairSettings(exposure_ns=left.settings.exposure_ns, gain_db=left.settings.gain_db, span_ns=both_ns)
