"""Route of the whole rig's status in one document."""

import math
from typing import Protocol

from foveacam_hardware.contract import Clock, Role, TriggerBudget, trigger_budget
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.calibrations.schema import CalibrationDocument
from foveacam_server.resources.devices.cameras.routes import camera_document, divergence
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.mirrors.routes import mirrors_document
from foveacam_server.resources.devices.rig_state.binning_routes import binning_document
from foveacam_server.resources.devices.rig_state.schema import (
    ClockDocument,
    RigDocument,
    StartDocument,
    SteeringDocument,
    TriggerDocument,
)
from foveacam_server.resources.devices.rig_state.start_steps import start_document
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.status import CameraStatus

router = GuardedRouter(tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class SteeringCalibration(CalibrationInForce, Protocol):
    """The calibration in force, with the field over which both eyes can be steered."""

    @property
    def reach_rad(self) -> tuple[float, float, float, float] | None:
        """Least and greatest ax, then least and greatest ay, rad; None without a calibration."""
        ...


class CalibrationDescriber(Protocol):
    """Provides the documents of calibrations."""

    def describe(self, calibration: Calibration) -> CalibrationDocument:
        """Return the document of a calibration."""
        ...


class SettleTimeSource(Protocol):
    """Knows the source of the settle time in use."""

    @property
    def source(self) -> str:
        """`rig file`, or `measured` and the date."""
        ...


@router.get("/rig", summary="Last status of the rig")
async def rig(
    hardware: Provided[HardwareThread],
    steering_calibration: Provided[SteeringCalibration],
    records: Provided[CalibrationDescriber],
    clock: Provided[Clock],
    cameras: Provided[CameraSettingsService],
    settling: Provided[SettleTimeSource],
) -> RigDocument:
    """Return the rig's state, its problems, its devices and its calibration."""
    status = hardware.status
    calibration = steering_calibration.current
    return RigDocument(
        name=status.name,
        rig_id=status.rig_id,
        simulated=status.simulated,
        scene=status.scene,
        state=status.state.value,
        problems=list(status.problems),
        baseline_m=status.baseline_m,
        steering=_steering(steering_calibration),
        cameras=[camera_document(camera, clock, steering_calibration, cameras) for camera in status.cameras],
        divergence=divergence(cameras, hardware),
        mirrors=mirrors_document(hardware, steering_calibration),
        trigger=_trigger(hardware, settling),
        binning=binning_document(hardware),
        calibration=None if calibration is None else records.describe(calibration),
        calibration_problem=steering_calibration.problem,
        clock=ClockDocument(t_ns=clock.now_ns(), utc=utc_now()),
    )


@router.get("/rig/start", summary="The rig's start, step by step")
async def start(
    hardware: Provided[HardwareThread], calibration: Provided[SteeringCalibration]
) -> StartDocument:
    """Return each step of the rig's last start: pending, active, done, or failed and why."""
    return start_document(hardware, calibration)


def _steering(calibration: SteeringCalibration) -> SteeringDocument | None:
    reach_rad = calibration.reach_rad
    if reach_rad is None:
        return None
    ax_min, ax_max, ay_min, ay_max = (round(math.degrees(angle_rad), 3) for angle_rad in reach_rad)
    return SteeringDocument(ax_min_deg=ax_min, ax_max_deg=ax_max, ay_min_deg=ay_min, ay_max_deg=ay_max)


def _trigger(hardware: HardwareThread, settling: SettleTimeSource) -> TriggerDocument | None:
    status = hardware.status
    if status.settle_us is None:
        return None
    budget = _budget({camera.role: camera for camera in status.cameras}, settle_us=status.settle_us)
    return TriggerDocument(
        settle_us=status.settle_us,
        settle_source=settling.source,
        interval_ms=None if budget is None else round(budget.interval_ms, 3),
        rate_hz=None if budget is None else round(budget.rate_hz, 2),
    )


def _budget(cameras: dict[Role, CameraStatus], *, settle_us: int) -> TriggerBudget | None:
    left, right = cameras[Role.LEFT], cameras[Role.RIGHT]
    if min(left.most_rate_hz, right.most_rate_hz, left.settings.exposure_ns, right.settings.exposure_ns) <= 0:
        return None
    return trigger_budget(
        (left.settings.exposure_ns / 1e3, right.settings.exposure_ns / 1e3),
        (left.most_rate_hz, right.most_rate_hz),
        settle_us=settle_us,
    )
