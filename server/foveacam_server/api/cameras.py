"""The cameras: who they are and how they deliver."""

from typing import Literal

from fastapi import APIRouter

from foveacam_server.api.answers import problems
from foveacam_server.api.rig_models import CameraDocument
from foveacam_server.errors import NotFound
from foveacam_server.runtime.rig_status import CameraStatus
from foveacam_server.runtime.services import ServicesDep

router = APIRouter(prefix="/cameras", tags=["rig"])


@router.get("", summary="All cameras")
async def every(services: ServicesDep) -> list[CameraDocument]:
    """Return all cameras as last seen."""
    now_ns = services.clock.now_ns()
    return [camera_document(camera, now_ns=now_ns) for camera in services.hardware.status.cameras]


@router.get("/{role}", summary="One camera", responses=problems(404))
async def one(role: Literal["wide", "left", "right"], services: ServicesDep) -> CameraDocument:
    """Return one camera as last seen."""
    for camera in services.hardware.status.cameras:
        if camera.role.value == role:
            return camera_document(camera, now_ns=services.clock.now_ns())
    raise NotFound(f"camera {role} is not known yet: the rig is still opening; try again in a moment")


def camera_document(camera: CameraStatus, *, now_ns: int) -> CameraDocument:
    """Return one camera as REST shows it."""
    age_ms = None if camera.newest_t_ns is None else round((now_ns - camera.newest_t_ns) / 1e6, 1)
    return CameraDocument(
        role=camera.role.value,
        vendor=camera.info.vendor,
        model=camera.info.model,
        serial=camera.info.serial,
        connected=camera.connected,
        width=camera.width,
        height=camera.height,
        exposure_ms=camera.settings.exposure_ns / 1e6,
        frame_rate_hz=round(camera.frame_rate_hz, 2),
        frame_age_ms=age_ms,
        delivered=camera.counters.delivered,
        dropped=camera.counters.dropped,
    )
