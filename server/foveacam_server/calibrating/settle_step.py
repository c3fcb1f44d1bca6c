"""The settle characterisation as a step of a session: how fast each mirror axis comes to rest."""

from functools import partial

from foveacam_hardware.contract import NotCalibrated, StationTarget
from foveacam_pipeline.calibrate.settle.settle import characterise_settling
from foveacam_pipeline.calibrate.settle.settle_report import save_settle, settle_picture
from foveacam_pipeline.calibrate.settle.settle_resonance import settle_wait_us
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.calibrating.documents import SETTLE
from foveacam_server.calibrating.options import SettleOptions
from foveacam_server.calibrating.pictures import draw
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.settle_measured import REPORT
from foveacam_server.calibrating.settle_times import SettleTime
from foveacam_server.calibrating.step_environment import StepEnvironment, StepWatcher
from foveacam_server.calibrating.turning import turn_to_station
from foveacam_server.calibrating.wide_documents import lens_of
from foveacam_server.runtime.documents import rounded
from foveacam_server.runtime.names import utc_now
from foveacam_server.runtime.store import Document


def measure_settle(
    session: CalibrationSession, options: SettleOptions, *, workplace: StepEnvironment, watch: StepWatcher
) -> SettleReport:
    """Measure all four axes where the rig's markers stand, or where the rig happens to look."""
    watch.stage("settle")
    there = [station for station in workplace.stations if station.target is StationTarget.MARKERS]
    with workplace.use("the settle characterisation") as hands:
        if there and hands.pan_tilt is not None:
            turn_to_station(
                hands.pan_tilt,
                there[0],
                clock=workplace.clock,
                watch=watch,
                head=hands.head,
                wide=_known_lens(session),
            )
        report = characterise_settling(
            hands.head,
            clock=workplace.clock,
            rig_id=workplace.rig_id,
            created_utc=utc_now(),
            watch=watch,
            before=workplace.fovea_settings,
        )
    time = SettleTime(
        rig_id=report.rig_id,
        settle_us=settle_wait_us(report, max_v=workplace.max_v),
        measured_utc=report.created_utc,
        session_id=session.id,
        low_pass_hz=report.low_pass_hz,
    )
    if options.apply:
        workplace.wait_after_moves(time)
    save_settle(report, session.folder / REPORT)
    session.write(SETTLE, settle_document(report, time))
    draw(session, {"settle": partial(settle_picture, report)})
    return report


def _known_lens(session: CalibrationSession) -> Intrinsics | None:
    try:
        return lens_of(session)
    except NotCalibrated:
        return None


def settle_document(report: SettleReport, time: SettleTime) -> Document:
    """Return what was found as REST shows it."""
    return {
        "axes": [_axis(axis) for axis in report.axes],
        "settle_us": time.settle_us,
    }


def _axis(axis: AxisSettle) -> Document:
    resonance = axis.resonance
    return {
        "eye": axis.role.value,
        "axis": axis.axis,
        "settle_ms": rounded(axis.settle_us / 1e3, 3),
        "settle_1pct_ms": rounded(axis.settle_share_us / 1e3, 3),
        "response_ms": rounded(axis.response_us / 1e3, 3),
        "response_open_ms": rounded(axis.response_open_us / 1e3, 3),
        "resonance_hz": None if resonance is None else rounded(resonance.frequency_hz, 1),
        "quality": None if resonance is None else rounded(resonance.quality, 2),
    }
