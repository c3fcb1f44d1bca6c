"""Run calibration steps for the command line: choose the session, open the rig, print the session."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.calibrate.wide.wide_images import LeftOutImage
from foveacam_server.commands.calibration_data import DataDirectory, open_data
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.rig import RigChoice, open_enabled_rig
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.progress_bar import progress_bar
from foveacam_server.resources.calibrating.drift_checks.records import DriftRecords
from foveacam_server.resources.calibrating.drift_checks.step import check_drift, store_check
from foveacam_server.resources.calibrating.sessions.descriptions import describe_session
from foveacam_server.resources.calibrating.sessions.options import FitOptions, LensOptions, Run, WideOptions
from foveacam_server.resources.calibrating.sessions.schema import (
    LensDocument,
    SessionDocument,
    SettleAxisDocument,
)
from foveacam_server.resources.calibrating.sessions.sessions import CalibrationSession
from foveacam_server.resources.calibrating.sessions.step_environment import (
    StepEnvironment,
    environment_of,
)
from foveacam_server.resources.calibrating.sessions.steps import measure_on_images, run_fit, run_step
from foveacam_server.resources.calibrating.sessions.wide_step import ImageFolder
from foveacam_server.rig.settle_times import SettleTimes

_INTERRUPTED = 130


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionChoice:
    """The session of a step: the given one, else a new one (`begin`) or the newest of the rig."""

    session: str | None
    label: str | None = None
    begin: bool = False


def run_in_session(
    rig_options: RigOptions, run: Run, chosen: SessionChoice, *, activate: bool = False
) -> None:
    """Run a step with a rig and print the session; `activate`: put the fitted calibration in force."""
    choice, console = RigChoice.of(rig_options), Console(stderr=True)
    with open_data(choice, lock=True) as data:
        known = None if chosen.begin and chosen.session is None else find_session(data, chosen.session)
        with (
            open_environment(choice, data.settle_times, console=console) as environment,
            session_for_step(known, data, chosen, console=console) as session,
            progress_bar(console, silent=rig_options.as_json) as bar,
        ):
            run_step(session, run, environment=environment, registry=data.calibration, watch=bar)
            bar.finish()
        if activate and bar.fitted_ids:
            data.calibration.activate(bar.fitted_ids[-1])
        print_session(session, data, fitted=bar.fitted_ids, as_json=rig_options.as_json)


def run_fit_in_session(
    rig_options: RigOptions, options: FitOptions, chosen: SessionChoice, *, activate: bool
) -> None:
    """Fit a session's sweeps without a rig and print the session; beside a server unless `activate`."""
    choice = RigChoice.of(rig_options)
    with open_data(choice, lock=activate) as data:
        session = find_session(data, chosen.session)
        with progress_bar(Console(stderr=True), silent=rig_options.as_json) as bar:
            run_fit(session, options, registry=data.calibration, watch=bar)
            bar.finish()
        if activate:
            data.calibration.activate(bar.fitted_ids[-1])
        print_session(session, data, fitted=bar.fitted_ids, as_json=rig_options.as_json)


def run_on_images(
    rig_options: RigOptions,
    images: Path,
    options: WideOptions | LensOptions,
    chosen: SessionChoice,
    *,
    pattern: str,
) -> None:
    """Measure the lens of a camera from image files and print the session; runs beside a server.

    Files that are left out are listed on stderr, each with the reason.
    """
    console = Console(stderr=True)
    if not images.is_dir():
        raise InvalidInput(f"--images {images}: there is no such folder; give a folder of images")
    folder = ImageFolder(folder=images, pattern=pattern, left_out=partial(_print_left_out, console))
    with open_data(RigChoice.of(rig_options), lock=False) as data:
        known = None if chosen.session is None else find_session(data, chosen.session)
        with (
            session_for_step(known, data, chosen, console=console) as session,
            progress_bar(console, silent=rig_options.as_json) as bar,
        ):
            measure_on_images(session, folder, options, watch=bar)
            bar.finish()
        print_session(session, data, fitted=bar.fitted_ids, as_json=rig_options.as_json)


