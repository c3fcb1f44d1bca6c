"""Drift without pictures: places as a pair of eyes with a known drift would see them."""

import math

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.drift.values import DriftPlace, EyeTurn
from foveacam_pipeline.verge.aim import aim_at
from tests.support.scenes.plane_head import CALIBRATION

SIGMA = (3.5e-5, 2.0e-6, 2.0e-6)
"""A tenth of a wide px against the wide camera, a twentieth of a fovea px between the eyes; tangents."""
LEFT = EyeTurn(turn_rad=(math.radians(0.2), math.radians(-0.22), math.radians(0.1)))
RIGHT = EyeTurn(turn_rad=(math.radians(-0.1), math.radians(0.28), math.radians(-0.1)))
STILL = EyeTurn()


def undone(turn: EyeTurn, true: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (2,) tangents by the calibration of what lies along `true`: (2,), for an eye that moved."""
    seen = true.copy()
    for _ in range(20):
        seen = seen + true - turn.apply(seen[None])[0]
    return seen


def places(
    left: EyeTurn = LEFT,
    right: EyeTurn = RIGHT,
    *,
    count: int = 14,
    seed: int = 1,
    known: int = 0,
    field_rad: float = 0.13,
) -> tuple[DriftPlace, ...]:
    """Return places all over the field; the depths of the first `known` are known."""
    rng = np.random.default_rng(seed)
    found = []
    for index in range(count):
        target = np.tan(rng.uniform(-field_rad, field_rad, 2))
        inverse = rng.uniform(0.03, 0.5)
        true = aim_at(CALIBRATION, target, inverse)
        common = rng.normal(0.0, SIGMA[0], 2)
        seen = []
        for turn, gaze in ((left, true.left), (right, true.right)):
            x, y = (undone(turn, gaze) + common + rng.normal(0.0, SIGMA[1], 2)).tolist()
            seen.append((x, y))
        x, y = target.tolist()
        found.append(
            DriftPlace(
                target=(x, y),
                left=seen[0],
                right=seen[1],
                sigma=SIGMA,
                score=0.9,
                t_ns=index,
                inverse_depth=inverse if index < known else None,
                inverse_sigma=1e-4,
            )
        )
    return tuple(found)


def pointing_rms_px(found: dict[Role, EyeTurn], true: dict[Role, EyeTurn]) -> float:
    """Return how far the eyes would point from where they should after the correction, 2-D rms, fovea px."""
    line = np.tan(np.linspace(-0.157, 0.157, 9))
    field = np.array([(x, y) for x in line for y in line])
    misses = [found[role].apply(field) - true[role].apply(field) for role in true]
    return CALIBRATION.fovea_f_px * math.sqrt(float(np.mean(np.sum(np.array(misses) ** 2, axis=2))))
