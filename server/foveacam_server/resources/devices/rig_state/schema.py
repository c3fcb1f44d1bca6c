"""Schemas of the rig's status in one document: problems, steering range, trigger, clock."""

from typing import Literal

from foveacam_hardware.contract import Binning
from foveacam_server.foundation.schema import RequestModel, ResponseModel
from foveacam_server.resources.calibrating.calibrations.schema import CalibrationDocument
from foveacam_server.resources.devices.cameras.schema import CameraDocument, DifferenceDocument
from foveacam_server.resources.devices.mirrors.schema import MirrorsDocument
from foveacam_server.rig.schema import DeviceProblemDocument


class SteeringDocument(ResponseModel):
    """The range of directions that the calibration covers."""

    ax_min_deg: float
    ax_max_deg: float
    ay_min_deg: float
    ay_max_deg: float


class TriggerDocument(ResponseModel):
    """How often both foveae can look: settle time, the slower camera, and a margin.

    `settle_source`: `rig file`, or `measured` and the date. `interval_ms`, `rate_hz`: null until the highest
    rates of both cameras are known.
    """

    settle_us: int
    settle_source: str
    interval_ms: float | None
    rate_hz: float | None


class ClockDocument(ResponseModel):
    """The rig's clock and the wall clock at one moment."""

    t_ns: int
    utc: str


class StartStepDocument(ResponseModel):
    """One step of the rig's start; `device`: `rig` (its file), `calibration`, `renderer`, or a device.

    `detail`, `remedy`: why it failed, and what to do; of one that answered later, that it did; of the active
    renderer of a simulated rig, how many kernels are compiled. `left_s`: time left; null where unknown.
    """

    device: str
    state: Literal["pending", "active", "done", "failed"]
    detail: str
    remedy: str
    left_s: float | None = None


class StartDocument(ResponseModel):
    """The steps of the rig's last start, in their order."""

    steps: list[StartStepDocument]


class BinningRequest(RequestModel):
    """Working binning of all cameras."""

    working_binning: Binning


class RigBinningDocument(ResponseModel):
    """How many pixels of the sensor, along each side, are one pixel of the cameras' pictures.

    `working_binning`: for looks, following, the loop and live views, until the rig is opened again.
    """

    working_binning: Binning
    in_force: Binning | None
    """Of the cameras now; null while none is connected, or they differ."""
    held_by: str | None
    """The session or recording for whose time the cameras have a binning of their own."""
    problem: str | None
    """Why the cameras do not have the working binning, where one of them refuses it."""
    switch_s: float | None
    """Time that the last switch of these cameras took: stop, set, start; null before the first."""


class RigDocument(ResponseModel):
    """The whole rig."""

    name: str
    rig_id: str | None
    simulated: bool
    scene: str | None
    state: str
    problems: list[DeviceProblemDocument]
    baseline_m: float | None
    steering: SteeringDocument | None
    cameras: list[CameraDocument]
    divergence: list[DifferenceDocument]
    """Settings in which the foveae differ, though one pulse exposes both."""
    mirrors: MirrorsDocument
    trigger: TriggerDocument | None
    binning: RigBinningDocument | None
    """Null until the rig is open."""
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    clock: ClockDocument