def _print_left_out(console: Console, images: Sequence[LeftOutImage]) -> None:
    if images:
        console.print(f"Left out: {len(images)} of the images", highlight=False)
    for image in images:
        console.print(f"  {image.name}: {image.reason}", markup=False, highlight=False)


def run_drift(rig_options: RigOptions, *, distance_m: float | None, apply: bool) -> None:
    """Check the drift of the calibration in force and print the result."""
    choice, console = RigChoice.of(rig_options), Console(stderr=True)
    with open_data(choice, lock=True) as data:
        calibration = data.calibration.require()
        with (
            open_environment(choice, data.settle_times, console=console) as environment,
            environment.use("the drift check") as rig,
            progress_bar(console, silent=rig_options.as_json) as bar,
        ):
            found = check_drift(
                rig.head, calibration, distance_m=distance_m, clock=environment.clock, watch=bar
            )
            bar.finish()
        stored = store_check(
            found,
            calibration,
            apply=apply,
            records=DriftRecords(data.drift_folder),
            registry=data.calibration,
            watch=bar,
        )
    if rig_options.as_json:
        typer.echo(json.dumps(stored.as_json(), allow_nan=False))
        return
    Console().print(stored.detail, markup=False)
    if stored.applied:
        Console().print(f"Calibration {stored.new_calibration_id} is in force.", markup=False)


@contextmanager
def session_for_step(
    known: CalibrationSession | None, data: DataDirectory, chosen: SessionChoice, *, console: Console
) -> Iterator[CalibrationSession]:
    """Yield the given session or a new one; after Ctrl-C print how to continue.

    A new session that is still empty when its step fails is deleted.
    """
    name = chosen.label or f"calibration of {data.rig_id}"
    session = known or data.sessions.create(label=name, rig_id=data.rig_id, baseline_m=data.baseline_m)
    try:
        yield session
    except KeyboardInterrupt:
        console.print(f"Interrupted; what was measured is kept: go on with --session {session.id}")
        raise typer.Exit(_INTERRUPTED) from None
    except FoveaError:
        if known is None and session.empty:
            data.sessions.remove(session.id)
        raise


def find_session(data: DataDirectory, wanted: str | None) -> CalibrationSession:
    """Return the given session, or the newest of this rig."""
    if wanted is None:
        for session in data.sessions.every():
            if session.head.rig_id == data.rig_id:
                return session
        raise NotFound(
            f"rig {data.rig_id} has no calibration session yet; begin one with `foveacam calibrate wide`"
        )
    session = data.sessions.get(wanted)
    if session.head.rig_id != data.rig_id:
        raise InvalidInput(
            f"session {wanted} belongs to rig {session.head.rig_id!r}, this rig is {data.rig_id!r}; "
            "name a session of this rig"
        )
    return session


def print_session(
    session: CalibrationSession, data: DataDirectory, *, fitted: Sequence[str], as_json: bool
) -> None:
    """Print a session as a table or as JSON; `fitted`: the calibrations of this command."""
    found = describe_session(session, url="", running=None, in_use=data.settle_times.of(data.rig_id))
    current = data.calibration.current
    in_force = None if current is None else current.id
    if as_json:
        typer.echo(json.dumps(found.as_json() | {"in_force": in_force}, allow_nan=False))
        return
    Console().print(session_table(found, fitted=fitted or found.calibrations, in_force=in_force))


def session_table(found: SessionDocument, *, fitted: Sequence[str], in_force: str | None) -> Table:
    """Return a session as a table."""
    table = Table(title=f"session {found.id}: {found.label}".replace("[", "\\["), show_header=False)
    table.add_column("part")
    table.add_column("found", overflow="fold")
    for part, words in (*_measured_rows(found), *_drift_rows(found), *_tested_rows(found)):
        table.add_row(part, words)
    if fitted:
        use = f"put it in force with `foveacam calibrate use {fitted[-1]}`"
        table.add_row("calibration", f"{fitted[-1]}, {'in force' if in_force == fitted[-1] else use}")
    return table


