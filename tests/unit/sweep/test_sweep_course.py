"""The course of the base during a sweep: its error at one gaze corrects the next, if it is the base's."""

import math
from dataclasses import dataclass, field
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import PanTiltPose, Role
from foveacam_pipeline.calibrate.sweep.eye_prediction import EyePrediction
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout, MarkerView
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_course import SweepCourse
from foveacam_pipeline.calibrate.sweep.sweep_pose import PoseMeter
from foveacam_pipeline.models.intrinsics import Intrinsics

WIDE = Intrinsics(width=1440, height=1080, fx_px=3155.0, fy_px=3155.0, cx_px=719.5, cy_px=539.5)
NODES = np.deg2rad([(1.0, 0.0), (2.0, 1.0), (3.0, -1.0)])
TARGET = TargetPose(
    rotation=np.eye(3),
    middle_m=np.array([0.0, 0.0, 5.0]),
    layout=MarkerLayout(),
    misfit_px=0.0,
    distance_sigma_m=0.0,
)


@dataclass
class CrookedBase:
    """A base that misses what is asked of it, and a meter that sees where the target then is."""

    missed_rad: NDArray[np.float64]
    asked_rad: list[NDArray[np.float64]] = field(default_factory=list)
    predictions: dict[Role, EyePrediction] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for role in (Role.LEFT, Role.RIGHT):
            self.predictions[role] = EyePrediction((1e-3, 1e-3))
            for node in NODES:
                self.predictions[role].learn(node, node / 1e-3)

    def turn_to(self, node_rad: NDArray[np.float64]) -> PanTiltPose | None:
        self.asked_rad.append(node_rad)
        return None

    def reachable_gaze(self, node_rad: NDArray[np.float64], _target: TargetPose) -> NDArray[np.float64]:
        return node_rad

    def retreat_gaze(self, _pose: SweepPose, _target: TargetPose) -> None:
        return None

    def measure(self, index: int, node_rad: tuple[float, float], base: PanTiltPose | None) -> SweepPose:
        at_px = WIDE.pixels((self.asked_rad[-1] + self.missed_rad)[None])[0]
        side = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        view = MarkerView(
            id=0, corners_px=at_px + 20.0 * side, places_m=0.03 * side, sharpness=1.6, complete=True
        )
        return SweepPose(
            index=index, node_rad=node_rad, pan_tilt=base, t_ns=0, wide={0: view}, left=None, right=None
        )


@pytest.mark.parametrize(("missed_deg", "corrected"), [((0.8, -0.5), True), ((0.8, 6.0), False)])
def test_a_crooked_base_is_corrected_and_a_target_far_off_is_not_taken_for_one(
    missed_deg: tuple[float, float], *, corrected: bool
) -> None:
    base = CrookedBase(missed_rad=np.deg2rad(missed_deg))
    course = SweepCourse(base.turn_to, cast(PoseMeter, base), WIDE, wide_id=0, approach_rad=math.radians(3.0))
    for index, node in enumerate(NODES):
        course.measure(index, node, TARGET)

    offset = base.missed_rad if corrected else np.zeros(2)
    np.testing.assert_allclose(base.asked_rad, [NODES[0], *(NODES[1:] - offset)], atol=1e-5)
