"""Runs the steps of a calibration for the command line: a session, a rig, a bar, and what came of it."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import typer
from pydantic import BaseModel
from rich.console import Console
from rich.table import Table

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.calibrate_command.rig import (
    CalibrationProgressBar,
    LockedDataDirectory,
    RigChoice,
    opened_shop,
    opened_workplace,
    watching,
)
from foveacam_server.calibrating.documents import session_document
from foveacam_server.calibrating.drift_records import DriftRecords
from foveacam_server.calibrating.drift_step import check_drift, keep_check
from foveacam_server.calibrating.options import FitOptions, WideOptions
from foveacam_server.calibrating.sessions import CalibrationSession
from foveacam_server.calibrating.steps import ImageFolder, measure_on_images, run_fit, run_step
from foveacam_server.errors import NotFound
from foveacam_server.runtime.store import Document

_INTERRUPTED = 130


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionChoice:
    """In which session a step shall work: the one named, else a new one (`begin`) or the newest."""

    session: str | None
    label: str | None = None
    begin: bool = False


def run_in_session(
    wish: CalibrateOptions, run: BaseModel, place: SessionChoice, *, activate: bool = False
) -> None:
    """Run a step and print the session; `activate`: put in force what it fits."""
    choice, console = RigChoice.of(wish), Console(stderr=True)
    with opened_shop(choice) as shop:
        known = None if place.begin and place.session is None else found_session(shop, place.session)
        with (
            opened_workplace(choice, shop.settle_times, console=console) as workplace,
            worked_in(known, shop, place, console=console) as session,
            watching(console, silent=wish.as_json) as watch,
        ):
            run_step(session, run, workplace=workplace, registry=shop.calibration, watch=watch)
        if activate and watch.fitted_ids:
            shop.calibration.activate(watch.fitted_ids[-1])
        print_session(session, shop, watch, as_json=wish.as_json)


def run_fit_in_session(
    wish: CalibrateOptions, options: FitOptions, place: SessionChoice, *, activate: bool
) -> None:
    """Fit what a session measured, without a rig, and print the session."""
    with opened_shop(RigChoice.of(wish)) as shop:
        session = found_session(shop, place.session)
        with watching(Console(stderr=True), silent=wish.as_json) as watch:
            run_fit(session, options, registry=shop.calibration, watch=watch)
        if activate:
            shop.calibration.activate(watch.fitted_ids[-1])
        print_session(session, shop, watch, as_json=wish.as_json)


def run_on_images(
    wish: CalibrateOptions, images: ImageFolder, options: WideOptions, place: SessionChoice
) -> None:
    """Measure the wide camera from a folder of images and print the session."""
    console = Console(stderr=True)
    if not images.folder.is_dir():
        raise InvalidInput(f"--images {images.folder}: there is no such folder; give a folder of images")
    with opened_shop(RigChoice.of(wish)) as shop:
        known = None if place.session is None else found_session(shop, place.session)
        with (
            worked_in(known, shop, place, console=console) as session,
            watching(console, silent=wish.as_json) as watch,
        ):
            measure_on_images(session, images, options, watch=watch)
        print_session(session, shop, watch, as_json=wish.as_json)


def run_drift(wish: CalibrateOptions, *, distance_m: float | None, apply: bool) -> None:
    """Check the drift of the calibration in force and print what was found."""
    choice, console = RigChoice.of(wish), Console(stderr=True)
    with opened_shop(choice) as shop:
        calibration = shop.calibration.require()
        with (
            opened_workplace(choice, shop.settle_times, console=console) as workplace,
            workplace.use("the drift check") as hands,
            watching(console, silent=wish.as_json) as watch,
        ):
            found = check_drift(
                hands.head, calibration, distance_m=distance_m, clock=workplace.clock, watch=watch
            )
        document = keep_check(
            found,
            calibration,
            apply=apply,
            records=DriftRecords(shop.drift_folder),
            registry=shop.calibration,
            watch=watch,
        )
    if wish.as_json:
        typer.echo(json.dumps(document, allow_nan=False))
        return
    Console().print(document["detail"], markup=False)
    if document["applied"]:
        Console().print(f"Calibration {document['new_calibration_id']} is in force.", markup=False)


@contextmanager
def worked_in(
    known: CalibrationSession | None, shop: LockedDataDirectory, place: SessionChoice, *, console: Console
) -> Iterator[CalibrationSession]:
    """Give the session, or begin one; say of an interrupted step where it can be gone on with.

    A session that was begun here, and holds nothing when its step fails, is taken away again.
    """
    name = place.label or f"calibration of {shop.rig_id}"
    session = known or shop.sessions.create(label=name, rig_id=shop.rig_id, baseline_m=shop.baseline_m)
    try:
        yield session
    except KeyboardInterrupt:
        console.print(f"Interrupted; what was measured is kept: go on with --session {session.id}")
        raise typer.Exit(_INTERRUPTED) from None
    except FoveaError:
        if known is None and session.empty:
            shop.sessions.remove(session.id)
        raise


def found_session(shop: LockedDataDirectory, wanted: str | None) -> CalibrationSession:
    """Return the session named, or the newest of this rig."""
    if wanted is None:
        for session in shop.sessions.every():
            if session.head.rig_id == shop.rig_id:
                return session
        raise NotFound(
            f"rig {shop.rig_id} has no calibration session yet; begin one with `foveacam calibrate wide`"
        )
    session = shop.sessions.get(wanted)
    if session.head.rig_id != shop.rig_id:
        raise InvalidInput(
            f"session {wanted} belongs to rig {session.head.rig_id!r}, this rig is {shop.rig_id!r}; "
            "name a session of this rig"
        )
    return session


def print_session(
    session: CalibrationSession, shop: LockedDataDirectory, watch: CalibrationProgressBar, *, as_json: bool
) -> None:
    """Print what a session holds, as a table or as JSON."""
    document = session_document(session, url="", running=None, waits=shop.settle_times.of(shop.rig_id))
    current = shop.calibration.current
    document["in_force"] = None if current is None else current.id
    if as_json:
        typer.echo(json.dumps(document, allow_nan=False))
        return
    Console().print(session_table(document, fitted=watch.fitted_ids or document["calibrations"]))


def _is_old(document: Document) -> bool:
    """Return whether a session's check is of another calibration than its newest."""
    made = document["calibrations"]
    return bool(made) and document["check"]["calibration_id"] != made[-1]


