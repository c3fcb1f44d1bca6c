"""Settings of cameras as the operator wants them: changed, kept by serial number, asked again at a start."""

import logging
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, replace

from foveacam_hardware.contract import (
    Camera,
    CameraPhase,
    CameraSettings,
    FoveaError,
    InvalidInput,
    PixelFormat,
    Role,
)
from foveacam_server.runtime import refusals
from foveacam_server.runtime.camera_pair import Difference, differences
from foveacam_server.runtime.camera_records import CameraRecord, CameraRecords
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.hardware import HardwareThread
from foveacam_server.runtime.ports import Rig
from foveacam_server.runtime.rig_status import RigStatus

_log = logging.getLogger(__name__)

OPEN = (CameraPhase.READY, CameraPhase.STREAMING, CameraPhase.DEGRADED)
FOVEAE = (Role.LEFT, Role.RIGHT)


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraWish:
    """What shall change; None stays as it is."""

    exposure_ns: int | None = None
    gain_db: float | None = None
    black_level: float | None = None
    frame_rate_hz: float | None = None
    pixel_format: PixelFormat | None = None

    @property
    def changes(self) -> Mapping[str, object]:
        """What is wished, by the names of the settings."""
        every = {name: getattr(self, name) for name in WISHED}
        return {name: value for name, value in every.items() if value is not None}

    def applied_to(self, settings: CameraSettings) -> CameraSettings:
        """Return settings with what is wished."""
        return replace(settings, **self.changes)  # type: ignore[arg-type]  # each is of its field's type


WISHED = ("exposure_ns", "gain_db", "black_level", "frame_rate_hz", "pixel_format")


class CameraDesk:
    """Changes settings through the hardware thread, one camera or both foveae at once."""

    def __init__(self, records: CameraRecords, *, events: EventLog) -> None:
        self._records = records
        self._events = events
        self._before: dict[str, CameraSettings] = {}
        self._owed: dict[Role, CameraSettings] = {}

    def owe(self, settings: Mapping[Role, CameraSettings]) -> None:
        """Give cameras that were lost in the middle of a change these settings once they are back."""
        self._owed.update(settings)

    def restore(self, rig: Rig) -> None:
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

    def change(self, hardware: HardwareThread, roles: tuple[Role, ...], wish: CameraWish) -> "Future[None]":
        """Change cameras, all or none; raise `Busy` and `InvalidInput` at once, others by the future."""
        if not wish.changes:
            raise InvalidInput(
                "asked to change a camera, and no setting is named; send at least one",
                asked="a change of a camera",
                found="no setting",
                remedy=f"send one of {', '.join(SENT)}",
            )
        _check_free(hardware)

        def work(rig: Rig) -> None:
            cameras = [_camera(rig, role) for role in roles]
            self._change_all(cameras, wish)
            hardware.refresh(rig)

        return hardware.submit(work)

    def reset(self, hardware: HardwareThread, role: Role) -> "Future[None]":
        """Forget what was kept for a camera, and run it as the rig file says."""
        _check_free(hardware)

        def work(rig: Rig) -> None:
            camera = _camera(rig, role)
            before = self._before.get(camera.info.serial)
            if before is not None:
                camera.configure(before)
            self._records.forget(camera.info.serial)
            self._tell(f"camera {role.value} runs as the rig file says", [camera], reset=True)
            hardware.refresh(rig)

        return hardware.submit(work)

    def kept(self, serial: str) -> bool:
        """Tell whether anything is kept for a camera."""
        return self._records.of(serial) is not None

    def divergence(self, status: RigStatus) -> tuple[Difference, ...]:
        """Return in what the foveae differ; nothing while one of them is missing."""
        pair = {camera.role: camera for camera in status.cameras if camera.role in FOVEAE}
        if len(pair) < len(FOVEAE) or any(not camera.ranges.pixel_formats for camera in pair.values()):
            return ()
        left, right = pair[Role.LEFT], pair[Role.RIGHT]
        return differences(left.settings, right.settings, ranges=left.ranges)

    def _change_all(self, cameras: list[Camera], wish: CameraWish) -> None:
        done: list[tuple[Camera, CameraSettings]] = []
        try:
            for camera in cameras:
                before = camera.settings
                camera.configure(wish.applied_to(before))
                done.append((camera, before))
        except FoveaError:
            for camera, before in done:  # all or none
                camera.configure(before)
            raise
        for camera in cameras:
            self._keep(camera.info.serial, wish)
        self._tell(f"camera {' and '.join(camera.role.value for camera in cameras)} changed", cameras)

    def _keep(self, serial: str, wish: CameraWish) -> None:
        before = self._records.of(serial) or CameraRecord(serial=serial)
        self._records.keep(before.model_copy(update=dict(wish.changes)))

    def _ask_again(self, camera: Camera, record: CameraRecord) -> None:
        wish = CameraWish(**{name: getattr(record, name) for name in WISHED})
        try:
            camera.configure(wish.applied_to(camera.settings))
        except FoveaError as error:
            _log.warning("camera %s does not take what was kept for it: %s", camera.role, error)
            self._events.emit(
                "camera.settings",
                f"camera {camera.role.value} does not take what was kept for it, the rig file counts:"
                f" {error}",
                level=Level.WARNING,
                data={"roles": [camera.role.value], "reset": True},
            )

    def _tell(self, message: str, cameras: list[Camera], *, reset: bool = False) -> None:
        roles = [camera.role.value for camera in cameras]
        self._events.emit("camera.settings", message, data={"roles": roles, "reset": reset})


SENT = ("exposure_ms", "gain_db", "black_level", "frame_rate_hz", "pixel_format")
"""The settings by the names that REST has."""


def _check_free(hardware: HardwareThread) -> None:
    if hardware.busy_with is not None:
        raise refusals.in_use("change a camera", hardware.busy_with)


def _camera(rig: Rig, role: Role) -> Camera:
    return {Role.WIDE: rig.wide, Role.LEFT: rig.left, Role.RIGHT: rig.right}[role]
