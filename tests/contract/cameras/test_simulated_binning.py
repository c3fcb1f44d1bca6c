"""Binning 2 of the simulated cameras against full-size frames averaged 2x2, in virtual time."""

from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Binning,
    CameraSettings,
    Frame,
    OutOfRange,
    PixelFormat,
    Role,
    VirtualClock,
)
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.cameras import SimCamera, default_settings
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.render.tiles import render_tiles
from foveacam_hardware.sim.world import World

F64 = NDArray[np.float64]
START_NS = 1_000_000_000
DEEP = PixelFormat.MONO12
FULL_WELL_E, READ_NOISE_E, TOP = 10_700.0, 2.5, 4095
"""The IMX273's, and the largest count of 12 bits."""


@pytest.fixture(scope="module")
def scene() -> Iterator[AnimatedScene]:
    scene = AnimatedScene("bench")
    yield scene
    scene.close()


class Bench:
    """One streaming camera of a rig that looks at the scene."""

    def __init__(self, scene: AnimatedScene, role: Role) -> None:
        self.clock = VirtualClock(START_NS)
        self.world = World(scene=scene, preset=RIG120, seed=0, clock=self.clock)
        self.camera = SimCamera(self.world, role, clock=self.clock)
        self.camera.connect()
        self.camera.start()

    def configure(self, *, binning: Binning, pixel_format: PixelFormat = DEEP) -> CameraSettings:
        now = self.camera.settings
        return self.camera.configure(replace(now, binning=binning, pixel_format=pixel_format))

    def frame(self) -> Frame:
        """Return the next frame; a fovea is triggered."""
        self.clock.sleep_until_ns(self.clock.now_ns() + 20_000_000)
        self.world.trigger(self.clock.now_ns(), pulse_us=1000, cameras=6)
        return self.camera.read()

    def pair(self, binning: Binning) -> tuple[F64, F64]:
        """Return two frames of the same scene."""
        self.configure(binning=binning)
        return self.frame().image.astype(np.float64), self.frame().image.astype(np.float64)


def mean_2x2(image: F64) -> F64:
    return np.asarray(image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2).mean(axis=(1, 3)))


def shift_px(a: F64, b: F64) -> tuple[float, float]:
    """Return the small shift (x, y) from one picture to another by least squares, with gain and offset.

    The slopes are those of the mean of both, blurred, so that noise does not shorten the shift.
    """
    down, along = np.gradient(cv2.GaussianBlur(0.5 * (a + b), (0, 0), 1.0))
    columns = np.stack([a.ravel(), np.ones(a.size), along.ravel(), down.ravel()], axis=1)
    _, _, x, y = np.linalg.lstsq(columns, b.ravel(), rcond=None)[0]
    return float(-x), float(-y)


def binned_noise(image: F64) -> float:
    """Return the standard deviation that the mean of four pixels has: shot and read noise, rounding."""
    electrons = image * FULL_WELL_E / TOP
    shot_and_read = (electrons + READ_NOISE_E**2) / 4.0 * (TOP / FULL_WELL_E) ** 2
    return float(np.sqrt(shot_and_read.mean() + 1.0 / 12.0))


@pytest.mark.parametrize("role", list(Role), ids=str)
def test_noise_and_mean_are_those_of_a_full_size_frame_averaged(scene: AnimatedScene, role: Role) -> None:
    bench = Bench(scene, role)
    full, half = bench.pair(1), bench.pair(2)
    expected = binned_noise(half[0])
    noise = np.std(half[0] - half[1]) / np.sqrt(2.0)
    noise_of_mean = np.std(mean_2x2(full[0]) - mean_2x2(full[1])) / np.sqrt(2.0)
    model = 0.5 * (half[0] + half[1]) - 0.5 * (mean_2x2(full[0]) + mean_2x2(full[1]))

    assert half[0].shape == (540, 720)
    assert noise / expected == pytest.approx(1.0, abs=0.02)
    assert noise / noise_of_mean == pytest.approx(1.0, abs=0.02)
    assert (np.std(full[0] - full[1]) / np.std(half[0] - half[1])) ** 2 == pytest.approx(4.0, rel=0.03)
    assert abs(float(model.mean())) < 0.05 * expected
    # Both pairs' noise alone gives the expected value; what a coarser texture filter leaves out comes on top.
    assert 0.97 * expected <= float(np.std(model)) <= (2.6 if role is Role.WIDE else 1.35) * expected


