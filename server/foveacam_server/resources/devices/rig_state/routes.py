"""Route of the whole rig's status in one document."""

import math
from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_hardware.contract import Role, TriggerBudget, trigger_budget
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import opened_services
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.calibrations.schema import CalibrationDocument
from foveacam_server.resources.devices.cameras.routes import CameraStateServices, camera_document, divergence
from foveacam_server.resources.devices.mirrors.routes import MirrorStateServices, mirrors_document
from foveacam_server.resources.devices.rig_state.binning_routes import binning_document
from foveacam_server.resources.devices.rig_state.schema import (
    ClockDocument,
    RigDocument,
    StartDocument,
    SteeringDocument,
    TriggerDocument,
)
from foveacam_server.resources.devices.rig_state.start_steps import start_document
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.status import CameraStatus

router = GuardedRouter(tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class SteeringCalibration(CalibrationInForce, Protocol):
    """The calibration in force with the field that both eyes can be steered over."""

    @property
    def reach_rad(self) -> tuple[float, float, float, float] | None:
        """Least and greatest ax, then ay, rad; None without a calibration."""
        ...


class CalibrationDescriber(Protocol):
    """Describes calibrations as REST shows them."""

    def describe(self, calibration: Calibration) -> CalibrationDocument:
        """Return one calibration as REST shows it."""
        ...


class SettleTimeSource(Protocol):
    """Knows the source of the settle time in use."""

    @property
    def source(self) -> str:
        """`rig file`, or `measured` and the date."""
        ...


class RigRouteServices(CameraStateServices, MirrorStateServices, Protocol):
    """Services that these routes use."""

    @property
    def calibration(self) -> SteeringCalibration:
        """Calibration in force."""
        ...

    @property
    def records(self) -> CalibrationDescriber:
        """Describes the calibration in force."""
        ...

    @property
    def settling(self) -> SettleTimeSource:
        """Settle time in use."""
        ...


ServicesDep = Annotated[RigRouteServices, Depends(opened_services)]


@router.get("/rig", summary="The rig as last seen")
async def rig(services: ServicesDep) -> RigDocument:
    """Return the rig's state, its problems, its devices and its calibration."""
    status = services.hardware.status
    calibration = services.calibration.current
    return RigDocument(
        name=status.name,
        rig_id=status.rig_id,
        simulated=status.simulated,
        scene=status.scene,
        state=status.state.value,
        problems=list(status.problems),
        baseline_m=status.baseline_m,
        steering=_steering(services),
        cameras=[camera_document(camera, services) for camera in status.cameras],
        divergence=divergence(services),
        mirrors=mirrors_document(services),
        trigger=_trigger(services),
        binning=binning_document(services.hardware),
        calibration=None if calibration is None else services.records.describe(calibration),
        calibration_problem=services.calibration.problem,
        clock=ClockDocument(t_ns=services.clock.now_ns(), utc=utc_now()),
    )


@router.get("/rig/start", summary="The rig's start, step by step")
async def start(services: ServicesDep) -> StartDocument:
    """Return each step of the rig's last start: pending, active, done, or failed and why."""
    return start_document(services)


def _steering(services: RigRouteServices) -> SteeringDocument | None:
    reach_rad = services.calibration.reach_rad
    if reach_rad is None:
        return None
    ax_min, ax_max, ay_min, ay_max = (round(math.degrees(angle_rad), 3) for angle_rad in reach_rad)
    return SteeringDocument(ax_min_deg=ax_min, ax_max_deg=ax_max, ay_min_deg=ay_min, ay_max_deg=ay_max)


def _trigger(services: RigRouteServices) -> TriggerDocument | None:
    status = services.hardware.status
    if status.settle_us is None:
        return None
    budget = _budget({camera.role: camera for camera in status.cameras}, settle_us=status.settle_us)
    return TriggerDocument(
        settle_us=status.settle_us,
        settle_source=services.settling.source,
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
