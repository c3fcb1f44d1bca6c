"""Fit the lens to a session's views of the board, store the result of stage 1, remove a view."""

import math
from pathlib import Path
from typing import Literal

from foveacam_hardware.contract import FoveaError, InvalidInput
from foveacam_pipeline.calibrate.wide.board_pose import pose_of_view
from foveacam_pipeline.calibrate.wide.boards import Board, Charuco
from foveacam_pipeline.calibrate.wide.coverage import coverage_of
from foveacam_pipeline.calibrate.wide.fit_wide import WideFit, choose_model, fit_wide
from foveacam_pipeline.calibrate.wide.wide_samples import WideSample, WideSamples
from foveacam_pipeline.models.content import plain
from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_server.foundation.store import Document
from foveacam_server.resources.calibration_sessions.sessions import VIEWS, CalibrationSession
from foveacam_server.resources.calibration_sessions.wide_documents import RESULT, no_view, views_id

Model = Literal["five", "rational"]


def unfitted_result(folder: Path, views: str) -> Document:
    """Return the result of views without a fitted lens, as while they are being taken."""
    return _result(WideSamples.load(folder), views, model=None, fits=[], reason="no lens fits them yet")


def samples_of(session: CalibrationSession) -> WideSamples | None:
    """Return the session's views of the board; None without any."""
    return WideSamples.load(session.folder) if (session.folder / VIEWS).is_file() else None


def remove_sample(session: CalibrationSession, sample_id: str) -> list[WideFit]:
    """Remove a view, fit the lens to the others and return the fits; raise `Busy` while a step writes."""
    with session.writing():
        samples = samples_of(session)
        if samples is None or sample_id not in [sample.id for sample in samples]:
            raise no_view(session, sample_id)
        samples.remove(sample_id)
        samples.save(session.folder)
        return write_result(session, samples, model=(session.read(RESULT) or {}).get("model"))


def write_result(session: CalibrationSession, samples: WideSamples, *, model: Model | None) -> list[WideFit]:
    """Fit both lens models, store the result of stage 1, and return the chosen fit and the other one.

    `model`: the one to choose; None chooses the one that predicts left-out views better. Views that are too
    few or too alike are stored without a fit.
    """
    try:
        fits, reason = _fitted(samples, model)
    except InvalidInput as error:
        fits, reason = [], str(error)
    views = views_id(session.folder)
    session.write(RESULT, _result(samples, views, model=model, fits=fits, reason=reason))
    return fits


def _result(
    samples: WideSamples, views: str, *, model: Model | None, fits: list[WideFit], reason: str
) -> Document:
    rms_px = {view.id: view.rms_px for view in fits[0].views} if fits else {}
    lens = fits[0].intrinsics if fits else None
    coverage = coverage_of((sample.view for sample in samples), lens)
    return {
        "views_id": views,
        "board": _board(samples.board),
        "model": model,
        "lens": None if lens is None else plain(lens),
        "wide": {
            "samples": [_sample(sample, rms_px.get(sample.id), lens) for sample in samples],
            "coverage_fraction": round(coverage.fraction, 4),
            "cells": coverage.cells.tolist(),
            "tilts_covered": coverage.tilts_covered,
            "fit": _fit(fits[0]) if fits else None,
            "other_model": _fit(fits[1]) if len(fits) > 1 else None,
            "reason": reason,
        },
    }


def _fitted(samples: WideSamples, model: Model | None) -> tuple[list[WideFit], str]:
    if model is None:
        choice = choose_model(samples)
        return [choice.recommended, choice.other], choice.reason
    other: Model = "rational" if model == "five" else "five"
    return [fit_wide(samples, model), fit_wide(samples, other)], f"{model}: as asked"


def _sample(sample: WideSample, rms_px: float | None, lens: Intrinsics | None) -> Document:
    x_px, y_px = sample.view.corners_px.mean(axis=0).tolist()
    return {
        "id": sample.id,
        "rms_px": None if rms_px is None else round(rms_px, 4),
        "tilt_deg": _tilt_deg(sample, lens),
        "centre_px": [round(x_px, 1), round(y_px, 1)],
        "corners": len(sample.view.ids),
    }


def _tilt_deg(sample: WideSample, lens: Intrinsics | None) -> float | None:
    try:
        return round(math.degrees(pose_of_view(sample.view, lens).tilt_rad), 1)
    except FoveaError:
        return None


def _fit(fit: WideFit) -> Document:
    lens = fit.intrinsics
    fov_x_rad, fov_y_rad = fit.field_rad
    return {
        "model": fit.model,
        "rms_px": round(fit.rms_px, 4),
        "fov_x_deg": round(math.degrees(fov_x_rad), 4),
        "fov_y_deg": round(math.degrees(fov_y_rad), 4),
        "fx_px": round(lens.fx_px, 3),
        "fy_px": round(lens.fy_px, 3),
        "cx_px": round(lens.cx_px, 3),
        "cy_px": round(lens.cy_px, 3),
        "distortion": list(lens.distortion),
        "accuracy_deg": round(math.degrees(fit.accuracy.sigma_rad), 6),
    }


def _board(board: Board) -> Document:
    return {
        "kind": board.kind,
        "columns": board.columns,
        "rows": board.rows,
        "square_mm": round(1e3 * board.square_m, 4),
        "marker_mm": round(1e3 * board.marker_m, 4) if isinstance(board, Charuco) else None,
    }