def session_table(document: Document, *, fitted: Sequence[str]) -> Table:
    """Return a session in a few rows."""
    table = Table(
        title=f"session {document['id']}: {document['label']}".replace("[", "\\["), show_header=False
    )
    table.add_column("part")
    table.add_column("found", overflow="fold")
    wide = document["wide"]
    if wide is not None and wide["fit"] is not None:
        fit = wide["fit"]
        table.add_row(
            "wide camera",
            f"{len(wide['samples'])} views, {fit['model']}: {fit['rms_px']:.3f} px rms, "
            f"{fit['fov_x_deg']:.2f}° x {fit['fov_y_deg']:.2f}°",
        )
    for sweep in document["sweeps"]:
        table.add_row(f"sweep at {sweep['station']}", f"{sweep['done']} of {sweep['nodes']} poses")
    for model in (document["fit"] or {"models": []})["models"]:
        if model["chosen"]:
            across, down = model["loo_deg"]
            table.add_row(f"{model['eye']} mirror", f"{model['name']}: left out {across:.4f}°, {down:.4f}°")
    for part, words in _drift_rows(document):
        table.add_row(part, words)
    if document["check"] is not None:
        check = document["check"]
        table.add_row(
            "check",
            f"rows {check['epipolar_rms_px']} px rms, {check['epipolar_p95_px']} px (95 %), pointing "
            f"{check['pointing_rms_px']} px rms at {check['poses']} places"
            + (", of the calibration before: check again" if _is_old(document) else ""),
        )
    for axis in (document["settle"] or {"axes": []})["axes"]:
        table.add_row(f"{axis['eye']} {axis['axis']}", _settle_words(axis))
    if (document["settle"] or {}).get("settle_us") is not None:
        settle = document["settle"]
        remedy = "put it in use with `foveacam calibrate settle-time --apply`"
        in_use = "in use" if settle["applied"] else remedy
        table.add_row("largest move", f"over after {settle['settle_us'] / 1e3:g} ms, {in_use}")
    if fitted:
        in_force = document.get("in_force") == fitted[-1]
        note = "in force" if in_force else f"put it in force with `foveacam calibrate use {fitted[-1]}`"
        table.add_row("calibration", f"{fitted[-1]}, {note}")
    return table


def _drift_rows(document: Document) -> Iterator[tuple[str, str]]:
    """Yield how the mounts drifted during the sweeps, and since."""
    for eye, drift in ((document["fit"] or {}).get("drift") or {}).items():
        moved = f"{drift['moved_px']:.2f} ± {drift['sigma_px']:.2f} px in {drift['minutes']:.1f} min"
        yield f"{eye} mount", f"drifted by {drift['px_per_minute']:.2f} px a minute, {moved}: taken out"
        for jump_px in drift.get("knocks_px", []):
            yield f"{eye} mount", f"knocked amid the sweeps, its gaze jumped by {jump_px:.1f} px: taken out"
    closing = document["closing"]
    if closing is not None:
        done = "taken out" if closing["corrected"] else "within its own error"
        yield "drift since the sweep", f"rows {closing['rows_px']:.2f} px apart: {done}"


def _settle_words(axis: Document) -> str:
    words = f"1 px after {axis['settle_ms']} ms, 1 % after {axis['settle_1pct_ms']} ms"
    if axis["resonance_hz"] is None:
        return words
    return f"{words}, resonance {axis['resonance_hz']:g} Hz, Q {axis['quality']:g}"
