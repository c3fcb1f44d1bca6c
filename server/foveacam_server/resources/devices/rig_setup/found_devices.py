"""Searches every bus for cameras and serial ports; opens none of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import cast

from foveacam_hardware.contract import FoveaError
from foveacam_hardware.drivers.cameras.device import FoundCamera
from foveacam_hardware.rig_cameras import camera_searches
from foveacam_hardware.wire.controller import USB_PRODUCT_ID, USB_VENDOR_ID
from foveacam_hardware.wire.usb_ports import BY_ID, BY_SERIAL
from foveacam_server.checks.cameras import Discover
from foveacam_server.checks.chosen_ports import UsbSerialPort, usb_serial_ports, uses_of_ports
from foveacam_server.checks.machine import Machine
from foveacam_server.checks.needs import RigNeeds
from foveacam_server.foundation.errors import NotFound
from foveacam_server.resources.devices.rig_setup.schema import (
    SIMULATED,
    CameraKind,
    FoundCameraDocument,
    FoundDevices,
    FoundPortDocument,
    RoleName,
    SilentBus,
)
from foveacam_server.rig.status import RigStatus

THIS_RIG = "this rig has it open"


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceSearch:
    """Searches of one machine, with the last result of each; tests replace the searches."""

    machine: Machine = field(default_factory=Machine)
    cameras: Mapping[str, Discover] = field(default_factory=camera_searches)
    _last: dict[str, list[FoundCamera] | FoveaError] = field(default_factory=dict)

    def run(self, *, status: RigStatus, needs: RigNeeds) -> FoundDevices:
        """Search all buses, which takes seconds. `needs`: the open rig's, to name the ports in use."""
        found, silent = [], []
        for kind in self.cameras:
            try:
                found += [self._camera(camera, status) for camera in self._search(kind)]
            except FoveaError as error:
                silent.append(SilentBus(kind=kind, problem=str(error)))
        uses = uses_of_ports(self.machine, needs)
        ports = [self._port(port, uses.get(port.name)) for port in usb_serial_ports(self.machine)]
        if status.simulated:
            found += [_simulated_camera(role.value, status) for role in (one.role for one in status.cameras)]
            ports.append(_simulated_port())
        return FoundDevices(cameras=found, ports=ports, silent=silent)

    def require_camera(self, kind: CameraKind, name: str) -> None:
        """Raise `NotFound` when a camera is not on its bus now."""
        if any(camera.info.serial == name for camera in self._known(kind)):
            return
        names = [camera.info.serial for camera in self._search(kind)] if kind in self.cameras else []
        if name not in names:
            raise NotFound(
                f"{kind} camera {name} is not there; {kind} has {', '.join(names) or 'none'}",
                asked=f"{kind} camera {name}",
                found=", ".join(names) or "none",
                remedy="plug it in, or choose another one",
            )

    def remembered(self) -> Mapping[str, Discover]:
        """Return searches that reuse the last result, and search only where there is none yet."""
        return {kind: partial(self._remembered, kind) for kind in self.cameras}

    def _remembered(self, kind: str) -> list[FoundCamera]:
        last = self._last.get(kind)
        if isinstance(last, FoveaError):
            raise last
        return self._search(kind) if last is None else last

    def _known(self, kind: str) -> list[FoundCamera]:
        last = self._last.get(kind)
        return last if isinstance(last, list) else []

    def _search(self, kind: str) -> list[FoundCamera]:
        try:
            found = self.cameras[kind]()
        except FoveaError as error:
            self._last[kind] = error
            raise
        self._last[kind] = found
        return found

    def _camera(self, camera: FoundCamera, status: RigStatus) -> FoundCameraDocument:
        role = _role_of(camera, status)
        return FoundCameraDocument(
            kind=cast(CameraKind, camera.kind),
            name=camera.info.serial,
            vendor=camera.info.vendor,
            model=camera.info.model,
            serial=camera.info.serial,
            address=camera.address,
            role=role,
            in_use=THIS_RIG if role is not None else self._holder(camera.address),
            problem=camera.problem,
        )

    def _port(self, port: UsbSerialPort, use: str | None) -> FoundPortDocument:
        controller = port.usb_id == f"{USB_VENDOR_ID:04x}:{USB_PRODUCT_ID:04x}"
        return FoundPortDocument(
            name=_stable_name(port, controller=controller),
            device=port.name,
            usb_id=port.usb_id,
            product=port.product,
            serial=port.serial,
            use=use,
            in_use=THIS_RIG if use is not None else self._holder(port.name),
            problem=self._closed(port),
            controller=controller,
        )

    def _closed(self, port: UsbSerialPort) -> str | None:
        if self.machine.may_use(port.path):
            return None
        group, user = self.machine.group_of(port.path), self.machine.user
        return f"{user} may not open it; sudo usermod -aG {group} {user}, then log out and in again"

    def _holder(self, device: str) -> str | None:
        """Return which process has a device file open; None for none or for another kind of address."""
        if not device.startswith("/dev/"):
            return None
        holders = self.machine.holders(self.machine.at(device))
        if not holders:
            return None
        return f"process {holders[0].pid} ({holders[0].name}) has it open; end that program"


def _role_of(camera: FoundCamera, status: RigStatus) -> RoleName | None:
    names = {camera.info.serial, camera.address}
    for one in status.cameras:
        if not status.simulated and one.info.serial in names and one.connected:
            return one.role.value
    return None


def _stable_name(port: UsbSerialPort, *, controller: bool) -> str:
    """Return a name of the port that stays the same in another socket, where it has one."""
    if controller and port.serial:
        return f"{BY_SERIAL}{port.serial}"
    return f"{BY_ID}/{port.by_id.removeprefix('by-id/')}" if port.by_id else port.name


def _simulated_camera(role: str, status: RigStatus) -> FoundCameraDocument:
    info = next(one.info for one in status.cameras if one.role.value == role)
    return FoundCameraDocument(
        kind=SIMULATED,
        name=role,
        vendor=info.vendor,
        model=info.model,
        serial=info.serial,
        address="",
        role=cast(RoleName, role),
        in_use=THIS_RIG,
        problem=None,
    )


def _simulated_port() -> FoundPortDocument:
    return FoundPortDocument(
        name=SIMULATED,
        device=SIMULATED,
        usb_id="",
        product="simulated mirror controller",
        serial="",
        use="mirrors",
        in_use=THIS_RIG,
        problem=None,
        controller=True,
    )
