"""Somebody who turns the simulated rig by hand: after a while, at a pace, not quite there."""

import math

import numpy as np
import pytest

from foveacam_hardware.contract import PanTiltPose, VirtualClock
from foveacam_hardware.drivers.positioners.manual import ManualPanTilt
from foveacam_hardware.pan_tilt_config import OperatorConfig
from foveacam_hardware.sim.pan_tilt import OPERATOR_REACTION_S, Operator, TurningHistory

CONFIG = OperatorConfig(delay_s=0.5, speed_deg_s=10.0, error_deg=0.2)
NS_PER_S = 1_000_000_000
BEGIN_NS = 5 * NS_PER_S
WANTED = PanTiltPose(pan_rad=math.radians(-20.0), tilt_rad=math.radians(5.0))


class Turned:
    """A rig that is turned by hand, and where it points."""

    def __init__(self) -> None:
        self.clock = VirtualClock(BEGIN_NS)
        self.hands = TurningHistory()
        self.pan_tilt = ManualPanTilt(on_wanted=Operator(self.hands, self.clock, CONFIG, seed=1).turn_to)
        self.pan_tilt.connect()

    def after(self, seconds: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.array(self.hands.bearing_deg(BEGIN_NS + round(seconds * NS_PER_S)))


@pytest.fixture
def turned() -> Turned:
    found = Turned()
    found.pan_tilt.move_to(WANTED)
    return found


def test_operator_thinks_before_turning(turned: Turned) -> None:
    assert turned.after(CONFIG.delay_s).tolist() == [0.0, 0.0]
    assert np.linalg.norm(turned.after(CONFIG.delay_s + 0.5)) > 1.0


def test_turn_ends_near_where_it_was_wanted_and_not_quite_there(turned: Turned) -> None:
    missed = turned.after(20.0) - np.array([-20.0, 5.0])
    assert 0.0 < np.abs(missed).max() <= 2.0 * CONFIG.error_deg
    assert turned.after(30.0).tolist() == turned.after(20.0).tolist()


def test_operator_keeps_the_pace(turned: Turned) -> None:
    way = np.array([turned.after(0.05 * k) for k in range(100)])
    speeds_deg_s = np.linalg.norm(np.diff(way, axis=0), axis=1) / 0.05
    assert speeds_deg_s.max() == pytest.approx(CONFIG.speed_deg_s, rel=1e-3)
    assert np.abs(np.diff(way, axis=0)).max() < 0.6  # no jump


def test_operator_lets_go_when_nothing_is_wanted_any_more(turned: Turned) -> None:
    turned.clock.sleep_until_ns(BEGIN_NS + NS_PER_S)
    turned.pan_tilt.hold()
    assert turned.pan_tilt.state.wanted is None
    held = turned.after(1.0 + OPERATOR_REACTION_S)
    assert turned.after(20.0).tolist() == held.tolist()
    assert np.linalg.norm(held) < 15.0


def test_newest_wish_counts(turned: Turned) -> None:
    turned.clock.sleep_until_ns(BEGIN_NS + NS_PER_S)
    turned.pan_tilt.move_to(PanTiltPose(pan_rad=0.0, tilt_rad=0.0))
    assert np.abs(turned.after(30.0)).max() <= 2.0 * CONFIG.error_deg
