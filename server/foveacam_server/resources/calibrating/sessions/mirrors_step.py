"""Stage 2 of a calibration session: sweep the markers at every station, or continue interrupted sweeps.

At the end some nodes of the first station are measured again, which gives the drift of the mounts. Everything
is measured at the rig's working binning: a binned fovea loses nothing, and `bench calibration` compares both.
"""

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Frame, InvalidInput, Role, Station
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose, sweep_filename
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep, read_new_poses
from foveacam_pipeline.calibrate.sweep.sweep_plan import NodeSpacing, SweepPlan
from foveacam_pipeline.calibrate.sweep.sweep_reference import has_returned, return_to_nodes
from foveacam_pipeline.calibrate.sweep.sweep_run import run_sweep
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.calibrating.sessions.descriptions import eye_state
from foveacam_server.resources.calibrating.sessions.options import MirrorsOptions
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession
from foveacam_server.resources.calibrating.sessions.step_environment import StepEnvironment, StepWatcher
from foveacam_server.rig.refusals import no_pan_tilt


def measure_mirrors(
    session: CalibrationSession,
    options: MirrorsOptions,
    wide: Intrinsics,
    *,
    environment: StepEnvironment,
    watch: StepWatcher,
    retry: bool = True,
) -> None:
    """Sweep every station of markers, or those named; then measure nodes of the farthest one again.

    Complete stations are skipped; with `retry` a station with refused eyes does not count as complete.
    """
    settings = sweep_settings(environment)
    for station in environment.sweep_stations(options.stations):
        watch.stage("mirrors")
        path = session.folder / sweep_filename(station)
        if options.restart:
            set_aside(path)
        if is_swept(path, options, station, retry=retry):
            watch.progress(1, total=1, note=f"{station.name}: complete already")
            continue
        with environment.use(f"the sweep at {station.name}", binning=None) as rig:
            if rig.pan_tilt is None:
                raise no_pan_tilt("sweep the mirrors")
            _check_lens_is_of(wide, rig.head.wide())
            run_sweep(
                rig.head,
                rig.pan_tilt,
                station,
                wide,
                plan=plan_of(options, path),
                clock=environment.clock,
                watch=PoseReporter(watch, station=station.name, path=path),
                folder=session.folder,
                settings=settings,
            )
    swept = swept_stations(session, environment)
    if not has_returned([load_sweep(session.folder / sweep_filename(station)) for station in swept]):
        measure_nodes_again(session, swept[0], wide, environment=environment, watch=watch, settings=settings)


def _check_lens_is_of(lens: Intrinsics, frame: Frame) -> None:
    """Raise InvalidInput where a lens was fitted to images of another size than the wide camera takes."""
    height, width = (frame.binning * side for side in frame.image.shape[:2])
    if (width, height) != (lens.width, lens.height):
        raise InvalidInput(
            f"the lens of this session was fitted to images of {lens.width} x {lens.height} px, the wide "
            f"camera of the rig takes {width} x {height}",
            asked="a sweep of the mirrors",
            found=f"a lens for {lens.width} x {lens.height} px",
            remedy="measure the wide camera of this rig first, or give images that it took",
        )


def is_swept(path: Path, options: MirrorsOptions, station: Station, *, retry: bool) -> bool:
    """Return whether the sweep file of this station is complete for these options."""
    if not path.exists():
        return False
    known = load_sweep(path)
    if (known.header.station, known.header.plan) != (station, plan_of(options, path)):
        return False  # `run_sweep` raises for it and names the difference
    return known.complete and not (retry and any(pose.eyes_measured < len(EYES) for pose in known.poses))


def swept_stations(session: CalibrationSession, environment: StepEnvironment) -> tuple[Station, ...]:
    """Return the marker stations with a sweep in the session, farthest first."""
    stations = environment.sweep_stations(None)
    return tuple(station for station in stations if (session.folder / sweep_filename(station)).exists())


def measure_nodes_again(
    session: CalibrationSession,
    station: Station,
    wide: Intrinsics,
    *,
    environment: StepEnvironment,
    watch: StepWatcher,
    settings: SweepSettings,
) -> tuple[SweepPose, ...]:
    """Measure some nodes of a swept station again and return their poses."""
    path = session.folder / sweep_filename(station)
    with environment.use(f"the return to {station.name}", binning=None) as rig:
        if rig.pan_tilt is None:
            raise no_pan_tilt("return to the markers")
        return return_to_nodes(
            rig.head,
            rig.pan_tilt,
            station,
            wide,
            clock=environment.clock,
            watch=PoseReporter(watch, station=station.name, path=path),
            folder=session.folder,
            settings=settings,
        )


def plan_of(options: MirrorsOptions, path: Path) -> SweepPlan:
    """Return the grid to sweep: of the options, else of the sweep file, else 9 x 9."""
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
    """Rename a sweep file so that no step reads it; its data stays on the disk."""
    if not path.exists():
        return
    number = 1
    while (aside := path.with_name(f"{path.name}.old{number}")).exists():
        number += 1
    path.rename(aside)


class PoseReporter:
    """Forwards a sweep's progress to a watcher, and reports every pose written to its file."""

    def __init__(self, watch: StepWatcher, *, station: str, path: Path) -> None:
        self._watch = watch
        self._station = station
        self._path = path
        self._reported_bytes = 0
        if path.exists():
            _, self._reported_bytes = read_new_poses(path, start_byte=0)

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Report new poses, then forward the progress."""
        self._report_poses()
        self._watch.progress(done, total=total, note=f"{self._station}: {note}" if note else self._station)

    def cancelled(self) -> bool:
        """Return whether the watcher has cancelled the sweep."""
        return self._watch.cancelled()

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Forward the picture."""
        self._watch.show(name, image)

    def _report_poses(self) -> None:
        if not self._path.exists():
            return
        poses, self._reported_bytes = read_new_poses(self._path, start_byte=self._reported_bytes)
        for pose in poses:
            if pose.repeat == 0:
                self._watch.pose(
                    self._station,
                    index=pose.index,
                    left=eye_state(pose, Role.LEFT),
                    right=eye_state(pose, Role.RIGHT),
                )


def sweep_settings(environment: StepEnvironment) -> SweepSettings:
    """Return a sweep's settings for this rig, with the present time as name of the run."""
    now_utc = utc_now()
    return SweepSettings(
        rig_id=environment.rig_id,
        created_utc=now_utc,
        run=now_utc,
        wide_serial=environment.serials.get(Role.WIDE, ""),
        left_serial=environment.serials.get(Role.LEFT, ""),
        right_serial=environment.serials.get(Role.RIGHT, ""),
        baseline_m=environment.baseline_m,
        max_v=environment.max_v,
        layout=MarkerLayout(**asdict(environment.markers)),
    )


def _rad(given_deg: float | None, default_rad: float) -> float:
    return default_rad if given_deg is None else math.radians(given_deg)
