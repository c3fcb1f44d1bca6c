"""Noise, blur and quantisation of the simulated sensor."""

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import InvalidInput
from foveacam_hardware.sim.render import SensorExposure, expose

F32 = NDArray[np.float32]
KEY = (7, 1, 42)


def grey(level: float, *, height: int = 200, width: int = 720) -> F32:
    return np.full((height, width), level, np.float32)


@pytest.mark.parametrize(
    ("gain", "well_e", "bits"), [(1.0, 10_700.0, 12), (2.0, 10_700.0, 10), (1.0, 2000.0, 8)]
)
def test_variance_grows_with_the_mean_as_photons_do(gain: float, well_e: float, bits: int) -> None:
    exposure = SensorExposure(gain=gain, full_well_e=well_e, bits=bits)
    levels = np.linspace(0.05, 0.9 / gain, 10)

    counts = [expose(grey(level), exposure, (1, 2, k)).astype(np.float64) for k, level in enumerate(levels)]

    slope, _ = np.polyfit([c.mean() for c in counts], [c.var() for c in counts], 1)
    assert slope == pytest.approx(gain * (2**bits - 1) / well_e, rel=0.02)


def test_read_noise_adds_its_own_variance() -> None:
    def variance(read_noise_e: float) -> float:
        exposure = SensorExposure(read_noise_e=read_noise_e, bits=12)
        return float(expose(grey(0.1), exposure, KEY).astype(np.float64).var())

    assert variance(40.0) - variance(0.0) == pytest.approx((40.0 * 4095 / 10_700) ** 2, rel=0.03)


@pytest.mark.parametrize("read_noise_e", [0.0, 40.0])
def test_a_binned_pixel_has_a_quarter_of_the_variance_and_the_mean_of_one(read_noise_e: float) -> None:
    single = SensorExposure(read_noise_e=read_noise_e, bits=12)
    binned = SensorExposure(read_noise_e=read_noise_e, bits=12, binning=2)
    one, four = (expose(grey(0.4), exposure, KEY).astype(np.float64) for exposure in (single, binned))
    electrons = 0.4 * 10_700.0
    expected = (electrons + read_noise_e**2) / 4.0 * (4095 / 10_700) ** 2 + 1.0 / 12.0

    assert four.mean() == pytest.approx(one.mean(), abs=0.2)
    assert four.var() == pytest.approx(expected, rel=0.02)
    assert one.var() / four.var() == pytest.approx(4.0, rel=0.03)


def test_a_lens_blurs_a_binned_picture_by_half_as_many_pixels() -> None:
    point = np.zeros((41, 41), np.float32)
    point[20, 20] = 1.0
    exposure = SensorExposure(psf_sigma_px=1.4, bits=12, binning=2, full_well_e=1e12)
    spot = expose(point, exposure, KEY).astype(np.float64)
    x = np.arange(41) - 20.0

    assert np.sqrt((spot.sum(axis=0) * x**2).sum() / spot.sum()) == pytest.approx(0.7, abs=0.02)


def test_the_mean_is_that_of_the_light() -> None:
    exposure = SensorExposure(exposure_s=0.004, reference_s=0.01, gain=1.5, bits=12)

    counts = expose(grey(0.5), exposure, KEY).astype(np.float64)

    assert counts.mean() == pytest.approx(0.5 * 0.4 * 1.5 * 4095, abs=0.5)


def test_noise_depends_on_seed_camera_and_frame_alone() -> None:
    exposure = SensorExposure(bits=12)
    one = expose(grey(0.5), exposure, KEY)

    assert (one == expose(grey(0.5), exposure, KEY)).all()
    for other in ((8, 1, 42), (7, 2, 42), (7, 1, 43)):
        difference = expose(grey(0.5), exposure, other).astype(np.float64) - one
        # Independent noise: twice the variance of one picture.
        assert difference.var() == pytest.approx(2 * one.astype(np.float64).var(), rel=0.05)


def test_noise_of_a_row_does_not_depend_on_the_others() -> None:
    exposure = SensorExposure(bits=12)
    bright_below = grey(0.5)
    bright_below[100:] = 0.9

    assert (expose(grey(0.5), exposure, KEY)[:100] == expose(bright_below, exposure, KEY)[:100]).all()


def test_neighbouring_pixels_rows_and_channels_are_independent() -> None:
    counts = expose(np.full((400, 400, 3), 0.5, np.float32), SensorExposure(bits=12), KEY).astype(np.float64)
    noise = counts - counts.mean()
    variance = noise.var()

    assert abs((noise[:, 1:] * noise[:, :-1]).mean()) < 0.01 * variance
    assert abs((noise[1:] * noise[:-1]).mean()) < 0.01 * variance
    assert abs((noise[..., 0] * noise[..., 1]).mean()) < 0.01 * variance


@pytest.mark.parametrize("sigma_px", [0.6, 1.4, 3.0])
def test_blur_is_a_gaussian_of_the_width_asked_for_and_keeps_the_light(sigma_px: float) -> None:
    point = np.zeros((61, 61), np.float32)
    point[30, 30] = 2.0
    exposure = SensorExposure(psf_sigma_px=sigma_px, bits=12, full_well_e=1e9, read_noise_e=0.0)

    spot = expose(point, exposure, KEY).astype(np.float64) / 4095

    x = np.arange(61) - 30
    assert spot.sum() == pytest.approx(2.0, rel=0.02)
    assert np.sqrt((spot.sum(axis=0) * x**2).sum() / spot.sum()) == pytest.approx(
        sigma_px, rel=0.03, abs=0.03
    )
    assert np.sqrt((spot.sum(axis=1) * x**2).sum() / spot.sum()) == pytest.approx(
        sigma_px, rel=0.03, abs=0.03
    )


def test_blur_does_not_darken_the_edges_nor_mix_the_channels() -> None:
    image = np.zeros((40, 50, 3), np.float32)
    image[..., 1] = 0.5
    exposure = SensorExposure(psf_sigma_px=1.4, bits=12, full_well_e=1e9, read_noise_e=0.0)

    counts = expose(image, exposure, KEY)

    assert (np.abs(counts[..., 1].astype(int) - 2048) <= 1).all()
    assert (counts[..., [0, 2]] == 0).all()


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (10, np.uint16), (12, np.uint16)])
def test_bright_light_saturates_at_full_scale(bits: int, kind: type) -> None:
    counts = expose(grey(5.0), SensorExposure(bits=bits, gain=1.2), KEY)

    assert counts.dtype == kind
    assert (counts == 2**bits - 1).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"bits": 9}, "bits"),
        ({"gain": 0.0}, "gain"),
        ({"exposure_s": -1.0}, "exposure_s"),
        ({"full_well_e": float("inf")}, "full_well_e"),
        ({"read_noise_e": -1.0}, "read_noise_e"),
        ({"psf_sigma_px": 9.0}, "psf_sigma_px"),
    ],
)
def test_an_exposure_that_no_sensor_has_is_refused_by_name(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        SensorExposure(**arguments)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.parametrize(
    "radiance", [np.zeros((4, 4)), np.zeros(4, np.float32), np.zeros((2, 40_000, 3), np.float32)]
)
def test_radiance_of_another_kind_is_refused(radiance: F32) -> None:
    with pytest.raises(InvalidInput, match="expose"):
        expose(radiance, SensorExposure(), KEY)
