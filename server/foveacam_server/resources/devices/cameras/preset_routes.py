"""Routes of the named settings of all cameras."""

from typing import Annotated

from fastapi import Path

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import GivenName
from foveacam_server.resources.devices.cameras.presets import CameraPreset, CameraPresets
from foveacam_server.rig.hardware import HardwareThread

router = GuardedRouter("/cameras/presets", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


NamePath = Annotated[GivenName, Path()]


@router.get("", summary="Named settings of all cameras")
def every(camera_presets: Provided[CameraPresets]) -> list[CameraPreset]:
    """Return all presets by their names."""
    return camera_presets.presets.every()


@router.put("/{name}", summary="Save the cameras' settings", responses=problems(503, 507))
def save(
    name: NamePath, camera_presets: Provided[CameraPresets], hardware: Provided[HardwareThread]
) -> CameraPreset:
    """Save the present settings of all connected cameras, replacing a preset of the same name."""
    return camera_presets.save(name, hardware)


@router.post(
    "/{name}/apply", summary="Apply saved settings", responses=problems(404, 409, 422, 502, 503, 504)
)
def apply(
    name: NamePath,
    lease: Provided[Lease],
    camera_presets: Provided[CameraPresets],
    hardware: Provided[HardwareThread],
    x_lease: LeaseHeader = None,
) -> CameraPreset:
    """Give every connected camera of a preset its settings, now and at every start, or none."""
    lease.check(x_lease)
    return camera_presets.apply(name, hardware)


@router.delete("/{name}", status_code=204, summary="Delete a preset", responses=problems(404, 507))
def delete(name: NamePath, camera_presets: Provided[CameraPresets]) -> None:
    """Delete a preset; the cameras stay as they are."""
    camera_presets.presets.delete(name)
