"""The scene's distance before a capture: taken from what is known, and measured where nothing is."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture

from foveacam_pipeline.capture.plan import plan_from, survey_directions_rad
from foveacam_pipeline.capture.run import measure_distances_m
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples

Z_M, KNOWN_Z_M = 6.0, 3.0
PLAN = plan_from({"points": {"kind": "grid", "columns": 3, "rows": 3}, "verging": {"mode": "scene"}})


class Known:
    """Depths known to the left of the middle alone, with a relative standard error."""

    def __init__(self, relative_sigma: float) -> None:
        self.relative_sigma = relative_sigma

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        if target[0] > -0.01:
            return DepthSamples.none()
        inverse_z = np.full(3, 1.0 / KNOWN_Z_M)
        return DepthSamples(
            tangents=np.tile(target, (3, 1)),
            inverse_z_per_m=inverse_z,
            sigma_per_m=self.relative_sigma * inverse_z,
        )


def surveyed(known: Known | None) -> tuple[list[float], NDArray[np.float64], int]:
    """Return the distances, m, the directions' rays of z = 1, and the number of looks."""
    head = PlaneHead(z_m=Z_M, texture=noise_texture(), binning=2)
    access = cast(Any, SimpleNamespace(head=head, clock=head.clock))
    watch = cast(Any, SimpleNamespace(cancelled=lambda: False, progress=lambda _: None))
    found = measure_distances_m(access, PLAN, CALIBRATION, watch=watch, context=known)
    tangents = np.tan(survey_directions_rad(PLAN, CALIBRATION))
    rays = np.linalg.norm(np.column_stack([tangents, np.ones(len(tangents))]), axis=1)
    assert None not in found
    return [float(one) for one in found if one is not None], rays, head.looks


def test_known_depth_replaces_the_fixations_there() -> None:
    found, rays, looks = surveyed(Known(relative_sigma=0.01))
    left = survey_directions_rad(PLAN, CALIBRATION)[:, 0] < -0.01
    assert left.sum() == 3
    assert found == pytest.approx(np.where(left, KNOWN_Z_M, Z_M) * rays, rel=0.01)
    assert np.array(found)[left] == pytest.approx(KNOWN_Z_M * rays[left], rel=1e-6)
    assert looks < surveyed(None)[2]


def test_a_depth_that_is_hardly_known_is_measured() -> None:
    found, rays, _ = surveyed(Known(relative_sigma=0.2))
    assert found == pytest.approx(Z_M * rays, rel=0.01)
