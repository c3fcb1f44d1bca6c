"""Planes of 1/Z through all subsets of a few samples."""

import numpy as np
import pytest

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


@pytest.mark.parametrize("member", [(1, 0, 0, 0), (1, 1, 0, 1), (1, 1, 1, 1)])
@pytest.mark.parametrize("k", [0, 1])
def test_evidence_and_plane_are_those_of_the_normal_distribution(member: tuple[int, ...], k: int) -> None:
    own = np.array(member, dtype=np.bool_)
    planes = planes_through(OFFSETS, Q, SIGMA, level=LEVEL)
    design = np.column_stack([np.ones(4), OFFSETS])[own]
    prior = np.diag([LEVEL_SIGMA_PER_M**2, *[(SLOPE_SIGMAS[k] * LEVEL) ** 2] * 2])
    covariance = design @ prior @ design.T + np.diag(SIGMA[own] ** 2)
    gain = prior @ design.T @ np.linalg.inv(covariance)

    subset = subset_of(own)

    from scipy.stats import multivariate_normal  # slow to import

    expected = multivariate_normal.logpdf(Q[own] - LEVEL, cov=covariance) - np.log(2.0)
    assert planes.log_evidence[k, subset] == pytest.approx(expected, abs=1e-6)
    assert planes.plane[k, subset] == pytest.approx(gain @ (Q[own] - LEVEL), abs=1e-8)
    assert planes.variance[k, subset] == pytest.approx((prior - gain @ design @ prior)[0, 0], rel=1e-6)


def test_samples_that_agree_speak_for_a_surface_that_faces_the_rig() -> None:
    planes = planes_through(OFFSETS, np.full(4, LEVEL), SIGMA, level=LEVEL)

    facing, steep = planes.log_evidence[:, 15]

    assert facing > steep
    assert planes.log_any[15] == pytest.approx(np.logaddexp(facing, steep))
