"""Routes of the named settings of all cameras."""

from typing import Annotated, Protocol

from fastapi import Depends, Path

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, opened_services, problems
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.named_documents import GivenName
from foveacam_server.resources.devices.cameras.presets import CameraPreset, CameraPresets
from foveacam_server.rig.hardware import HardwareThread

router = GuardedRouter("/cameras/presets", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class CameraPresetRouteServices(Protocol):
    """Services that these routes use."""

    camera_presets: CameraPresets
    hardware: HardwareThread
    lease: Lease


ServicesDep = Annotated[CameraPresetRouteServices, Depends(opened_services)]
NamePath = Annotated[GivenName, Path()]


@router.get("", summary="Named settings of all cameras")
def every(services: ServicesDep) -> list[CameraPreset]:
    """Return all presets by their names."""
    return services.camera_presets.presets.every()


@router.put("/{name}", summary="Save the cameras' settings", responses=problems(503, 507))
def save(name: NamePath, services: ServicesDep) -> CameraPreset:
    """Save what all connected cameras have now, over a preset of the same name."""
    return services.camera_presets.save(name, services.hardware)


@router.post(
    "/{name}/apply", summary="Apply saved settings", responses=problems(404, 409, 422, 502, 503, 504)
)
def apply(name: NamePath, services: ServicesDep, x_lease: LeaseHeader = None) -> CameraPreset:
    """Give every connected camera of a preset its settings, now and at every start, or none."""
    services.lease.check(x_lease)
    return services.camera_presets.apply(name, services.hardware)


@router.delete("/{name}", status_code=204, summary="Delete a preset", responses=problems(404, 507))
def delete(name: NamePath, services: ServicesDep) -> None:
    """Delete a preset; the cameras stay as they are."""
    services.camera_presets.presets.delete(name)
