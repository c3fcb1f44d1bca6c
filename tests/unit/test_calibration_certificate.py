"""The factory certificates against the simulation's truth, at volts, pixels and depths not fitted."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

import foveacam_server
from foveacam_hardware.contract import Role
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_server.bench import factory
from foveacam_server.bench.certificate_check import (
    distance_error_m,
    gaze_errors_rad,
    random_looks,
    rectification_errors_px,
    wide_errors_px,
)

FOLDER = Path(foveacam_server.__file__).parent / "factory"
EYES = (Role.LEFT, Role.RIGHT)


@pytest.fixture(scope="module", params=["rig120", "paper"])
def preset(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def truth(preset: str) -> Iterator[Truth]:
    with open_simulated(preset=preset, inline=True) as rig:
        assert rig.truth is not None
        yield rig.truth


@pytest.fixture(scope="module")
def calibration(preset: str) -> Calibration:
    return load_calibration(FOLDER / f"sim-{preset}.json")


@pytest.mark.parametrize("role", EYES)
def test_gaze_is_within_the_stated_error(calibration: Calibration, truth: Truth, role: Role) -> None:
    errors = gaze_errors_rad(calibration, truth, role, rng=np.random.default_rng(11), count=300)
    rms = np.sqrt(np.mean(errors**2, axis=0))
    # One draw of some 36 coefficients: their mean square scatters by sqrt(2/36), 24 %; 1.3 is two of those.
    assert (rms < 1.3 * np.array(calibration.eye(role).mirror.sigma_rad)).all()
    assert np.rad2deg(rms).max() < 0.002  # sqrt(36 / 882) of the 0.005 deg of one measurement, and some


@pytest.mark.parametrize("distance_m", [2.0, 6.0, 25.0])
def test_rectified_pixels_are_where_a_virtual_pinhole_sees_them(
    calibration: Calibration, truth: Truth, distance_m: float
) -> None:
    rng = np.random.default_rng(12)
    looks = random_looks(calibration, distance_m=distance_m, rng=rng, count=25)
    errors = np.array(
        [rectification_errors_px(calibration, truth, look, rng=rng, count=12) for look in looks]
    )
    within_image = errors - errors.mean(axis=2, keepdims=True)
    # 60 coefficients from 35 000 coordinates of 0.3 px would leave 0.012 px; what order 3 lacks doubles it.
    assert np.sqrt(np.mean(within_image**2)) < 0.04
    shared_px = np.hypot(calibration.pose_sigma_px(distance_m), calibration.epipolar_sigma_px(distance_m)) / 2
    assert np.sqrt(np.mean(errors**2)) < 1.5 * shared_px
    rows = errors[:, 0, :, 1] - errors[:, 1, :, 1]
    assert np.sqrt(np.mean(rows**2)) < 1.5 * calibration.epipolar_sigma_px(distance_m)


@pytest.mark.parametrize("distance_m", [2.0, 5.0, 10.0, 20.0])
def test_distances_are_within_the_stated_error(
    calibration: Calibration, truth: Truth, distance_m: float
) -> None:
    looks = random_looks(calibration, distance_m=distance_m, rng=np.random.default_rng(13), count=40)
    found = np.array([distance_error_m(calibration, truth, look) for look in looks])
    normalised = found[:, 0] / found[:, 1]
    assert np.mean(np.abs(normalised) < 3.0) >= 0.95
    assert np.sqrt(np.mean(normalised**2)) > 0.3  # nor is the statement timid


def test_the_wide_lens_is_known_to_a_fraction_of_a_pixel(calibration: Calibration, truth: Truth) -> None:
    errors = wide_errors_px(calibration, truth, rng=np.random.default_rng(14), count=400)
    # 40 boards of 108 corners, 0.05 px each: the centre, bound up with tilt, is the weakest at about 0.1 px.
    assert np.sqrt(np.mean(errors**2)) < 0.3
    # The focal length is known to about 1e-4, 0.09 px in a corner, and the lens obeys another law.
    assert np.abs(errors - errors.mean(axis=0)).max() < 0.2


def test_the_script_certifies_a_rig_and_measures_rather_than_copies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(factory, "GRID", 9)
    monkeypatch.setattr(factory, "WIDE_VIEWS", 15)
    monkeypatch.setattr(factory, "PRESETS", ("rig120",))
    created = datetime(2026, 1, 31, 12, tzinfo=UTC)
    figures = factory.run(folder=tmp_path, created=created)
    made = load_calibration(tmp_path / "sim-rig120.json")
    assert (made.rig_id, made.origin, made.created) == ("sim-rig120", "factory", created)
    # sqrt(36 / 162) of the 0.005 deg of one measurement at the most; the noise must show, too.
    assert 0.0005 < figures["left_gaze_rms_deg"] < 0.0035
    assert 0.005 < figures["rectification_within_image_rms_px_at_5_m"] < 0.1
    assert 0.005 < figures["wide_rms_px"] < 0.6


def test_judging_a_certificate_writes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a quick run must not write")

    monkeypatch.setattr(factory, "save_calibration", refuse)
    assert factory.run(quick=True)["left_gaze_rms_deg"] < 0.002