def test_the_matcher_finds_a_tenth_of_a_pixel() -> None:
    x, y = np.meshgrid(np.arange(240.0), np.arange(180.0))
    a, b = (100.0 * np.sin((x - dx) / 3.0) * np.cos((y - dx) / 4.0) for dx in (0.0, 0.1))

    assert shift_px(a, b) == pytest.approx((0.1, 0.1), abs=0.02)


@pytest.mark.parametrize("role", list(Role), ids=str)
def test_pixels_look_where_the_middle_of_their_four_does(scene: AnimatedScene, role: Role) -> None:
    bench = Bench(scene, role)
    full, half = mean_2x2(bench.pair(1)[0]), bench.pair(2)[0]
    parts = [
        (full[y : y + 180, x : x + 240], half[y : y + 180, x : x + 240])
        for y in range(0, 540, 180)
        for x in range(0, 720, 240)
    ]
    shifts_px = 2.0 * np.abs([shift_px(a, b) for a, b in parts if a.std() > 0.04 * TOP])  # of the sensor

    assert 2.0 * np.hypot(*shift_px(full, half)) < 0.02
    assert len(shifts_px) >= 5
    assert (np.median(shifts_px, axis=0) < 0.02).all()
    assert shifts_px.max() < 0.08  # an upright edge is placed by 4x4 samples of a pixel, whatever its size


def test_frames_state_their_binning_and_numbers_go_on_when_it_is_switched(scene: AnimatedScene) -> None:
    bench = Bench(scene, Role.WIDE)
    frames = [bench.frame()]
    for binning in (2, 1):
        bench.configure(binning=binning, pixel_format=PixelFormat.RGB8)
        with_age = bench.camera.latest(max_age_ms=10_000.0)
        frames.append(with_age)

    assert [frame.binning for frame in frames] == [1, 2, 1]
    assert [frame.image.shape for frame in frames] == [(1080, 1440, 3), (540, 720, 3), (1080, 1440, 3)]
    assert frames[0].seq < frames[1].seq < frames[2].seq
    assert {frame.epoch for frame in frames} == {1}


def test_a_frozen_camera_repeats_no_picture_of_another_size(scene: AnimatedScene) -> None:
    bench = Bench(scene, Role.LEFT)
    bench.frame()
    bench.world.faults.frozen.add(Role.LEFT)
    bench.configure(binning=2)
    first, second = bench.frame(), bench.frame()

    assert first.image.shape == (540, 720)
    assert second.image is first.image


def test_a_binned_sensor_is_read_faster(scene: AnimatedScene) -> None:
    bench = Bench(scene, Role.LEFT)
    latencies_ms = []
    for binning in (1, 2):
        bench.configure(binning=binning, pixel_format=PixelFormat.MONO8)
        frame = bench.frame()
        latencies_ms.append((bench.clock.now_ns() - frame.t_ns - frame.exposure_ns / 2) / 1e6)

    assert latencies_ms == pytest.approx([4.38, 2.27], abs=0.01)
    assert bench.camera.ranges.frame_rate_hz.high == 439.0


def test_the_rate_is_no_higher_than_12_bits_are_read_out(scene: AnimatedScene) -> None:
    quick = replace(default_settings(Role.WIDE), exposure_ns=1_000_000, frame_rate_hz=200.0)
    wide = Bench(scene, Role.WIDE).camera

    assert wide.configure(quick).frame_rate_hz == 200.0
    taken = wide.configure(replace(quick, pixel_format=PixelFormat.MONO12))
    assert taken.frame_rate_hz == pytest.approx(1e3 / 5.984, rel=1e-3)  # 1122 lines of 396 / 74.25 MHz


def test_a_rate_of_binning_2_is_refused_at_1_and_nothing_changes(scene: AnimatedScene) -> None:
    bench = Bench(scene, Role.WIDE)
    quick = replace(default_settings(Role.WIDE), exposure_ns=1_000_000, frame_rate_hz=400.0)
    taken = bench.camera.configure(replace(quick, binning=2))
    with pytest.raises(OutOfRange, match=r"camera wide: frame rate 400 Hz is outside 0\.1 to 228 Hz"):
        bench.camera.configure(quick)

    assert bench.camera.settings == taken
    assert taken.binning == 2


def test_no_kernel_is_compiled_anew_for_another_size(scene: AnimatedScene) -> None:
    bench = Bench(scene, Role.LEFT)
    bench.pair(1)
    before = len(render_tiles.signatures)
    bench.pair(2)

    assert len(render_tiles.signatures) == before
