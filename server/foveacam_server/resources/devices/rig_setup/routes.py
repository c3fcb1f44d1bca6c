"""Routes of the set-up: found devices, their pictures and tests, the draft, its file, opening it."""

from typing import Annotated

from fastapi import Query
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from foveacam_hardware.contract import Clock
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import LeaseHeader, file_responses, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.devices.rig_setup.draft_checks import advice_on, needs_of_draft
from foveacam_server.resources.devices.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.devices.rig_setup.pictures import CameraPictures
from foveacam_server.resources.devices.rig_setup.schema import (
    SIMULATED,
    AdviceDocument,
    CameraKind,
    CameraName,
    DraftDocument,
    DraftStart,
    FileOrder,
    FoundDevices,
    MirrorStepOrder,
    OpenOrder,
    RigDraft,
    RigFileDocument,
    RigFiles,
    TryOrder,
    TryResult,
)
from foveacam_server.resources.devices.rig_setup.service import RigSetupService
from foveacam_server.resources.devices.rig_setup.tries import step_mirrors, try_controller, try_pan_tilt
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread

router = GuardedRouter(
    "/rig/setup",
    tags=["rig set-up"],
    reading=Right.VIEW,
    changing=Right.ADMINISTER,
    opens=(DeviceSearch, CameraPictures),
)


KindQuery = Annotated[CameraKind, Query(description="kind of the camera, as found")]
NameQuery = Annotated[CameraName, Query(description="name of the camera, as found")]


@router.get("/devices", summary="Cameras and ports on every bus")
def devices(
    device_search: Provided[DeviceSearch],
    hardware: Provided[HardwareThread],
    rig_setup: Provided[RigSetupService],
) -> FoundDevices:
    """Search all buses for cameras and serial ports, which takes seconds; nothing is opened."""
    return device_search.run(status=hardware.status, needs=rig_setup.open_needs())


@router.get(
    "/picture.jpg",
    summary="A picture of a found camera",
    response_class=Response,
    responses=file_responses("image/jpeg") | problems(422, 502, 503, 504),
)
def picture(
    kind: KindQuery,
    name: NameQuery,
    camera_pictures: Provided[CameraPictures],
    hardware: Provided[HardwareThread],
) -> Response:
    """Return a picture as JPEG; a camera that is not in use is opened briefly."""
    jpeg = camera_pictures.take(kind, name, hardware.status)
    return Response(jpeg, media_type="image/jpeg", headers={"Cache-Control": "no-store"})


@router.get("/draft", summary="The draft of a rig file", responses=problems(422))
def draft(rig_setup: Provided[RigSetupService]) -> DraftDocument:
    """Return the draft, its file, and what is wrong with it, field by field."""
    return rig_setup.describe()


@router.put("/draft", summary="Change the draft", responses=problems(507))
def change_draft(request: RigDraft, rig_setup: Provided[RigSetupService]) -> DraftDocument:
    """Replace the draft's values; invalid ones are kept, and listed as faults in the answer."""
    return rig_setup.put(request)


@router.post("/draft", summary="Begin a draft anew", responses=problems(404, 507))
def begin_draft(request: DraftStart, rig_setup: Provided[RigSetupService]) -> DraftDocument:
    """Begin from a rig file of the list, or from an empty draft; unsaved changes are lost."""
    return rig_setup.begin(request.path, simulated=request.simulated)


@router.get("/advice", summary="What the doctor finds about the draft")
def advice(
    rig_setup: Provided[RigSetupService], device_search: Provided[DeviceSearch]
) -> list[AdviceDocument]:
    """Check cameras, ports and machine for the draft's devices, with the cameras of the last search."""
    draft = rig_setup.draft
    wanted, opened = needs_of_draft(draft).ports, rig_setup.open_needs().ports
    ours = set(wanted.values()) <= set(opened.values())
    return advice_on(draft, device_search, ours=ours)


@router.get("/file", summary="The rig file and what saving changes", responses=problems(422))
def rig_file(rig_setup: Provided[RigSetupService]) -> RigFileDocument:
    """Return the file's hash, the changes that saving would make, and what others have changed meanwhile."""
    return rig_setup.review()


@router.put("/file", summary="Save the rig file", responses=problems(409, 422, 507))
def save_file(request: FileOrder, rig_setup: Provided[RigSetupService]) -> RigFileDocument:
    """Merge the draft into its file if the file still has the seen hash; comments and other keys stay."""
    return rig_setup.save(request.hash)


@router.post("/undo", summary="Put the file's last version back", responses=problems(404, 409, 507))
def undo(request: FileOrder, rig_setup: Provided[RigSetupService]) -> RigFileDocument:
    """Undo the last save if the file still has the seen hash."""
    return rig_setup.undo(request.hash)


@router.get("/files", summary="The rig files that can be opened")
def files(rig_setup: Provided[RigSetupService]) -> RigFiles:
    """Return the command line's rig file and those of the data directory, with the faults of each."""
    return rig_setup.files()


@router.post("/open", summary="Open another rig", responses=problems(404, 409, 422, 504))
def open_rig(
    request: OpenOrder,
    lease: Provided[Lease],
    jobs: Provided[JobRunner],
    rig_setup: Provided[RigSetupService],
    hardware: Provided[HardwareThread],
    x_lease: LeaseHeader = None,
) -> RigFiles:
    """Park and close the rig, then open that of a rig file, without restarting the server."""
    lease.check(x_lease)
    if jobs.open_jobs:
        raise refusals.in_use("open another rig", "a job")
    rig_setup.open(request.path, hardware, scene=request.scene)
    return rig_setup.files()


@router.post("/tries", summary="Identify a device of the draft")
def try_device(
    request: TryOrder,
    rig_setup: Provided[RigSetupService],
    hardware_thread: Provided[HardwareThread],
    clock: Provided[Clock],
) -> TryResult:
    """Identify the device on the port; nothing moves or is switched on."""
    setup, hardware = rig_setup, hardware_thread
    ports = set(setup.open_needs().ports.values())
    ports |= {SIMULATED} if hardware.status.simulated else set()
    if request.device == "controller":
        return try_controller(setup.draft, hardware, open_ports=ports, clock=clock)
    table = setup.table("pan_tilt")
    return try_pan_tilt(setup.draft, table, hardware, open_ports=ports, clock=clock)


@router.post("/mirror_steps", summary="A small step of the mirrors", responses=problems(409, 502, 503, 504))
async def mirror_steps(
    request: MirrorStepOrder,
    lease: Provided[Lease],
    hardware: Provided[HardwareThread],
    clock: Provided[Clock],
    x_lease: LeaseHeader = None,
) -> TryResult:
    """Move each mirror of the open rig a small step and back; needs the lease."""
    lease.require(x_lease, asked="move the mirrors")
    return await run_in_threadpool(step_mirrors, hardware, clock=clock)
