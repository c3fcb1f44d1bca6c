"""Eq. 1: by how much the wide camera's bearing of its own marker misses the gaze of an eye on its own."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role, Station
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose


@dataclass(frozen=True, slots=True, kw_only=True)
class StationParallax:
    """Eq. 1 at one station.

    `print_m`: distance by the markers' size, with its scatter over the poses; `tape_m`: as the station says.
    `largest_rad`, `rms_rad`: over both eyes and all poses. `corrected`: it was taken out of the gazes.
    """

    station: str
    print_m: float
    print_scatter_m: float
    tape_m: float | None
    largest_rad: float
    rms_rad: float
    corrected: bool

    @property
    def words(self) -> str:
        """The same in a sentence."""
        tape = "nobody measured it by tape" if self.tape_m is None else f"{self.tape_m:g} m by tape"
        done = "it was taken out" if self.corrected else "it was left in, the distance counting as unknown"
        return (
            f"{self.station}: the markers appear {self.print_m:.3f} m away by their print, {tape}; the "
            f"parallax of Eq. 1 is {math.degrees(self.rms_rad):.4f}° rms, at most "
            f"{math.degrees(self.largest_rad):.4f}°; {done}"
        )


def eq1_rad(theta_rad: NDArray[np.float64], *, spacing_m: float, distance_m: float) -> NDArray[np.float64]:
    """Return Eq. 1 for a base turned by `theta_rad`: any shape; `spacing_m` < 0 stands for the left eye."""
    behind = spacing_m - spacing_m * np.cos(theta_rad)
    return np.asarray(np.arctan(behind / (distance_m + spacing_m * np.sin(theta_rad))), dtype=np.float64)


def station_parallax(
    station: Station, targets: Sequence[TargetPose], *, baseline_m: float, corrected: bool
) -> StationParallax:
    """Return the parallax at a station: each eye's bearing of its marker less the wide camera's, exactly."""
    distances = np.array([target.distance_m / target.scale for target in targets])
    missed = np.concatenate([_parallax_rad(target, baseline_m) for target in targets])
    return StationParallax(
        station=station.name,
        print_m=float(np.median(distances)),
        print_scatter_m=float(np.std(distances)),
        tape_m=station.distance_m,
        largest_rad=float(np.abs(missed).max()),
        rms_rad=float(np.sqrt(np.mean(missed**2))),
        corrected=corrected,
    )


def _parallax_rad(target: TargetPose, baseline_m: float) -> NDArray[np.float64]:
    """Return (4,) differences of the angles: left x, y, right x, y."""
    own = np.arctan(target.middle_m[:2] / target.middle_m[2])
    missed = []
    for role, side in ((Role.LEFT, -0.5), (Role.RIGHT, 0.5)):
        seen = target.marker_rig_m(role) - np.array([side * baseline_m, 0.0, 0.0])
        missed.append(np.arctan(seen[:2] / seen[2]) - own)
    return np.concatenate(missed)
