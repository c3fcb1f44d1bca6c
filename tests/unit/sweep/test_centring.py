"""An eye centres its marker, stops at its limit without winding up, and says why a sight is refused."""

import math
import re

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.sweep.centring import CentringSettings, EyeCentring, TwoAxisPid
from foveacam_pipeline.calibrate.sweep.eye_prediction import EyePrediction
from foveacam_pipeline.calibrate.sweep.marker_observation import EyeObservation
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerView

SIZE = (1440, 1080)
F_PX = 28_760.0
RAD_PER_V = (math.radians(0.060), math.radians(0.052))
MAX_V = 170.0
HALF_MARKER_PX = 170.0
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
T_NS = 5_000_000_000


class Mirror:
    """A mirror of its own gain, saturation and cross-coupling, and the marker as its eye sees it."""

    def __init__(self, marker_rad: tuple[float, float]) -> None:
        self.marker_rad = np.array(marker_rad)
        self.dead: set[int] = set()

    def gaze(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        drive = np.array([0.0 if axis in self.dead else volts_v[axis] for axis in (0, 1)])
        bent = drive * (1.0 - 0.11 * (drive / MAX_V) ** 2)
        gain = np.array([[math.radians(0.0615), 6e-5], [-5e-5, math.radians(0.0505)]])
        return np.asarray(np.array([0.004, -0.003]) + gain @ bent, dtype=np.float64)

    def sight(
        self,
        volts_v: NDArray[np.float64],
        *,
        blur_px: float = 1.4,
        t_ns: int = T_NS,
        covered: int = 0,
        white_level: float = 215.0,
    ) -> EyeObservation:
        offset = (self.marker_rad - self.gaze(volts_v)) * F_PX
        corners = np.array(SIZE) / 2.0 - 0.5 + offset + HALF_MARKER_PX * CORNERS
        inside = bool((corners > 2.0).all() and (corners < np.array(SIZE) - 3.0).all())
        view = MarkerView(
            id=1,
            corners_px=corners,
            places_m=0.03 * CORNERS,
            sharpness=1.0 / blur_px,
            complete=covered == 0,
            white_level=white_level,
        )
        image = np.zeros((1, 1), dtype=np.uint8)
        return EyeObservation(
            role=Role.LEFT,
            t_ns=t_ns,
            size=SIZE,
            volts_v=volts_v,
            view=view if inside else None,
            others={},
            image=image,
        )


def centre(
    mirror: Mirror, *, prediction: EyePrediction | None = None, sight: dict[str, float] | None = None
) -> EyeCentring:
    prediction = EyePrediction(RAD_PER_V) if prediction is None else prediction
    eye = EyeCentring(Role.LEFT, mirror.marker_rad, prediction, CentringSettings(), max_v=MAX_V)
    while not eye.done:
        found = mirror.sight(eye.command_v, **(sight or {}))  # type: ignore[arg-type] # of mixed types
        eye.add_observation(found, mirror.gaze(eye.command_v), asked_ns=T_NS)
    return eye


def test_a_marker_comes_to_the_middle_in_a_few_looks() -> None:
    mirror = Mirror((math.radians(4.0), math.radians(-5.0)))

    eye = centre(mirror)

    assert eye.result is not None
    assert eye.result.centred
    assert not eye.result.rim
    assert eye.looks <= 5
    off_px = (mirror.marker_rad - mirror.gaze(np.array(eye.result.volts_v))) * F_PX
    assert np.abs(off_px).max() <= CentringSettings().centred_px


def test_what_was_learnt_makes_the_next_marker_a_matter_of_two_looks() -> None:
    prediction = EyePrediction(RAD_PER_V)
    for ax_deg in (-4.0, -2.0, 0.0, 2.0, 4.0):
        centre(Mirror((math.radians(ax_deg), 0.0)), prediction=prediction)

    eye = centre(Mirror((math.radians(6.0), 0.0)), prediction=prediction)

    assert eye.looks <= 2


def test_a_marker_beyond_the_limit_but_in_view_counts_as_rim() -> None:
    mirror = Mirror((math.radians(10.0), 0.0))

    eye = centre(mirror)

    assert eye.result is not None
    assert eye.result.rim
    assert not eye.result.centred
    assert eye.result.volts_v[0] == pytest.approx(MAX_V)
    off_px = (mirror.marker_rad - mirror.gaze(np.array(eye.result.volts_v))) * F_PX
    assert abs(off_px[1]) <= CentringSettings().centred_px


def test_a_doubtful_sight_at_the_limit_is_repeated_within_it() -> None:
    mirror = Mirror((math.radians(10.0), 0.0))
    eye = EyeCentring(Role.LEFT, mirror.marker_rad, EyePrediction(RAD_PER_V), CentringSettings(), max_v=MAX_V)
    while not eye.done:
        assert np.abs(eye.command_v).max() <= MAX_V
        set_v = eye.command_v + np.sign(eye.command_v) * 1e-3  # what a DAC of 3 mV steps makes of it
        eye.add_observation(mirror.sight(set_v, covered=1), mirror.gaze(set_v), asked_ns=T_NS)

    assert eye.refusal is not None
    assert eye.refusal.startswith("beyond the volts")
    assert "marker 1 is partly seen" in eye.refusal


def test_a_marker_out_of_view_at_the_limit_is_refused_as_beyond_the_volts() -> None:
    eye = centre(Mirror((math.radians(13.0), 0.0)))

    assert eye.refusal is not None
    assert eye.refusal.startswith("beyond the volts: the gaze would take (")
    assert "±170 V are allowed" in eye.refusal
    assert eye.looks < 8


def test_the_controller_does_not_wind_up_at_its_limit() -> None:
    pid = TwoAxisPid(CentringSettings(), max_v=MAX_V)
    command = np.array([160.0, 0.0])
    for _ in range(20):
        command = pid.next(command, np.array([30.0, 0.0]))
    assert command[0] == MAX_V

    command = pid.next(command, np.array([-10.0, 0.0]))

    # One look takes the whole share back: integral 0.95 of 10 V and proportional 0.05 of the change of 40 V.
    assert command[0] == pytest.approx(MAX_V - 0.95 * 10.0 - 0.05 * 40.0)


@pytest.mark.parametrize(
    ("sight", "reason"),
    [
        ({"blur_px": 6.0}, r"blurred: the edges of marker 1 spread by 6\.0 px"),
        ({"covered": 1}, "marker 1 is partly seen: 4 of its corners"),
        ({"white_level": 254.0}, "over-exposed: the white around marker 1 is at 254 of 255"),
        ({"t_ns": T_NS - 600_000_000}, "stale: exposed 600 ms before the look"),
    ],
)
def test_a_sight_that_may_not_be_used_is_refused_with_its_reason(
    sight: dict[str, float], reason: str
) -> None:
    eye = centre(Mirror((0.05, 0.02)), sight=sight)

    assert eye.result is None
    assert eye.refusal is not None
    assert re.search(reason, eye.refusal)


def test_a_marker_that_shows_nowhere_is_searched_around_and_then_refused() -> None:
    mirror = Mirror((0.5, 0.5))  # far beside what it is aimed at: never in view
    eye = EyeCentring(
        Role.LEFT, np.array([0.05, 0.02]), EyePrediction(RAD_PER_V), CentringSettings(), max_v=MAX_V
    )
    tried = []
    while not eye.done:
        tried.append(tuple(np.rint(eye.command_v).tolist()))
        eye.add_observation(mirror.sight(eye.command_v), None, asked_ns=T_NS)

    assert len(set(tried)) == len(tried) == CentringSettings().most_looks
    assert eye.refusal == "not centred after 16 looks: its marker is not in the view"


def test_a_dead_axis_never_centres() -> None:
    mirror = Mirror((0.05, 0.02))
    mirror.dead = {0}

    eye = centre(mirror)

    assert eye.refusal is not None


def test_the_prediction_follows_saturation_and_stays_sober_where_it_knows_nothing() -> None:
    prediction = EyePrediction(RAD_PER_V)
    mirror = Mirror((0.0, 0.0))
    for x_v in np.linspace(-160.0, 160.0, 9):
        for y_v in (-160.0, -80.0, 0.0, 80.0, 160.0):
            volts = np.array([x_v, y_v])
            prediction.learn(mirror.gaze(volts), volts)

    within = np.array([97.0, 55.0])
    assert np.allclose(prediction.volts(mirror.gaze(within)), within, atol=1.0)
    far = prediction.volts(np.array([0.3, 0.0]))
    assert 200.0 < far[0] < 450.0
    assert prediction.nearest_rad(np.array([1.0, 0.0])) > 0.7


def test_a_look_alike_place_is_not_believed_and_a_supposed_one_is_forgotten() -> None:
    prediction = EyePrediction(RAD_PER_V)
    mirror = Mirror((0.0, 0.0))
    for x_v in (-60.0, 0.0, 60.0):
        volts = np.array([x_v, 10.0])
        prediction.learn(mirror.gaze(volts), volts)
    volts = np.array([80.0, 20.0])
    before = prediction.volts(np.array([0.1, 0.02]))

    assert not prediction.add_provisional(mirror.gaze(volts) + np.array([math.radians(2.2), 0.0]), volts)
    assert prediction.add_provisional(mirror.gaze(volts) + np.array([math.radians(0.1), 0.0]), volts)
    assert not np.allclose(prediction.volts(np.array([0.1, 0.02])), before)
    prediction.drop_provisional()
    assert np.allclose(prediction.volts(np.array([0.1, 0.02])), before)
