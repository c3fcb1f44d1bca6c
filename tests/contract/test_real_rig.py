"""A rig as a whole, by its rig file: `pytest tests/contract --rig FILE`; skipped without one.

Cameras alone are held to their contract in test_camera_drivers.py, by the same option. Mirrors move here, a
few volts about the middle; a pan-tilt is only asked.
"""

from collections.abc import Iterator

import pytest

from foveacam_hardware.contract import (
    FoveaError,
    MirrorVolts,
    OutOfRange,
    Role,
    StereoVolts,
)
from foveacam_hardware.rig import Rig, load_rig_config, open_rig

LITTLE_V = 5.0
DAC_STEP_V = 0.01


def both(x_v: float, y_v: float) -> StereoVolts:
    volts = MirrorVolts(x_v=x_v, y_v=y_v)
    return StereoVolts(left=volts, right=volts)


@pytest.fixture(scope="module")
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    file = request.config.getoption("--rig")
    if file is None:
        pytest.skip("no rig file was given: pytest tests/contract --rig FILE")
    with open_rig(load_rig_config(file)) as opened:
        yield opened


@pytest.fixture
def steered(rig: Rig) -> Iterator[Rig]:
    """The rig with its mirrors on; parked afterwards."""
    rig.mirrors.enable()
    yield rig
    rig.mirrors.park()


def test_every_device_that_the_file_names_is_there(rig: Rig) -> None:
    assert rig.problems == ()


def test_no_two_cameras_are_the_same_device(rig: Rig) -> None:
    assert len({camera.info.serial for camera in rig.cameras}) == len(Role)


def test_the_controller_answers_and_says_who_it_is(rig: Rig) -> None:
    assert rig.mirrors.info.version
    assert 0.0 < rig.mirrors.ping() < 100.0


def test_mirrors_go_where_they_are_sent(steered: Rig) -> None:
    for x_v, y_v in ((LITTLE_V, 0.0), (0.0, -LITTLE_V), (0.0, 0.0)):
        taken = steered.mirrors.steer(both(x_v, y_v))

        assert taken.left.x_v == pytest.approx(x_v, abs=DAC_STEP_V)
        assert taken.right.y_v == pytest.approx(y_v, abs=DAC_STEP_V)
    steered.mirrors.ping()
    assert steered.mirrors.state.fault is None


def test_volts_beyond_the_limits_are_refused_and_move_nothing(steered: Rig) -> None:
    before = steered.mirrors.state.volts
    with pytest.raises(OutOfRange):
        steered.mirrors.steer(both(2.0 * steered.mirrors.limits.max_v, 0.0))

    assert steered.mirrors.state.volts == before


def test_one_pulse_exposes_both_foveae_and_the_wide_frame_is_no_older(steered: Rig) -> None:
    """The trigger cables, the strobe cables and every clock at once."""
    for k in range(3):
        sighting = steered.head.look(both(LITTLE_V * k, 0.0))

        assert sighting.left.t_ns == pytest.approx(sighting.right.t_ns, abs=1_000_000)
        assert sighting.wide.t_ns >= sighting.left.t_ns - 1_000_000
        assert sighting.left.image.shape == sighting.right.image.shape


def test_left_and_right_have_the_same_settings(rig: Rig) -> None:
    left, right = rig.left.settings, rig.right.settings

    assert left.exposure_ns == right.exposure_ns
    assert left.gain_db == pytest.approx(right.gain_db, abs=0.01)
    assert left.pixel_format is right.pixel_format


def test_a_pan_tilt_says_where_it_may_go(rig: Rig) -> None:
    if rig.pan_tilt is None:
        pytest.skip("the rig has none")
    limits = rig.pan_tilt.limits

    assert limits.pan_min_rad < limits.pan_max_rad
    assert limits.tilt_min_rad < limits.tilt_max_rad
    assert rig.pan_tilt.state.connected


def test_a_camera_without_a_trigger_says_what_to_check(rig: Rig) -> None:
    with pytest.raises(FoveaError, match=r"camera left: no trigger arrived in time; check the trigger cable"):
        rig.left.read(timeout_ms=200.0)
