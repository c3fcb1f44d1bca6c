"""Check of how well the mirrors return: at rest, from four sides, and over the run."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foveacam_pipeline.accept.axes import FOCAL_PX
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.rig_under_test import EYES, RigUnderTest, both, marker_px
from foveacam_pipeline.accept.values import AcceptanceCheck, Fault, Measured, NamedFault, judged

REST_TITLE = "At rest: the pictures stand still"
RETURN_TITLE = "Return: the mirrors come back to the same angle"
REST_LOOKS = 10
REST_PAUSE_S = 0.45
FAR_V = 60.0
SIDES = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
RETURNS = 4
"""Returns from each side."""
SIGMAS = 4.0
"""A difference between the sides counts from this many of its standard errors on."""
SECONDS_PER_MIN = 60.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RestPlaces:
    """Gazes at rest. `t_s` (n,): when; `places_deg` (n, 4): left x, left y, right x, right y."""

    t_s: NDArray[np.float64]
    places_deg: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Returns:
    """Gazes after returns. `sides` (n,): index of the side; `places_deg` (n, 4), without their drift."""

    sides: NDArray[np.int64]
    places_deg: NDArray[np.float64]


def rest_places(rig: RigUnderTest) -> RestPlaces:
    """Return gazes at rest over some seconds, after a return from the same side as always."""
    rig.look(both((FAR_V, 0.0), (FAR_V, 0.0)))
    times, places = [], []
    for _ in range(REST_LOOKS):
        t_ns, place = _place_deg(rig)
        times.append(t_ns * 1e-9)
        places.append(place)
        rig.wait(REST_PAUSE_S)
    return RestPlaces(t_s=np.array(times), places_deg=np.array(places))


def check_rest(places: RestPlaces, limits: AcceptanceLimits) -> AcceptanceCheck:
    """Return whether the pictures stand still while nothing moves."""
    figures, findings = [], []
    for index, role in enumerate(EYES):
        own = _without_trend(places.t_s, places.places_deg[:, 2 * index : 2 * index + 2])
        scatter_deg = float(np.sqrt(np.mean(np.sum(own**2, axis=1)) / 2.0))
        figure = Measured(
            name=f"{role}: scatter at rest", value=round(scatter_deg, 5), unit="°", high=limits.rest_deg
        )
        figures.append(figure)
        if not figure.is_within:
            detail = f"the {role} picture moves by {scatter_deg:.4f}° (rms) while its mirror rests"
            findings.append(NamedFault(fault=Fault.LOOSE_MOUNT, subject=str(role), detail=detail))
    return judged("rest", REST_TITLE, figures=figures, findings=findings, picture="rest")


def measured_returns(rig: RigUnderTest) -> Returns:
    """Return the gazes at rest after returns from four sides in turn."""
    sides, times, places = [], [], []
    for _ in range(RETURNS):
        for index, (x, y) in enumerate(SIDES):
            drive = (x * FAR_V, y * FAR_V)
            rig.look(both(drive, drive))
            t_ns, place = _place_deg(rig)
            sides.append(index)
            times.append(t_ns * 1e-9)
            places.append(place)
    kept = np.array(sides)
    settled = _without_trend_of_sides(np.array(times), np.array(places), kept)
    return Returns(sides=kept, places_deg=settled)


def return_spread_deg(returns: Returns) -> float:
    """Return how far two returns may differ: by scatter, four standard deviations, and by hysteresis, deg."""
    by_chance = SIGMAS * math.sqrt(2.0) * _scatter_deg(returns)
    return by_chance + 2.0 * float(np.abs(_hysteresis_deg(returns)).max())


def check_returns(
    returns: Returns, before: RestPlaces, after: RestPlaces, limits: AcceptanceLimits
) -> AcceptanceCheck:
    """Return scatter and hysteresis of the returns, and the drift between two rests."""
    figures, findings = [], []
    scatter_deg = _scatter_deg(returns)
    figures.append(
        Measured(
            name="scatter of the returns", value=round(scatter_deg, 5), unit="°", high=limits.scatter_deg
        )
    )
    if scatter_deg > limits.scatter_deg:
        detail = f"after a move the gazes scatter by {scatter_deg:.4f}° (rms), from the same side"
        findings.append(NamedFault(fault=Fault.SCATTER, subject="", detail=detail))
    half_deg = _hysteresis_deg(returns)
    largest = float(np.abs(half_deg).max())
    noise_deg = scatter_deg / np.sqrt(2.0 * RETURNS)
    figures.append(
        Measured(name="hysteresis, worst axis", value=round(largest, 5), unit="°", high=limits.hysteresis_deg)
    )
    if largest > limits.hysteresis_deg and largest > SIGMAS * noise_deg:
        detail = f"the gazes rest up to {largest:.4f}° to either side, by the side from which they came"
        findings.append(NamedFault(fault=Fault.HYSTERESIS, subject="", detail=detail))
    _add_drift(before, after, limits, figures, findings, spread_deg=return_spread_deg(returns))
    return judged("returns", RETURN_TITLE, figures=figures, findings=findings, picture="returns")


def _add_drift(
    before: RestPlaces,
    after: RestPlaces,
    limits: AcceptanceLimits,
    figures: list[Measured],
    findings: list[NamedFault],
    *,
    spread_deg: float,
) -> None:
    minutes = float(after.t_s.mean() - before.t_s.mean()) / SECONDS_PER_MIN
    moved = (after.places_deg.mean(axis=0) - before.places_deg.mean(axis=0)) / minutes
    for index, role in enumerate(EYES):
        per_min = float(np.linalg.norm(moved[2 * index : 2 * index + 2]))
        figure = Measured(
            name=f"{role}: drift", value=round(per_min, 5), unit="°/min", high=limits.drift_deg_per_min
        )
        figures.append(figure)
        if not figure.is_within and per_min * minutes > spread_deg:
            detail = f"the {role} gaze moves by {per_min:.4f}° a minute under the same volts"
            findings.append(NamedFault(fault=Fault.MOUNT_DRIFT, subject=str(role), detail=detail))


def _scatter_deg(returns: Returns) -> float:
    left = np.concatenate(
        [
            own - own.mean(axis=0)
            for side in range(len(SIDES))
            for own in [returns.places_deg[returns.sides == side]]
        ]
    )
    freedom = (RETURNS - 1) / RETURNS
    return float(np.sqrt(np.mean(left**2) / freedom))


def _hysteresis_deg(returns: Returns) -> NDArray[np.float64]:
    """Return half the difference between opposite sides, (4,): along x after moves in x, along y in y."""
    means = np.array([returns.places_deg[returns.sides == side].mean(axis=0) for side in range(len(SIDES))])
    along_x, along_y = (means[0] - means[1]) / 2.0, (means[2] - means[3]) / 2.0
    return np.array([along_x[0], along_y[1], along_x[2], along_y[3]])


def _place_deg(rig: RigUnderTest) -> tuple[int, NDArray[np.float64]]:
    """Return when, and the gazes (4,) at rest against the markers, deg."""
    sighting = rig.look()
    places = [-np.rad2deg(marker_px(rig, sighting, role) / FOCAL_PX) for role in EYES]
    return sighting.left.t_ns, np.concatenate(places)


def _without_trend(t_s: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    columns = np.column_stack([np.ones(len(t_s)), t_s - t_s.mean()])
    return np.asarray(places - columns @ np.linalg.lstsq(columns, places, rcond=None)[0])


def _without_trend_of_sides(
    t_s: NDArray[np.float64], places: NDArray[np.float64], sides: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return places without the trend that all sides share; each side keeps its own mean."""
    columns = np.column_stack(
        [t_s - t_s.mean(), *((sides == side).astype(float) for side in range(len(SIDES)))]
    )
    slope = np.linalg.lstsq(columns, places, rcond=None)[0][0]
    return np.asarray(places - np.outer(t_s - t_s.mean(), slope))
