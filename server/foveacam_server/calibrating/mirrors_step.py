"""Stage 2 as a step of a session: sweeps the markers at every station wanted, or goes on where it ended.

At the end it returns to some nodes of the first station, to see how far the mounts have drifted meanwhile.
"""

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Station
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import NodeSpacing, SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_reference import has_returned, return_to_nodes
from foveacam_pipeline.calibrate.sweep.sweep_run import run_sweep
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.calibrating.options import MirrorsOptions
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.step_environment import StepEnvironment, StepWatcher, no_pan_tilt
from foveacam_server.runtime.names import utc_now


def measure_mirrors(
    session: CalibrationSession,
    options: MirrorsOptions,
    wide: Intrinsics,
    *,
    workplace: StepEnvironment,
    watch: StepWatcher,
    retry: bool = True,
) -> None:
    """Sweep every station of markers, or those named; then return to nodes of the farthest one swept.

    A station that is complete is left alone; `retry`: it is so when no eye was refused anywhere.
    """
    settings = sweep_settings(workplace)
    for station in workplace.sweep_stations(options.stations):
        watch.stage("mirrors")
        path = session.folder / sweep_filename(station)
        if options.restart:
            set_aside(path)
        if is_swept(path, options, station, retry=retry):
            watch.progress(1, total=1, note=f"{station.name}: complete already")
            continue
        with workplace.use(f"the sweep at {station.name}") as hands:
            if hands.pan_tilt is None:
                raise no_pan_tilt("sweep the mirrors")
            run_sweep(
                hands.head,
                hands.pan_tilt,
                station,
                wide,
                plan=planned(options, path),
                clock=workplace.clock,
                watch=PoseReporter(watch, station=station.name, path=path),
                folder=session.folder,
                settings=settings,
            )
    swept = swept_stations(session, workplace)
    if not has_returned([load_sweep(session.folder / sweep_filename(station)) for station in swept]):
        revisit(session, swept[0], wide, workplace=workplace, watch=watch, settings=settings)


def is_swept(path: Path, options: MirrorsOptions, station: Station, *, retry: bool) -> bool:
    """Tell whether a sweep of this station, as it is wanted, has nothing left to measure."""
    if not path.exists():
        return False
    known = load_sweep(path)
    if (known.header.station, known.header.plan) != (station, planned(options, path)):
        return False  # going on with it says what differs
    return known.complete and not (retry and any(pose.eyes_measured < len(EYES) for pose in known.poses))


def swept_stations(session: CalibrationSession, workplace: StepEnvironment) -> tuple[Station, ...]:
    """Return the stations of markers at which a session holds a sweep, the farthest first."""
    stations = workplace.sweep_stations(None)
    return tuple(station for station in stations if (session.folder / sweep_filename(station)).exists())


def revisit(
    session: CalibrationSession,
    station: Station,
    wide: Intrinsics,
    *,
    workplace: StepEnvironment,
    watch: StepWatcher,
    settings: SweepSettings,
) -> tuple[SweepPose, ...]:
    """Return to some nodes of a station that was swept, and return what was seen there."""
    path = session.folder / sweep_filename(station)
    with workplace.use(f"the return to {station.name}") as hands:
        if hands.pan_tilt is None:
            raise no_pan_tilt("return to the markers")
        return return_to_nodes(
            hands.head,
            hands.pan_tilt,
            station,
            wide,
            clock=workplace.clock,
            watch=PoseReporter(watch, station=station.name, path=path),
            folder=session.folder,
            settings=settings,
        )


def planned(options: MirrorsOptions, path: Path) -> SweepPlan:
    """Return the grid to sweep: what the options say; else that of the sweep on file; else 9 x 9."""
    known = load_sweep(path).header.plan if path.exists() else SweepPlan()
    columns, rows = options.nodes or (known.columns, known.rows)
    return SweepPlan(
        columns=columns,
        rows=rows,
        half_width_rad=_rad(options.extent_ax_deg, known.half_width_rad),
        half_height_rad=_rad(options.extent_ay_deg, known.half_height_rad),
        spacing=known.spacing if options.spacing is None else NodeSpacing(options.spacing),
    )


def set_aside(path: Path) -> None:
    """Give the file of a sweep another name, under which nothing looks for it; nothing is lost."""
    if not path.exists():
        return
    number = 1
    while (aside := path.with_name(f"{path.name}.old{number}")).exists():
        number += 1
    path.rename(aside)


class PoseReporter:
    """Passes everything on to a watcher, and tells of every pose that has come to the sweep's file."""

    def __init__(self, watch: StepWatcher, *, station: str, path: Path) -> None:
        self._watch = watch
        self._station = station
        self._path = path
        self._told_bytes = path.stat().st_size if path.exists() else 0

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Pass it on, after the poses."""
        self._tell_poses()
        self._watch.progress(done, total=total, note=f"{self._station}: {note}" if note else self._station)

    def cancelled(self) -> bool:
        """Ask the watcher."""
        return self._watch.cancelled()

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Pass it on."""
        self._watch.show(name, image)

    def _tell_poses(self) -> None:
        if not self._path.exists():
            return
        with self._path.open("rb") as stream:
            stream.seek(self._told_bytes)
            fresh = stream.read()
        whole = fresh.rfind(b"\n") + 1
        self._told_bytes += whole
        for line in fresh[:whole].splitlines():
            pose = json.loads(line)
            if "index" in pose and not pose.get("repeat"):  # the first line is the header
                self._watch.pose(
                    self._station,
                    index=pose["index"],
                    left=_state(pose[Role.LEFT.value]),
                    right=_state(pose[Role.RIGHT.value]),
                )


def _state(eye: "dict[str, object] | None") -> str:
    if eye is None:
        return "refused"
    return "rim" if eye["rim"] else "centred"


def sweep_settings(workplace: StepEnvironment) -> SweepSettings:
    """Return what a sweep must be told of this rig, with a name of its own for this run."""
    now_utc = utc_now()
    return SweepSettings(
        rig_id=workplace.rig_id,
        created_utc=now_utc,
        run=now_utc,
        wide_serial=workplace.serials.get(Role.WIDE, ""),
        left_serial=workplace.serials.get(Role.LEFT, ""),
        right_serial=workplace.serials.get(Role.RIGHT, ""),
        baseline_m=workplace.baseline_m,
        max_v=workplace.max_v,
        layout=MarkerLayout(**asdict(workplace.markers)),
    )


def _rad(given_deg: float | None, usual_rad: float) -> float:
    return usual_rad if given_deg is None else math.radians(given_deg)
