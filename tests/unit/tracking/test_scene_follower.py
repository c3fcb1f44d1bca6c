import math
import threading
from itertools import count

import pytest

from foveacam_hardware.contract import PARKED, MirrorVolts, StereoVolts
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.resources.operating.views.overlay import GazeOverlay
from foveacam_server.resources.operating.views.scene_follower import (
    MOVING_PERIODS,
    RigGaze,
    SceneFollower,
    rig_shape,
)
from foveacam_web.scene import ViewerScene
from foveacam_web.scene_values import EyeGaze, RigShape


class Recorder(ViewerScene):
    """A scene that is never started and notes what it is told."""

    def __init__(self) -> None:
        super().__init__()
        self.shapes: list[RigShape] = []
        self.gazes: list[tuple[EyeGaze | None, EyeGaze | None, float | None]] = []

    def show_rig(self, shape: RigShape) -> None:
        self.shapes.append(shape)

    def show_gaze(
        self, *, left: EyeGaze | None, right: EyeGaze | None, distance_m: float | None = None
    ) -> None:
        self.gazes.append((left, right, distance_m))


@pytest.fixture(scope="module")
def certificate() -> Calibration:
    return load_calibration(SHIPPED / "sim-rig120.json")


def test_the_rig_is_drawn_with_its_own_fields_of_view(certificate: Calibration) -> None:
    shape = rig_shape(certificate)
    degrees = [math.degrees(angle) for angle in (*shape.wide_fov_rad, *shape.fovea_fov_rad)]
    # Table 2: 25.6 x 19.4 degrees wide, 2.86 x 2.15 fovea; the lens is known to a percent
    assert degrees == pytest.approx([25.6, 19.4, 2.86, 2.15], rel=0.01)
    assert shape.baseline_m == pytest.approx(0.2, rel=0.02)


def test_the_eyes_turn_with_the_mirrors_and_nothing_is_told_twice(certificate: Calibration) -> None:
    scene, volts = Recorder(), [PARKED]
    follower = SceneFollower(
        scene, gaze=lambda: RigGaze(calibration=certificate, volts=volts[-1], distance_m=math.inf)
    )
    follower.update()
    follower.update()
    volts.append(StereoVolts(left=MirrorVolts(x_v=60.0, y_v=0.0), right=PARKED.right))
    follower.update()
    assert len(scene.gazes) == 1  # it may still move
    follower.update()
    assert len(scene.shapes) == 1
    (parked_left, parked_right, distance_m), (turned_left, turned_right, _) = scene.gazes
    assert distance_m is None
    assert turned_left is not None
    assert parked_left is not None
    # 0.060 degrees a volt
    assert math.degrees(turned_left.ax_rad - parked_left.ax_rad) == pytest.approx(3.6, rel=0.2)
    assert turned_right == parked_right


def test_a_gaze_that_never_rests_is_drawn_now_and_then(certificate: Calibration) -> None:
    scene, moves = Recorder(), count()

    def moving() -> RigGaze:
        left = MirrorVolts(x_v=float(next(moves)), y_v=0.0)
        volts = StereoVolts(left=left, right=PARKED.right)
        return RigGaze(calibration=certificate, volts=volts, distance_m=math.inf)

    follower = SceneFollower(scene, gaze=moving)
    for _ in range(1 + 3 * MOVING_PERIODS):
        follower.update()
    assert len(scene.gazes) == 1 + 3


def test_eyes_whose_mirrors_nobody_knows_are_hidden(certificate: Calibration) -> None:
    scene = Recorder()
    unknown = RigGaze(calibration=certificate, volts=None, distance_m=2.0)
    SceneFollower(scene, gaze=lambda: unknown).update()
    assert scene.gazes == [(None, None, 2.0)]


def test_no_footprint_is_drawn_while_nobody_knows_where_the_mirrors_stand(certificate: Calibration) -> None:
    overlay = GazeOverlay(lambda: certificate)
    drawn, unknown = overlay.of(PARKED), overlay.of(None)
    assert drawn is not None and len(drawn.footprints["left"] or ()) == 4
    assert unknown is not None
    assert unknown.footprints == {"left": None, "right": None}
    assert unknown.gaze == {"left": None, "right": None}


def test_nothing_is_drawn_while_the_rig_is_not_calibrated() -> None:
    scene = Recorder()
    SceneFollower(scene, gaze=lambda: None).update()
    assert scene.shapes == []
    assert scene.gazes == []


def test_closing_ends_the_thread(certificate: Calibration) -> None:
    follower = SceneFollower(Recorder(), gaze=lambda: None)
    follower.start()
    assert "foveacam-scene" in {thread.name for thread in threading.enumerate()}
    follower.close()
    assert "foveacam-scene" not in {thread.name for thread in threading.enumerate()}
