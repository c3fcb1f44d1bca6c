"""Reads a mirror sweep of both eyes and returns its figures for `foveacam calibrate residuals FILE`."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.calibrate.fit.sweep_residuals import (
    FOVEA_FOCAL_PX,
    EyeErrors,
    EyeScan,
    SweepResiduals,
    analyse_sweep,
    rounding_step,
)

SEED = 0
"""Seed of the Monte Carlo simulation of rounding."""
MOST_BYTES = 5_000_000
MOST_POSES = 2_000
Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Pairs = Annotated[list[Pair], Field(min_length=1, max_length=MOST_POSES)]


class _Document(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True)


class EyePoses(_Document):
    """Poses of one eye in the order of visit: differential volts and gaze angles in degrees, x and y."""

    volts: Pairs
    angles_deg: Pairs

    @model_validator(mode="after")
    def _has_an_angle_for_each_voltage(self) -> "EyePoses":
        if len(self.volts) != len(self.angles_deg):
            raise ValueError(f"{len(self.volts)} volts and {len(self.angles_deg)} angles_deg")
        return self

    def scan(self) -> EyeScan:
        """Return the poses in radians, with the steps to which they are rounded."""
        volts_v = np.array(self.volts, dtype=np.float64)
        angles_deg = np.array(self.angles_deg, dtype=np.float64)
        return EyeScan(
            volts_v=volts_v,
            angles_rad=np.deg2rad(angles_deg),
            volts_step_v=rounding_step(volts_v),
            angles_step_rad=math.radians(rounding_step(angles_deg)),
        )


class SweepPoses(_Document):
    """A sweep of both eyes at the same poses."""

    left: EyePoses
    right: EyePoses


def figures_of_file(file: Path) -> Mapping[str, object]:
    """Return the figures of the sweep in a file."""
    sweep = read_sweep(file)
    return figures(analyse_sweep(sweep.left.scan(), sweep.right.scan(), rng=np.random.default_rng(SEED)))


def read_sweep(file: Path) -> SweepPoses:
    """Return the sweep in a file."""
    try:
        if file.stat().st_size > MOST_BYTES:
            raise InvalidInput(f"{file} is larger than {MOST_BYTES // 10**6} MB; give one sweep of both eyes")
        return SweepPoses.model_validate_json(file.read_bytes())
    except OSError as error:
        raise InvalidInput(f"{file} cannot be read ({error.strerror}); give the path of a sweep") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "content"
        raise InvalidInput(
            f"{file} is not a sweep ({where}: {first['msg']}); give left and right, each with volts and"
            " angles_deg, lists of pairs"
        ) from error


def figures(found: SweepResiduals) -> dict[str, object]:
    """Return the figures by name; px are of the fovea, shares of the variance of both eyes and axes."""
    causes = {f"{cause.name}_share": round(cause.share, 3) for cause in found.causes}
    chances = {
        f"{cause.name}_p_ax_ay": [float(f"{p:.2g}") for p in cause.p_values]
        for cause in found.causes
        if cause.p_values is not None
    }
    return {
        **_eye_figures("left", found.left),
        **_eye_figures("right", found.right),
        "rounding_share": round(found.rounding_share, 3),
        "both_eyes_share": round(found.shared_share, 3),
        **causes,
        **chances,
        "scan_direction_deg": _degrees(found.direction_rad),
        "own_scatter_deg": _degree(found.own_rad),
        "own_scatter_limit_deg": _degree(found.own_limit_rad),
        "own_scatter_limit_px": _px(found.own_limit_rad),
        "angles_off_line_deg": _degree(found.line_rad),
    }


def _eye_figures(eye: str, errors: EyeErrors) -> dict[str, object]:
    return {
        f"{eye}_model": errors.chosen.name,
        f"{eye}_left_out_px": _px(math.hypot(*errors.chosen.loo_rad)),
        f"{eye}_left_out_deg": _degrees(errors.chosen.loo_rad),
        f"{eye}_cubic_left_out_px": _px(math.hypot(*errors.paper.loo_rad)),
        f"{eye}_rounding_px": _px(errors.rounding_rad),
    }


def _px(angle_rad: float) -> float:
    return round(FOVEA_FOCAL_PX * angle_rad, 2)


def _degree(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 4)


def _degrees(angles_rad: tuple[float, float]) -> list[float]:
    return [_degree(angle_rad) for angle_rad in angles_rad]
