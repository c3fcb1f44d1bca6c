"""What a fit found, as a document: every model's score, the paper's own beside it, the parallax of Eq. 1."""

import math

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.fit.measured import StationParallax
from foveacam_pipeline.calibrate.fit.session_fit import FitResult
from foveacam_pipeline.calibrate.fit.variants import VariantScore
from foveacam_server.runtime.store import Document

EYES = (Role.LEFT, Role.RIGHT)


def fit_document(result: FitResult) -> Document:
    """Return a fit as REST shows it."""
    return {
        "calibration_id": result.calibration.id,
        "models": [
            {
                "name": score.name,
                "order": score.order,
                "eye": role.value,
                "loo_deg": _deg(score.loo_rad),
                "chosen": score.chosen,
            }
            for role in EYES
            for score in result.models[role]
        ],
        "fields": [
            {
                "name": score.name,
                "order": score.order,
                "eye": role.value,
                "loo_px": round(score.loo_px, 4),
                "chosen": score.chosen,
            }
            for role in EYES
            for score in result.fit.fields[role].scores
        ],
        "volts_roundtrip_max_lsb": round(result.volts_roundtrip_max_lsb, 4),
        "paper": _paper(result),
        "parallax": {parallax.station: _parallax(parallax) for parallax in result.parallax},
        "drift": _drift(result),
    }


def _drift(result: FitResult) -> Document | None:
    """Return how the mounts drifted while they were calibrated; None when that was not measured."""
    if result.drift is None:
        return None
    f_px = result.calibration.fovea_f_px
    return {
        role.value: {
            "px_per_minute": round(f_px * drift.rad_per_minute, 3),
            "moved_px": round(f_px * drift.moved_rad, 3),
            "sigma_px": round(f_px * math.hypot(*drift.sigma_rad), 3),
            "minutes": round(drift.minutes, 2),
            "pieces": drift.pieces,
            "visits": drift.visits,
            "knocks_px": [round(f_px * step_rad, 2) for step_rad in drift.knocks_rad],
        }
        for role, drift in result.drift.items()
    }


def _paper(result: FitResult) -> Document | None:
    """Return the paper's plain model of the same data, and what each of our additions brings."""
    paper = result.paper
    if paper is None:
        return None
    return {
        "station": paper.station,
        "loo_deg": {role.value: _deg(paper.fit.mirrors[role].model.loo_rad) for role in EYES},
        "rectify_loo_px": {role.value: round(paper.fit.fields[role].field.loo_px, 4) for role in EYES},
        "volts_roundtrip_max_lsb": round(paper.roundtrip_lsb, 2),
        "steps": [_variant(variant) for variant in result.variants],
    }


def _variant(variant: VariantScore) -> Document:
    return {
        "name": variant.name,
        "pointing_rms_px": round(variant.pointing_rms_px, 3),
        "rectification_rms_px": round(variant.rectification_rms_px, 3),
        "epipolar_rms_px": round(variant.epipolar_rms_px, 3),
    }


def _parallax(parallax: StationParallax) -> Document:
    return {
        "print_m": round(parallax.print_m, 4),
        "print_scatter_m": round(parallax.print_scatter_m, 5),
        "tape_m": parallax.tape_m,
        "rms_deg": round(math.degrees(parallax.rms_rad), 5),
        "largest_deg": round(math.degrees(parallax.largest_rad), 5),
        "corrected": parallax.corrected,
        "words": parallax.words,
    }


def _deg(pair_rad: tuple[float, float]) -> list[float]:
    return [round(math.degrees(angle_rad), 5) for angle_rad in pair_rad]
