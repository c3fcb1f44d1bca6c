"""Routes of the cameras: status, settings, trigger tests."""

import asyncio
from dataclasses import replace
from typing import Annotated, Literal, TypeAlias

from fastapi import Path
from fastapi.responses import JSONResponse
from starlette.concurrency import run_in_threadpool

from foveacam_hardware.contract import AutoMode, Clock, InvalidInput, PixelFormat, Role, ValueRange
from foveacam_pipeline.models.resolution import px_per_deg
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import (
    IdempotencyHeader,
    LeaseHeader,
    PreferHeader,
    job_answer,
    problems,
)
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.schema import JobDocument
from foveacam_server.resources.devices.cameras.changes import FOVEAE, CameraChange, waits_for_pulses
from foveacam_server.resources.devices.cameras.schema import (
    CameraDocument,
    CameraLinkDocument,
    CameraPatch,
    CameraRangesDocument,
    CamerasChangedDocument,
    CameraSettingsDocument,
    DifferenceDocument,
    SpanDocument,
    TriggerTestDocument,
)
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.cameras.trigger_tests import TriggerTests
from foveacam_server.rig import refusals
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.status import CameraStatus

router = GuardedRouter("/cameras", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


RoleName: TypeAlias = Literal["wide", "left", "right"]
TestId = Annotated[str, Path(max_length=64)]


@router.get("", summary="All cameras")
async def every(
    hardware: Provided[HardwareThread],
    clock: Provided[Clock],
    calibration: Provided[CalibrationInForce],
    cameras: Provided[CameraSettingsService],
) -> list[CameraDocument]:
    """Return the last status of all cameras."""
    return [camera_document(camera, clock, calibration, cameras) for camera in hardware.status.cameras]


@router.post(
    "/self_tests",
    status_code=202,
    summary="Test both triggers",
    response_model=JobDocument,
    responses={
        200: {"model": TriggerTestDocument, "description": "ended in time"},
        **problems(409, 502, 503, 504),
    },
)
async def test_triggers(
    lease: Provided[Lease],
    trigger_tests: Provided[TriggerTests],
    jobs: Provided[JobRunner],
    prefer: PreferHeader = None,
    idempotency_key: IdempotencyHeader = None,
    x_lease: LeaseHeader = None,
) -> JSONResponse:
    """Queue a test of both eyes: a command to each, then one pulse to both; settings are restored."""
    lease.check(x_lease)
    job = trigger_tests.submit(idempotency_key=idempotency_key)
    return await job_answer(jobs, job, prefer=prefer, result=trigger_tests.get)


@router.get("/self_tests", summary="All trigger tests, newest first")
def tests(trigger_tests: Provided[TriggerTests]) -> list[TriggerTestDocument]:
    """Return the results of all trigger tests."""
    return trigger_tests.every()


@router.get("/self_tests/newest", summary="Newest trigger test")
def newest_test(trigger_tests: Provided[TriggerTests]) -> TriggerTestDocument:
    """Return the newest trigger test; before the first both eyes are `untested`."""
    return trigger_tests.newest()


@router.get("/self_tests/{test_id}", summary="One trigger test", responses=problems(404))
def one_test(test_id: TestId, trigger_tests: Provided[TriggerTests]) -> TriggerTestDocument:
    """Return the result of one trigger test."""
    return trigger_tests.get(test_id)


@router.get("/{role}", summary="One camera", responses=problems(503))
async def one(
    role: RoleName,
    clock: Provided[Clock],
    calibration: Provided[CalibrationInForce],
    cameras: Provided[CameraSettingsService],
    hardware: Provided[HardwareThread],
) -> CameraDocument:
    """Return the last status of one camera."""
    return camera_document(_status(role, hardware), clock, calibration, cameras)


@router.patch("/{role}", summary="Change a camera's settings", responses=problems(404, 409, 502, 503, 504))
async def change(
    role: RoleName,
    request: CameraPatch,
    lease: Provided[Lease],
    cameras: Provided[CameraSettingsService],
    hardware: Provided[HardwareThread],
    clock: Provided[Clock],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> CamerasChangedDocument:
    """Change settings now and at every start; return what the camera accepted, or refuse with its range.

    `linked` changes both foveae, or neither. Hardware-triggered foveae have no automatic exposure; `once`
    with `linked` takes a few looks at the mirrors' present pose, and sets one exposure for both.
    """
    lease.check(x_lease)
    _status(role, hardware)
    roles = _roles(Role(role), linked=request.linked)
    change = _change(request)
    looks = request.linked and change.exposure_auto is AutoMode.ONCE and _wait_for_pulses(roles, hardware)
    if looks:
        change = replace(change, exposure_auto=None)
    if change.changes or not looks:
        await asyncio.wrap_future(cameras.change(hardware, roles, change))
    if looks:
        await run_in_threadpool(cameras.find_pair_exposure, hardware)
    return _changed(roles, hardware, cameras, clock, calibration)


@router.delete(
    "/{role}/settings", summary="Forget a camera's settings", responses=problems(404, 409, 502, 503, 504)
)
async def reset(
    role: RoleName,
    lease: Provided[Lease],
    cameras: Provided[CameraSettingsService],
    hardware: Provided[HardwareThread],
    clock: Provided[Clock],
    calibration: Provided[CalibrationInForce],
    x_lease: LeaseHeader = None,
) -> CamerasChangedDocument:
    """Apply the rig file's settings, now and at every start."""
    lease.check(x_lease)
    _status(role, hardware)
    await asyncio.wrap_future(cameras.reset(hardware, Role(role)))
    return _changed((Role(role),), hardware, cameras, clock, calibration)


def camera_document(
    camera: CameraStatus,
    clock: Clock,
    calibration_in_force: CalibrationInForce,
    cameras: CameraSettingsService,
) -> CameraDocument:
    """Return the document of a camera."""
    now_ns = clock.now_ns()
    age_ms = None if camera.newest_t_ns is None else round((now_ns - camera.newest_t_ns) / 1e6, 1)
    calibration = calibration_in_force.current
    return CameraDocument(
        role=camera.role.value,
        vendor=camera.info.vendor,
        model=camera.info.model,
        serial=camera.info.serial,
        version=camera.info.version,
        connected=camera.connected,
        width=camera.width,
        height=camera.height,
        px_per_deg=None if calibration is None else round(px_per_deg(calibration, camera.role), 2),
        exposure_ms=camera.settings.exposure_ns / 1e6,
        frame_rate_hz=round(camera.frame_rate_hz, 2),
        frame_age_ms=age_ms,
        delivered=camera.counters.delivered,
        skipped=camera.counters.skipped,
        dropped=camera.counters.dropped,
        incomplete=camera.counters.incomplete,
        late=camera.counters.late,
        underrun=camera.counters.underrun,
        settings=_settings(camera, kept=cameras.has_record(camera.info.serial)),
        ranges=_ranges(camera),
        link=_link(camera, now_ns=now_ns),
    )


def divergence(cameras: CameraSettingsService, hardware: HardwareThread) -> list[DifferenceDocument]:
    """Return the settings in which the foveae differ."""
    return [
        DifferenceDocument(setting=found.setting, left=found.left, right=found.right)
        for found in cameras.divergence(hardware.status)
    ]


def _changed(
    roles: tuple[Role, ...],
    hardware: HardwareThread,
    cameras: CameraSettingsService,
    clock: Clock,
    calibration: CalibrationInForce,
) -> CamerasChangedDocument:
    status = hardware.status
    return CamerasChangedDocument(
        cameras=[
            camera_document(camera, clock, calibration, cameras)
            for camera in status.cameras
            if camera.role in roles
        ],
        divergence=divergence(cameras, hardware),
    )


def _status(role: RoleName, hardware: HardwareThread) -> CameraStatus:
    for camera in hardware.status.cameras:
        if camera.role.value == role:
            return camera
    raise refusals.not_open(hardware.status)


def _roles(role: Role, *, linked: bool) -> tuple[Role, ...]:
    if not linked:
        return (role,)
    if role not in FOVEAE:
        raise InvalidInput(
            "asked to change the wide camera linked, and only the foveae are a pair",
            asked="linked settings of the wide camera",
            found="only the foveae are a pair",
            remedy="leave linked out",
        )
    return FOVEAE


def _wait_for_pulses(roles: tuple[Role, ...], hardware: HardwareThread) -> bool:
    cameras = [camera for camera in hardware.status.cameras if camera.role in roles]
    return any(waits_for_pulses(camera.role, camera.settings) for camera in cameras)


def _change(request: CameraPatch) -> CameraChange:
    return CameraChange(
        exposure_ns=None if request.exposure_ms is None else round(request.exposure_ms * 1e6),
        exposure_auto=None if request.exposure_auto is None else AutoMode(request.exposure_auto),
        gain_db=request.gain_db,
        black_level=request.black_level,
        frame_rate_hz=request.frame_rate_hz,
        frame_rate_auto=request.frame_rate_auto,
        pixel_format=None if request.pixel_format is None else PixelFormat(request.pixel_format),
    )


def _settings(camera: CameraStatus, *, kept: bool) -> CameraSettingsDocument:
    settings = camera.settings
    return CameraSettingsDocument(
        exposure_ms=settings.exposure_ns / 1e6,
        exposure_auto=settings.exposure_auto.value,
        gain_db=round(settings.gain_db, 4),
        black_level=round(settings.black_level, 4),
        frame_rate_hz=round(settings.frame_rate_hz, 4),
        frame_rate_auto=settings.frame_rate_auto,
        pixel_format=settings.pixel_format.value,
        binning=settings.binning,
        trigger=settings.trigger_source.value if settings.triggered else "none",
        kept=kept,
    )


def _ranges(camera: CameraStatus) -> CameraRangesDocument:
    ranges = camera.ranges
    pulsed = waits_for_pulses(camera.role, camera.settings)
    modes = (AutoMode.OFF, AutoMode.ONCE) if pulsed else ranges.exposure_autos
    return CameraRangesDocument(
        exposure_ms=SpanDocument(low=ranges.exposure_ns.low / 1e6, high=ranges.exposure_ns.high / 1e6),
        exposure_auto=[mode.value for mode in modes],
        gain_db=_span(ranges.gain_db),
        black_level=_span(ranges.black_level),
        frame_rate_hz=_span(ranges.frame_rate_hz),
        frame_rate_auto=ranges.frame_rate_auto,
        pixel_formats=[known.value for known in ranges.pixel_formats],
    )


def _span(span: ValueRange) -> SpanDocument:
    return SpanDocument(low=span.low, high=span.high)


def _link(camera: CameraStatus, *, now_ns: int) -> CameraLinkDocument:
    link = camera.link
    since_s = None if link.since_ns == 0 else round(max(0, now_ns - link.since_ns) / 1e9, 1)
    return CameraLinkDocument(phase=link.phase.value, reason=link.reason, since_s=since_s, epoch=link.epoch)
