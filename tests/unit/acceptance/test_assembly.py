"""Mistakes in the assembly of the simulated rig: each does what its key says, the default nothing."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from foveacam_hardware.contract import Role
from foveacam_hardware.sim.assembly import delivered_image, is_lost, mount_turn_rad, wired_codes
from foveacam_hardware.simulated_assembly import CameraAssembly, FoveaAssembly, SimulatedAssembly

CODES = (1, 2, 3, 4, 5, 6, 7, 8)
PICTURE = np.random.default_rng(3).integers(40, 200, (60, 80), dtype=np.uint8)


def delivered(**given: object) -> np.ndarray:
    assembly = CameraAssembly.model_validate(given)
    return np.asarray(delivered_image(PICTURE, assembly, Role.LEFT, bits=8, binning=1, seq=7))


def test_a_sound_assembly_changes_nothing() -> None:
    sound = SimulatedAssembly()
    assert wired_codes(CODES, sound) == CODES
    assert delivered_image(PICTURE, sound.left, Role.LEFT, bits=8, binning=1, seq=7) is PICTURE
    assert not any(is_lost(sound.left, Role.LEFT, seq) for seq in range(1000))
    assert not mount_turn_rad(sound.left, Role.LEFT, 10**12).any()
    assert [sound.optics_of(role) for role in Role] == list(Role)


@pytest.mark.parametrize(
    ("given", "codes"),
    [
        ({"exchanged_mirrors": True}, (5, 6, 7, 8, 1, 2, 3, 4)),
        ({"left": {"exchanged_axes": True}}, (3, 4, 1, 2, 5, 6, 7, 8)),
        ({"right": {"reversed_axes": ["y"]}}, (1, 2, 3, 4, 5, 6, 8, 7)),
        ({"left": {"exchanged_axes": True, "reversed_axes": ["x"]}}, (4, 3, 1, 2, 5, 6, 7, 8)),
    ],
)
def test_leads_are_exchanged(given: dict[str, object], codes: tuple[int, ...]) -> None:
    assert wired_codes(CODES, SimulatedAssembly.model_validate(given)) == codes


def test_pictures_are_reversed_or_rotated() -> None:
    np.testing.assert_array_equal(delivered(mirrored=True), PICTURE[:, ::-1])
    np.testing.assert_array_equal(delivered(upside_down=True), PICTURE[::-1, ::-1])


def test_light_is_lost_everywhere_or_in_the_corners() -> None:
    assert delivered(transmission=0.5).mean() == pytest.approx(PICTURE.mean() / 2, rel=0.01)
    darkened = delivered(vignetting=0.6).astype(float) / PICTURE
    assert darkened[30, 40] == pytest.approx(1.0, abs=0.02)
    assert darkened[0, 0] == pytest.approx(0.4, abs=0.03)


def test_levels_are_offset_noisy_hot_or_coarse() -> None:
    assert (delivered(black_level=9.0).astype(int) - PICTURE == 9).all()
    assert np.std(delivered(noise=4.0).astype(float) - PICTURE) == pytest.approx(4.0, rel=0.1)
    assert np.mean(delivered(hot_fraction=0.01) == 255) == pytest.approx(0.01, abs=0.006)
    assert (delivered(lost_bits=4) % 16 == 0).all()


def test_a_mosaic_alternates() -> None:
    red, blue = (delivered(bayer_as_grey=True)[y::2, x::2].mean() for y, x in ((0, 0), (1, 1)))
    green = delivered(bayer_as_grey=True)[0::2, 1::2].mean()
    assert red < 0.8 * green
    assert blue < 0.9 * green


def test_a_share_of_the_frames_is_lost_the_same_ones_each_time() -> None:
    assembly = CameraAssembly(lost_frames=0.1)
    lost = [is_lost(assembly, Role.WIDE, seq) for seq in range(2000)]
    assert np.mean(lost) == pytest.approx(0.1, abs=0.03)
    assert lost == [is_lost(assembly, Role.WIDE, seq) for seq in range(2000)]


def test_a_loose_mount_jumps_and_a_creeping_one_turns_steadily() -> None:
    loose = FoveaAssembly(loose_mount_deg=0.02)
    turns = np.array([mount_turn_rad(loose, Role.LEFT, t * 10**9) for t in range(300)])
    assert np.rad2deg(turns[:, :2]).std() == pytest.approx(0.02, rel=0.1)
    creeping = FoveaAssembly(mount_drift_deg_per_min=0.3)
    assert math.degrees(mount_turn_rad(creeping, Role.LEFT, 120 * 10**9)[1]) == pytest.approx(0.6)


def test_exchanged_cameras_send_each_other_s_pictures() -> None:
    assembly = SimulatedAssembly(exchanged_cameras=["wide", "right"])
    assert assembly.optics_of(Role.WIDE) is Role.RIGHT
    assert assembly.optics_of(Role.RIGHT) is Role.WIDE
    assert assembly.optics_of(Role.LEFT) is Role.LEFT


@pytest.mark.parametrize("given", [{"left": {"lost_bits": 9}}, {"exchanged": True}, {"drive_scale": 1.5}])
def test_a_mistake_that_does_not_exist_is_refused(given: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        SimulatedAssembly.model_validate(given)