def _measured_rows(found: SessionDocument) -> Iterator[tuple[str, str]]:
    """Yield rows on the wide camera, the sweeps and the fitted mirrors."""
    if found.wide is not None and found.wide.fit is not None:
        fit = found.wide.fit
        yield (
            "wide camera",
            f"{len(found.wide.samples)} views, {fit.model}: {fit.rms_px:.3f} px rms, "
            f"{fit.fov_x_deg:.2f}° x {fit.fov_y_deg:.2f}°",
        )
    for lens in found.lenses:
        yield f"lens of the {lens.camera} fovea", _lens_words(lens)
    for sweep in found.sweeps:
        yield f"sweep at {sweep.station}", f"{sweep.done} of {sweep.nodes} poses"
    for model in found.fit.models if found.fit is not None else ():
        if model.chosen:
            across, down = model.loo_deg
            yield f"{model.eye} mirror", f"{model.name}: left out {across:.4f}°, {down:.4f}°"


def _lens_words(found: LensDocument) -> str:
    if found.fit is None:
        return f"{len(found.samples)} views: {found.reason}"
    focal = found.fit.parameters[0]
    return (
        f"{len(found.samples)} views: {focal.value:.0f} ± {focal.sigma:.0f} px, "
        f"{found.fit.rms_px:.3f} px rms, {found.fit.fov_x_deg:.3f}° x {found.fit.fov_y_deg:.3f}°; "
        f"{found.reason}"
    )


def _drift_rows(found: SessionDocument) -> Iterator[tuple[str, str]]:
    """Yield rows on the drift of the mounts during the sweeps, and since."""
    drifts = found.fit.drift if found.fit is not None else None
    for eye, drift in (drifts or {}).items():
        moved = f"{drift.moved_px:.2f} ± {drift.sigma_px:.2f} px in {drift.minutes:.1f} min"
        yield f"{eye} mount", f"drifted by {drift.px_per_minute:.2f} px a minute, {moved}: corrected"
        for jump_px in drift.knocks_px:
            yield f"{eye} mount", f"knocked during the sweeps, its gaze jumped by {jump_px:.1f} px: corrected"
    if found.closing is not None:
        done = "corrected" if found.closing.corrected else "within its own error"
        yield "drift since the sweep", f"rows {found.closing.rows_px:.2f} px apart: {done}"


def _tested_rows(found: SessionDocument) -> Iterator[tuple[str, str]]:
    """Yield rows on the check and on how the mirrors settle."""
    if found.check is not None:
        check, made = found.check, found.calibrations
        outdated = bool(made) and check.calibration_id != made[-1]
        yield (
            "check",
            f"rows {check.epipolar_rms_px} px rms, {check.epipolar_p95_px} px (95 %), pointing "
            f"{check.pointing_rms_px} px rms at {check.poses} places"
            + (", of the calibration before: check again" if outdated else ""),
        )
    if found.settle is None:
        return
    for axis in found.settle.axes:
        yield f"{axis.eye} {axis.axis}", _settle_words(axis)
    if found.settle.settle_us is not None:
        remedy = "put it in use with `foveacam calibrate settle-time --apply`"
        in_use = "in use" if found.settle.applied else remedy
        yield "largest move", f"over after {found.settle.settle_us / 1e3:g} ms, {in_use}"


def _settle_words(axis: SettleAxisDocument) -> str:
    words = f"1 px after {axis.settle_ms} ms, 1 % after {axis.settle_1pct_ms} ms"
    if axis.resonance_hz is None:
        return words
    return f"{words}, resonance {axis.resonance_hz:g} Hz, Q {axis.quality:g}"


@contextmanager
def open_environment(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[StepEnvironment]:
    """Open the rig for calibration steps and park it at the end."""
    with open_enabled_rig(choice, times, console=console) as rig:
        yield environment_of(rig, times)
