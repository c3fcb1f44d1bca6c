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
    """Highest rate of looks of both foveae: settle time, period of the slower camera, and a margin.

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

    `detail`, `remedy`: why it failed, and what to do; for a device that connected later, that it did; for the
    active renderer of a simulated rig, how many kernels are compiled. `left_s`: time left; null where
    unknown.
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
    """Binning of the cameras: sensor pixels along each side of a picture's pixel.

    `working_binning`: of looks, following, the loop and live views, until the rig is opened again.
    """

    working_binning: Binning
    in_force: Binning | None
    """Binning of the cameras now; null while none is connected, or they differ."""
    held_by: str | None
    """The session or recording that has changed the cameras' binning until its end."""
    problem: str | None
    """Why the cameras do not have the working binning, where one of them refuses it."""
    switch_s: float | None
    """Duration of the last switch of these cameras (stop, set, start); null before the first."""


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
    """Settings in which the foveae differ, although one pulse exposes both."""
    mirrors: MirrorsDocument
    trigger: TriggerDocument | None
    binning: RigBinningDocument | None
    """Null until the rig is open."""
    calibration: CalibrationDocument | None
    calibration_problem: str | None
    clock: ClockDocument
