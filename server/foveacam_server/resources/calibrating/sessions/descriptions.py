"""Describes a calibration session and its mirror sweeps for REST and reports, from the session's folder."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import TypeVar

from foveacam_hardware.contract import FoveaError, NotCalibrated, Role
from foveacam_pipeline.calibrate.records.aggregate import sweep_paths
from foveacam_pipeline.calibrate.settle.settle_report import load_settle
from foveacam_pipeline.calibrate.settle.settle_values import SettleReport
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_server.resources.calibrating.sessions.lens_stage import EYES, describe_lens
from foveacam_server.resources.calibrating.sessions.pictures import describe_pictures, picture_bytes
from foveacam_server.resources.calibrating.sessions.schema import (
    EyeState,
    SessionDocument,
    SettleDocument,
    SweepDocument,
    SweepPoseDocument,
)
from foveacam_server.resources.calibrating.sessions.sessions import (
    CHECK,
    DRIFT,
    FIT,
    SETTLE,
    SETTLE_REPORT,
    CalibrationSession,
    SessionCollection,
)
from foveacam_server.resources.calibrating.sessions.wide_stage import describe_wide
from foveacam_server.rig.settle_times import SettleTime

_Part = TypeVar("_Part")


def describe_session(
    session: CalibrationSession,
    *,
    url: str,
    running: str | None,
    in_use: SettleTime | None = None,
) -> SessionDocument:
    """Return a session's document; a part that cannot be read is null and listed in `problems`.

    `in_use`: the measured settle time in use, of any session.
    """
    head = session.head
    problems: list[str] = []

    def part(read: Callable[[], _Part | None]) -> _Part | None:
        try:
            return read()
        except FoveaError as error:
            problems.append(str(error))
            return None

    board, wide = part(lambda: describe_wide(session, url=url)) or (None, None)
    lenses = [part(partial(describe_lens, session, role, url=url)) for role in EYES]
    sweeps = [part(partial(describe_sweep, path)) for path in sweep_paths(session.folder)]
    return SessionDocument(
        id=session.id,
        label=head.label,
        rig_id=head.rig_id,
        created_utc=head.created_utc,
        bytes=session.bytes,
        board=board,
        wide=wide,
        lenses=[lens for lens in lenses if lens is not None],
        sweeps=[sweep for sweep in sweeps if sweep is not None],
        fit=part(lambda: session.read(FIT)),
        closing=part(lambda: session.read(DRIFT)),
        settle=part(lambda: _settle(session, in_use)),
        check=part(lambda: session.read(CHECK)),
        pictures=describe_pictures(session, url=url),
        calibrations=list(head.calibrations),
        running=running,
        problems=problems,
    )


class SessionReader:
    """Reads the data of sessions, by their ids, for reports and exports of calibrations."""

    def __init__(self, sessions: SessionCollection) -> None:
        self._sessions = sessions

    def sweeps(self, session_id: str) -> tuple[Path, ...]:
        """Return the files of a session's mirror sweeps or raise `NotFound`."""
        return sweep_paths(self._sessions.get(session_id).folder)

    def describe(self, session_id: str) -> SessionDocument:
        """Return a session's measurements for a report or raise `NotFound`."""
        return describe_session(self._sessions.get(session_id), url="", running=None)

    def pictures(self, session_id: str, *, fitted: bool) -> dict[str, bytes]:
        """Return a session's pictures as PNGs by name or raise `NotFound`."""
        return picture_bytes(self._sessions.get(session_id), fitted=fitted)


def _settle(session: CalibrationSession, in_use: SettleTime | None) -> SettleDocument | None:
    found = session.read(SETTLE)
    if found is None:
        return None
    mine = (session.id, found.settle_us)
    applied = in_use is not None and (in_use.session_id, in_use.settle_us) == mine
    return found.model_copy(update={"applied": applied})


def describe_sweep(path: Path) -> SweepDocument:
    """Return the document of a sweep; raise `InvalidInput` for a damaged file."""
    state = path.stat()
    return _describe_file(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=64)
def _describe_file(path: Path, changed_ns: int, size: int) -> SweepDocument:
    """Return the sweep of a file, cached by the file's state, as the page polls every second."""
    del changed_ns, size
    sweep = load_sweep(path)
    station, nodes_rad = sweep.header.station, sweep.header.plan.nodes_rad().tolist()
    visited = {pose.index: pose for pose in sweep.poses}
    return SweepDocument(
        station=station.name,
        distance_m=station.distance_m,
        nodes=len(nodes_rad),
        done=len(sweep.poses),
        poses=[_describe_pose(index, node, visited.get(index)) for index, node in enumerate(nodes_rad)],
    )


def _describe_pose(index: int, node_rad: tuple[float, float], pose: SweepPose | None) -> SweepPoseDocument:
    ax_rad, ay_rad = node_rad
    return SweepPoseDocument(
        index=index,
        ax_deg=round(math.degrees(ax_rad), 4),
        ay_deg=round(math.degrees(ay_rad), 4),
        left=eye_state(pose, Role.LEFT),
        right=eye_state(pose, Role.RIGHT),
        left_reason=None if pose is None else pose.refusal(Role.LEFT),
        right_reason=None if pose is None else pose.refusal(Role.RIGHT),
    )


def eye_state(pose: SweepPose | None, role: Role) -> EyeState:
    """Return the state of one eye at a pose; None before it was measured."""
    if pose is None:
        return "waiting"
    measured = pose.eye(role)
    if measured is None:
        return "refused"
    return "rim" if measured.rim else "centred"


def measured_time(session: CalibrationSession) -> SettleTime:
    """Return the settle time that a session measured; raise `NotCalibrated` before it has."""
    found = session.read(SETTLE)
    if found is None or found.settle_us is None:
        raise NotCalibrated(
            f"session {session.id} has not measured how the mirrors settle",
            asked="the measured settle time in use",
            found="no settle time was measured",
            remedy="run the step settle first",
        )
    report = load_settle(session.folder / SETTLE_REPORT)
    return settle_time_of(report, found.settle_us, session_id=session.id)


def settle_time_of(report: SettleReport, settle_us: int, *, session_id: str) -> SettleTime:
    """Return the settle time of a settle report."""
    return SettleTime(
        rig_id=report.rig_id,
        settle_us=settle_us,
        measured_utc=report.created_utc,
        session_id=session_id,
        low_pass_hz=report.low_pass_hz,
    )
