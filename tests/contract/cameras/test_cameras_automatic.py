"""The simulated cameras expose by themselves: pictures get well exposed, are honestly told, every time."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import (
    AutoMode,
    Camera,
    CameraSettings,
    Frame,
    PixelFormat,
    Role,
    VirtualClock,
)
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.cameras import SimCamera
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.world import World

MS = 1_000_000
SCENE = """
format = "foveacam-scene"
version = 1
[materials]
wall = { kind = "noise", color = "#404040", accent = "#c0c0c0" }
[[objects]]
name = "wall"
shape = "quad"
material = "wall"
position_m = [0, 0, 5]
size_m = [9, 9]
"""
DARK = CameraSettings(exposure_ns=MS, pixel_format=PixelFormat.MONO8, exposure_auto=AutoMode.CONTINUOUS)
GOOD = pytest.approx(0.5, rel=0.06)


@dataclass
class Bench:
    """One camera before a wall."""

    camera: Camera
    world: World
    clock: VirtualClock

    def frame(self) -> Frame:
        """Return the next frame; a triggered camera is triggered for it."""
        if self.camera.settings.triggered:
            self.clock.sleep_until_ns(self.clock.now_ns() + 50 * MS)
            self.world.trigger(self.clock.now_ns(), pulse_us=1000, cameras=6)
        return self.camera.read()

    def frames(self, n: int) -> list[Frame]:
        return [self.frame() for _ in range(n)]


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AnimatedScene]:
    path: Path = tmp_path_factory.mktemp("scene") / "wall.toml"
    path.write_text(SCENE, encoding="utf-8")
    stage = AnimatedScene(path)
    yield stage
    stage.close()


@pytest.fixture
def begin(stage: AnimatedScene) -> Callable[[Role, CameraSettings], Bench]:
    """Return a camera that runs with settings."""

    def begin_(role: Role, settings: CameraSettings) -> Bench:
        clock = VirtualClock(1_000_000_000)
        world = World(scene=stage, preset=RIG120, seed=0, clock=clock)
        camera = SimCamera(world, role, clock=clock)
        camera.connect()
        camera.configure(settings)
        camera.start()
        return Bench(camera, world, clock)

    return begin_


Begin = Callable[[Role, CameraSettings], Bench]


def level(frame: Frame) -> float:
    return float(frame.image.mean()) / 255.0


@pytest.mark.parametrize(("role", "triggered"), [(Role.WIDE, False), (Role.LEFT, True)])
def test_a_dark_picture_gets_bright_enough_and_stays_so(begin: Begin, role: Role, triggered: bool) -> None:
    bench = begin(role, replace(DARK, triggered=triggered))
    frames = bench.frames(8)

    assert level(frames[0]) < 0.15
    assert level(frames[-1]) == GOOD
    assert len({frame.exposure_ns for frame in frames[-3:]}) == 1  # noise does not move it
    assert bench.camera.settings.exposure_ns == frames[-1].exposure_ns
    assert bench.camera.settings.exposure_auto is AutoMode.CONTINUOUS


def test_a_picture_that_is_white_all_over_gets_darker(begin: Begin) -> None:
    bench = begin(Role.WIDE, replace(DARK, exposure_ns=33 * MS, gain_db=12.0))
    frames = bench.frames(8)

    assert level(frames[0]) > 0.95
    assert level(frames[-1]) == GOOD


def test_frames_tell_the_exposure_that_they_had(begin: Begin) -> None:
    frames = begin(Role.WIDE, DARK).frames(5)
    light = [level(frame) / frame.exposure_ns for frame in frames]

    assert len({frame.exposure_ns for frame in frames}) >= 3
    assert light == pytest.approx([light[-1]] * len(light), rel=0.03)


def test_no_frame_is_lost_or_moved_by_a_change(begin: Begin) -> None:
    bench = begin(Role.WIDE, DARK)
    frames = bench.frames(6)
    starts_ns = [frame.t_ns - frame.exposure_ns // 2 for frame in frames]

    assert [frame.seq for frame in frames] == list(range(6))
    assert np.diff(starts_ns) == pytest.approx([1e9 / 30.0] * 5, abs=2.0)
    assert (bench.camera.counters.skipped, bench.camera.counters.dropped) == (0, 0)


def test_once_ends_with_a_good_exposure_and_is_off(begin: Begin) -> None:
    bench = begin(Role.WIDE, replace(DARK, exposure_auto=AutoMode.ONCE))
    frames = []
    while bench.camera.settings.exposure_auto is AutoMode.ONCE:
        frames.append(bench.frame())
        assert len(frames) < 10
    after = bench.frames(2)

    assert level(frames[-1]) == GOOD
    assert {frame.exposure_ns for frame in after} == {frames[-1].exposure_ns}


def test_it_is_the_same_every_time(begin: Begin) -> None:
    runs = [[frame.exposure_ns for frame in begin(Role.WIDE, DARK).frames(5)] for _ in range(2)]

    assert runs[0] == runs[1]


def test_the_rate_set_by_hand_bounds_the_exposure(begin: Begin) -> None:
    bench = begin(Role.WIDE, replace(DARK, frame_rate_hz=200.0))
    longest_ns = max(frame.exposure_ns for frame in bench.frames(7))

    assert longest_ns == pytest.approx(5 * MS, rel=0.01)  # darker than it would like
    assert bench.camera.settings.frame_rate_hz == pytest.approx(200.0)


def test_a_rate_of_its_own_is_what_exposure_and_readout_allow(begin: Begin) -> None:
    by_hand = replace(DARK, exposure_auto=AutoMode.OFF)
    bench = begin(Role.WIDE, replace(by_hand, frame_rate_auto=True))
    fast_hz = bench.camera.settings.frame_rate_hz
    slow = bench.camera.configure(replace(by_hand, exposure_ns=20 * MS, frame_rate_auto=True))
    first, second = bench.frames(2)

    assert fast_hz == pytest.approx(228.0)  # its readout
    assert slow.frame_rate_hz == pytest.approx(50.0, rel=1e-3)
    assert second.t_ns - first.t_ns == pytest.approx(20 * MS, rel=1e-3)
    assert bench.camera.configure(replace(by_hand, frame_rate_hz=12.0)).frame_rate_hz == 12.0
