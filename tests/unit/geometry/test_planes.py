"""Planes of 1/Z through all subsets of a few samples."""

from dataclasses import dataclass

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.verge.surroundings.planes import (
    LEVEL_SIGMA_PER_M,
    SLOPE_SIGMAS,
    planes_through,
    subset_of,
)

LEVEL = 0.37
OFFSETS = np.array([[-0.05, 0.0], [0.03, 0.02], [0.01, -0.04], [0.06, 0.01]])
SIGMA = np.array([7e-4, 9e-4, 1.2e-3, 7e-4])
Q = LEVEL + 0.02 * OFFSETS[:, 0] + np.array([3e-4, -5e-4, 2e-4, 1e-4])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plane:
    """What the normal distribution says of some samples, correct to the last digit of a float64."""

    log_evidence: float
    terms: NDArray[np.float64]
    variance: float
    condition: float
    """Of the information about the three terms: so many times a rounding error grows in them."""


def plane_by_the_normal_distribution(
    offsets: NDArray[np.float64], q: NDArray[np.float64], sigma: NDArray[np.float64], *, level: float, k: int
) -> Plane:
    """Condition the joint distribution of terms and samples, by 50 digits: the difference cancels nine."""
    with mpmath.workdps(50):
        design = mpmath.matrix([[1, *row] for row in offsets.tolist()])
        slope = (mpmath.mpf(SLOPE_SIGMAS[k]) * level) ** 2
        prior = mpmath.diag([mpmath.mpf(LEVEL_SIGMA_PER_M) ** 2, slope, slope])
        residual = mpmath.matrix([mpmath.mpf(value) - level for value in q.tolist()])
        covariance = design * prior * design.T + mpmath.diag([mpmath.mpf(s) ** 2 for s in sigma.tolist()])
        gain = prior * design.T * covariance**-1
        posterior = prior - gain * design * prior
        terms = gain * residual
        misfit = (residual.T * covariance**-1 * residual)[0]
        log_density = -(misfit + mpmath.log(mpmath.det(2 * mpmath.pi * covariance))) / 2
        return Plane(
            log_evidence=float(log_density - mpmath.log(len(SLOPE_SIGMAS))),
            terms=np.array([float(term) for term in terms]),
            variance=float(posterior[0, 0]),
            condition=float(mpmath.cond(posterior)),
        )


@pytest.mark.parametrize("member", [(1, 0, 0, 0), (1, 1, 0, 1), (1, 1, 1, 1)])
@pytest.mark.parametrize("k", [0, 1])
def test_evidence_and_plane_are_those_of_the_normal_distribution(member: tuple[int, ...], k: int) -> None:
    own = np.array(member, dtype=np.bool_)

    planes = planes_through(OFFSETS, Q, SIGMA, level=LEVEL)

    subset = subset_of(own)
    expected = plane_by_the_normal_distribution(OFFSETS[own], Q[own], SIGMA[own], level=LEVEL, k=k)
    rounding = 4.0 * expected.condition * np.finfo(np.float64).eps
    assert planes.log_evidence[k, subset] == pytest.approx(expected.log_evidence, rel=rounding)
    largest = float(np.abs(expected.terms).max())
    assert planes.plane[k, subset] == pytest.approx(expected.terms, rel=0.0, abs=rounding * largest)
    assert planes.variance[k, subset] == pytest.approx(expected.variance, rel=rounding)


def test_planes_of_near_samples_far_away_keep_their_digits() -> None:
    level, sigma = 1.0 / 30.0, np.full(4, 7e-5)
    offsets, q = 0.02 * OFFSETS, level + np.array([1e-4, -6e-5, 0.0, 3.0 * level])  # the last one in front

    planes = planes_through(offsets, q, sigma, level=level)

    for k in range(len(SLOPE_SIGMAS)):
        expected = plane_by_the_normal_distribution(offsets, q, sigma, level=level, k=k)
        assert expected.condition > 1e4
        rounding = 4.0 * expected.condition * np.finfo(np.float64).eps
        assert planes.log_evidence[k, -1] == pytest.approx(expected.log_evidence, rel=rounding)
        assert planes.variance[k, -1] == pytest.approx(expected.variance, rel=rounding)


def test_samples_that_agree_speak_for_a_surface_that_faces_the_rig() -> None:
    planes = planes_through(OFFSETS, np.full(4, LEVEL), SIGMA, level=LEVEL)

    facing, steep = planes.log_evidence[:, 15]

    assert facing > steep
    assert planes.log_any[15] == pytest.approx(np.logaddexp(facing, steep))
