"""The contract of a camera, run on every camera of the simulated rig, in virtual time."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_hardware.contract import (
    Camera,
    CameraSettings,
    FoveaError,
    InvalidInput,
    MonotonicClock,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Role,
    Timeout,
    VirtualClock,
)
from foveacam_hardware.sim.animated_scene import AnimatedScene
from foveacam_hardware.sim.cameras import SimCamera
from foveacam_hardware.sim.presets import RIG120
from foveacam_hardware.sim.world import World

START_NS = 1_000_000_000
ROLES = list(Role)
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


@dataclass
class Bench:
    """One camera before a wall, and the hand on its trigger."""

    camera: Camera
    world: World
    clock: VirtualClock

    def expose(self) -> None:
        """Make sure that a frame will come: triggered cameras need an edge."""
        if self.camera.settings.triggered:
            self.clock.sleep_until_ns(self.clock.now_ns() + 20_000_000)
            self.world.trigger(self.clock.now_ns(), pulse_us=1000, cameras=6)


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AnimatedScene]:
    path: Path = tmp_path_factory.mktemp("scene") / "wall.toml"
    path.write_text(SCENE, encoding="utf-8")
    stage = AnimatedScene(path)
    yield stage
    stage.close()


@pytest.fixture(params=ROLES, ids=str)
def bench(request: pytest.FixtureRequest, stage: AnimatedScene) -> Iterator[Bench]:
    clock = VirtualClock(START_NS)
    world = World(scene=stage, preset=RIG120, seed=0, clock=clock)
    camera = SimCamera(world, request.param, clock=clock)
    camera.connect()
    yield Bench(camera, world, clock)
    camera.close()


def started(bench: Bench) -> Camera:
    bench.camera.start()
    return bench.camera


def test_a_camera_says_who_it_is(bench: Bench) -> None:
    assert bench.camera.info.vendor == "FoveaCam Duo simulation"
    assert bench.camera.info.serial.startswith("SIM-")


def test_a_frame_carries_its_time_number_and_format(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    frame = camera.read()

    assert frame.role is camera.role
    assert frame.image.shape == (1080, 1440, 3)
    assert frame.image.dtype == np.uint8
    assert frame.bits == 8
    assert frame.exposure_ns == camera.settings.exposure_ns
    assert START_NS < frame.t_ns <= bench.clock.now_ns()


def test_a_frame_exists_only_after_exposure_and_readout(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    frame = camera.read()

    latency_ns = bench.clock.now_ns() - frame.t_ns
    assert latency_ns >= frame.exposure_ns // 2 + 4_370_000  # IMX273: 4.38 ms of readout


def test_read_returns_every_frame_once_in_order(bench: Bench) -> None:
    camera = started(bench)
    frames = []
    for _ in range(3):
        bench.expose()
        frames.append(camera.read())

    assert [frame.seq for frame in frames] == [frames[0].seq + k for k in range(3)]
    assert frames[0].t_ns < frames[1].t_ns < frames[2].t_ns
    assert camera.counters.delivered == 3
    assert (camera.counters.skipped, camera.counters.dropped) == (0, 0)


def test_frames_yields_as_many_as_asked(bench: Bench) -> None:
    camera = started(bench)
    for _ in range(2):
        bench.expose()

    assert len(list(camera.frames(2))) == 2


def test_latest_repeats_the_newest_frame_while_it_is_young_enough(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    first = camera.read()
    again = camera.latest(max_age_ms=1000.0)

    assert again is first
    assert camera.counters.delivered == 1


def test_latest_skips_what_was_not_read_and_counts_it(bench: Bench) -> None:
    camera = started(bench)
    for _ in range(3):
        bench.expose()
    bench.clock.sleep_until_ns(bench.clock.now_ns() + 100_000_000)
    frame = camera.latest(max_age_ms=1000.0)

    assert bench.clock.now_ns() - frame.t_ns < 140_000_000
    assert camera.counters.skipped >= 2
    assert camera.counters.dropped == 0


def test_a_reader_that_sleeps_loses_the_oldest_frames_and_hears_of_it(bench: Bench) -> None:
    camera = started(bench)
    for _ in range(12):
        bench.expose()
    bench.clock.sleep_until_ns(bench.clock.now_ns() + 400_000_000)
    frame = camera.read()

    assert camera.counters.skipped == frame.seq >= 4


def test_sequence_numbers_go_on_over_stop_and_start(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    first = camera.read()
    camera.stop()
    camera.start()
    bench.expose()

    assert camera.read().seq == first.seq + 1
    assert camera.counters.delivered == 1


def test_configure_returns_what_the_camera_took(bench: Bench) -> None:
    camera = bench.camera
    asked = replace(camera.settings, exposure_ns=5_000_000, gain_db=3.14, frame_rate_hz=500.0 / 7.0)
    taken = camera.configure(asked)

    assert taken == camera.settings
    assert taken.exposure_ns == pytest.approx(5_000_000, abs=2_000)  # whole lines of 3.9 us
    assert taken.gain_db == pytest.approx(3.1)


def test_a_rate_that_the_exposure_does_not_allow_is_lowered_and_told(bench: Bench) -> None:
    taken = bench.camera.configure(
        replace(bench.camera.settings, exposure_ns=50_000_000, frame_rate_hz=100.0)
    )

    assert taken.frame_rate_hz == pytest.approx(20.0, rel=1e-3)


@pytest.mark.parametrize(
    "change",
    [
        lambda settings: replace(settings, exposure_ns=10),
        lambda settings: replace(settings, exposure_ns=2_000_000_000),
        lambda settings: replace(settings, gain_db=-1.0),
        lambda settings: replace(settings, gain_db=float("nan")),
        lambda settings: replace(settings, frame_rate_hz=0.0),
        lambda settings: replace(settings, frame_rate_hz=1000.0),
    ],
)
def test_settings_out_of_range_are_refused_and_change_nothing(
    bench: Bench, change: Callable[[CameraSettings], CameraSettings]
) -> None:
    before = bench.camera.settings

    with pytest.raises(OutOfRange, match=str(bench.camera.role)):
        bench.camera.configure(change(before))
    assert bench.camera.settings == before


def mean_level(bench: Bench, settings: CameraSettings) -> float:
    bench.camera.configure(settings)
    bench.expose()
    return float(bench.camera.read().image.mean())


def test_twice_the_light_is_twice_the_signal(bench: Bench) -> None:
    settings = replace(started(bench).settings, exposure_ns=2_000_000)
    dim = mean_level(bench, settings)

    assert mean_level(bench, replace(settings, exposure_ns=4_000_000)) == pytest.approx(2.0 * dim, rel=0.02)
    assert mean_level(bench, replace(settings, gain_db=6.0206)) == pytest.approx(2.0 * dim, rel=0.02)


@pytest.mark.parametrize(
    ("pixel_format", "bits", "shape", "dtype"),
    [
        (PixelFormat.MONO8, 8, (1080, 1440), np.uint8),
        (PixelFormat.MONO12, 12, (1080, 1440), np.uint16),
        (PixelFormat.RGB8, 8, (1080, 1440, 3), np.uint8),
    ],
)
def test_every_pixel_format_delivers_what_its_name_says(
    bench: Bench, pixel_format: PixelFormat, bits: int, shape: tuple[int, ...], dtype: type
) -> None:
    camera = started(bench)
    camera.configure(replace(camera.settings, pixel_format=pixel_format))
    bench.expose()
    frame = camera.read()

    assert frame.image.shape == shape
    assert frame.image.dtype == dtype
    assert frame.bits == bits
    assert int(frame.image.max()) > (1 << bits) // 2


def test_noise_differs_from_frame_to_frame(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    first = camera.read()
    bench.expose()

    assert not np.array_equal(first.image, camera.read().image)


def test_an_edge_while_the_sensor_is_busy_is_a_frame_that_never_comes(stage: AnimatedScene) -> None:
    clock = VirtualClock()
    world = World(scene=stage, preset=RIG120, seed=0, clock=clock)
    camera = SimCamera(world, Role.LEFT, clock=clock)
    camera.connect()
    camera.configure(replace(camera.settings, triggered=True))
    camera.start()
    for wait_ns in (20_000_000, 1_000_000):
        clock.sleep_until_ns(clock.now_ns() + wait_ns)
        world.trigger(clock.now_ns(), pulse_us=1000, cameras=6)
    camera.read()
    counters = camera.counters
    camera.close()

    assert (counters.delivered, counters.skipped, counters.dropped) == (1, 0, 1)


def test_two_readers_share_the_frames_and_none_is_given_twice(stage: AnimatedScene) -> None:
    clock = MonotonicClock()
    world = World(scene=stage, preset=RIG120, seed=0, clock=clock)
    camera = SimCamera(world, Role.WIDE, clock=clock)
    camera.connect()
    camera.start()

    with ThreadPoolExecutor(2) as readers:
        reads = [readers.submit(camera.read, timeout_ms=20_000.0) for _ in range(12)]
        numbers = [read.result().seq for read in reads]
    camera.close()

    assert len(set(numbers)) == 12
    assert camera.counters.delivered == 12
    assert camera.counters.skipped == max(numbers) - 11


def test_a_closed_camera_refuses_and_closes_again(bench: Bench) -> None:
    bench.camera.close()
    bench.camera.close()

    for action in (bench.camera.start, bench.camera.read, lambda: bench.camera.latest(max_age_ms=10.0)):
        with pytest.raises(NotConnected, match=str(bench.camera.role)):
            action()


def test_a_stopped_camera_says_that_it_must_be_started(bench: Bench) -> None:
    with pytest.raises(InvalidInput, match="start"):
        bench.camera.read()


def test_an_unplugged_camera_is_lost_until_it_is_back_and_connected_again(bench: Bench) -> None:
    camera = started(bench)
    bench.world.faults.unplugged.add(camera.role)
    with pytest.raises(NotConnected):
        camera.read()
    with pytest.raises(NotConnected, match="plug"):
        camera.connect()
    bench.world.faults.unplugged.clear()
    with pytest.raises(NotConnected):
        camera.read()

    camera.connect()
    camera.start()
    bench.expose()
    assert camera.read().role is camera.role


def test_a_frozen_camera_counts_on_and_repeats_its_picture(bench: Bench) -> None:
    camera = started(bench)
    bench.expose()
    first = camera.read()
    bench.world.faults.frozen.add(camera.role)
    bench.expose()
    second = camera.read()

    assert second.seq == first.seq + 1
    assert np.array_equal(first.image, second.image)


def test_waiting_too_long_for_a_frame_ends_in_a_timeout(bench: Bench) -> None:
    camera = started(bench)
    before_ns = bench.clock.now_ns()

    with pytest.raises(Timeout, match=str(camera.role)):
        camera.read(timeout_ms=5.0)
    assert bench.clock.now_ns() == before_ns + 5_000_000


def test_only_the_foveae_can_be_triggered(bench: Bench) -> None:
    asked = replace(bench.camera.settings, triggered=True)
    if bench.camera.role is Role.WIDE:
        with pytest.raises(FoveaError, match="trigger cable"):
            bench.camera.configure(asked)
    else:
        assert bench.camera.configure(asked).triggered
