"""The check of a calibration on the simulated rig: a good one passes, what is wrong with a bad one shows."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from tests.support.scenes.marker_room import make_grey

from foveacam_hardware.contract import PARKED, InvalidInput
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.fit.check import CheckResult, CheckSettings, check_calibration
from foveacam_pipeline.calibrate.fit.check_pictures import check_pictures
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

QUICK = CheckSettings(columns=4, rows=3)
LOWERED_PX = 3.0


@pytest.fixture(scope="module")
def rig() -> Iterator[Rig]:
    with open_simulated("calibration", inline=True) as opened:
        make_grey(opened)
        opened.mirrors.enable()
        opened.head.look(PARKED)
        yield opened


@pytest.fixture(scope="module")
def calibration(rig: Rig) -> Calibration:
    return load_calibration(SHIPPED / f"{rig.rig_id}.json")


@pytest.fixture(scope="module")
def result(rig: Rig, calibration: Calibration) -> CheckResult:
    return check_calibration(rig.head, calibration, clock=rig.clock, settings=QUICK)


def lowered(calibration: Calibration) -> Calibration:
    """The same with the left eye's angles wrong by three fovea px, downwards."""
    mirror = calibration.left.mirror
    coefficients = mirror.forward.coefficients.copy()
    coefficients[0, 1] += LOWERED_PX / calibration.fovea_f_px
    wrong = replace(mirror, forward=replace(mirror.forward, coefficients=coefficients))
    return replace(calibration, left=replace(calibration.left, mirror=wrong))


def test_a_good_calibration_leaves_little_all_over_the_field(result: CheckResult) -> None:
    assert result.poses >= 10
    assert result.epipolar_rms_px is not None
    assert result.epipolar_rms_px < 0.8  # the certificate's own 0.4 px and the drift since the world began
    assert result.pointing_rms_px is not None
    assert result.pointing_rms_px < 1.5 * result.pointing_sigma_px
    gazes = np.rad2deg([match.gaze_rad for match in result.rows])
    assert np.ptp(gazes, axis=0).min() > 8.0


def test_an_eye_that_is_three_pixels_off_shows_in_the_rows(
    rig: Rig, calibration: Calibration, result: CheckResult
) -> None:
    fewer = replace(QUICK, columns=3, rows=2)
    found = check_calibration(rig.head, lowered(calibration), clock=rig.clock, settings=fewer)
    shift = np.mean([m.rows_px for m in found.rows]) - np.mean([m.rows_px for m in result.rows])
    assert shift == pytest.approx(LOWERED_PX, abs=0.2)


def test_the_foveae_fit_the_wide_view_they_are_laid_into(rig: Rig, result: CheckResult) -> None:
    wide = gray(to_uint8(rig.head.wide())).astype(np.float64)
    laid = result.mosaic[:, :, 1].astype(np.float64)
    assert laid.shape == wide.shape[:2]
    changed = np.abs(laid - wide) > 3.0  # more than the wide camera's noise
    assert 0.03 < changed.mean() < 0.9
    assert np.corrcoef(laid[changed], wide[changed])[0, 1] > 0.8


def test_swept_places_are_left_out(rig: Rig, calibration: Calibration, result: CheckResult) -> None:
    everywhere = np.deg2rad([(x, y) for x in np.arange(-12, 12, 0.2) for y in np.arange(-10, 10, 0.2)])
    with pytest.raises(InvalidInput, match="0 places"):
        check_calibration(rig.head, calibration, clock=rig.clock, settings=QUICK, swept_rad=everywhere)


def test_pictures_of_a_check_are_png(calibration: Calibration, result: CheckResult) -> None:
    pictures = check_pictures(result, calibration)
    assert set(pictures) == {"epipolar", "overlay", "anaglyph_before", "anaglyph_after"}
    for draw in pictures.values():
        assert draw().startswith(b"\x89PNG\r\n")
