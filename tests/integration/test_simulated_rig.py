"""The simulated rig as a whole: the same every run, faster than the clock, honest about what is broken."""

import time
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest

from foveacam_hardware.contract import (
    PARKED,
    MirrorVolts,
    PixelFormat,
    Role,
    Sighting,
    StereoVolts,
    VirtualClock,
)
from foveacam_hardware.rig import Closeable, Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.rig import open_simulated, simulated_rig
from foveacam_hardware.sim.scenes.motion import pose
from foveacam_hardware.sim.truth import Truth

FACADE = StereoVolts(left=MirrorVolts(x_v=60.0, y_v=-60.0), right=MirrorVolts(x_v=52.0, y_v=-60.0))
"""The front of the town hall, 35 m away."""
VOLTS = StereoVolts(left=MirrorVolts(x_v=-40.0, y_v=30.0), right=MirrorVolts(x_v=-70.0, y_v=30.0))


@pytest.fixture(scope="module")
def bench() -> Iterator[Rig]:
    with open_simulated("bench", inline=True) as rig:
        yield rig


@pytest.fixture(scope="module")
def street() -> Iterator[Rig]:
    with open_simulated("street", inline=True) as rig:
        yield rig


def truth_of(rig: Rig) -> Truth:
    assert rig.truth is not None
    return rig.truth


def session(seed: int, *, looks: int = 2) -> list[Sighting]:
    with open_simulated("street", inline=True, seed=seed) as rig:
        for camera in rig.cameras:
            camera.configure(replace(camera.settings, pixel_format=PixelFormat.MONO8, binning=2))
        return [rig.head.look(volts) for volts in (PARKED, VOLTS)[:looks]]


def test_two_runs_with_a_seed_are_bit_identical_and_another_seed_is_another_rig() -> None:
    first, again, other = session(4), session(4), session(5, looks=1)

    for a, b in zip(first, again, strict=True):
        for frame_a, frame_b in ((a.left, b.left), (a.right, b.right), (a.wide, b.wide)):
            assert frame_a.t_ns == frame_b.t_ns
            assert np.array_equal(frame_a.image, frame_b.image)
    assert not np.array_equal(first[0].left.image, other[0].left.image)


def test_a_minute_of_rig_time_takes_no_minute() -> None:
    with open_simulated("bench", inline=True) as rig:
        assert isinstance(rig.clock, VirtualClock)
        rig.head.look(PARKED)
        began_s, began_ns = time.process_time(), rig.clock.now_ns()
        for k in range(6):
            rig.clock.sleep_until_ns(began_ns + (k + 1) * 10_000_000_000)
            rig.head.wide(max_age_ms=100.0)

        assert rig.clock.now_ns() - began_ns >= 60_000_000_000
        assert time.process_time() - began_s < 10.0


def test_every_device_is_connected_and_the_rig_says_who_it_is(bench: Rig) -> None:
    assert bench.problems == ()
    assert (bench.rig_id, bench.simulated, bench.scene) == ("sim-rig120", True, "bench")
    assert bench.baseline_m == pytest.approx(0.2)
    assert len({camera.info.serial for camera in bench.cameras}) == 3
    assert bench.mirrors.state.enabled


def test_the_default_exposure_suits_the_shipped_scenes(bench: Rig, street: Rig) -> None:
    for rig in (bench, street):
        frame = rig.head.wide()
        assert 60.0 < float(frame.image.mean()) < 180.0
        assert float((frame.image == 255).mean()) < 0.02


@pytest.mark.parametrize("role", [Role.LEFT, Role.RIGHT])
def test_the_fovea_shows_what_the_wide_camera_shows_there(street: Rig, role: Role) -> None:
    """Its picture, carried over by the truth's geometry, lies on the wide one to half a pixel."""
    sighting = street.head.look(FACADE)
    truth = truth_of(street)
    frame = sighting.left if role is Role.LEFT else sighting.right
    corners = np.array([[0.0, 0.0], [1439.0, 0.0], [1439.0, 1079.0], [0.0, 1079.0]])
    on_facade = truth.projection(role, frame.t_ns).points(corners, np.full(4, 35.0))
    landing = truth.wide_pixels(on_facade)
    left_px, top_px = np.ceil(landing.min(axis=0) + 12).astype(int)
    right_px, bottom_px = np.floor(landing.max(axis=0) - 12).astype(int)
    wide_from_fovea = cv2.getPerspectiveTransform(corners.astype(np.float32), landing.astype(np.float32))
    soft = cv2.GaussianBlur(cv2.cvtColor(frame.image, cv2.COLOR_RGB2GRAY), (0, 0), 4.0)
    carried = cv2.warpPerspective(soft, wide_from_fovea, (1440, 1080))[top_px:bottom_px, left_px:right_px]
    wide = cv2.cvtColor(sighting.wide.image, cv2.COLOR_RGB2GRAY)
    around = wide[top_px - 8 : bottom_px + 8, left_px - 8 : right_px + 8]
    _, score, _, (x_px, y_px) = cv2.minMaxLoc(cv2.matchTemplate(around, carried, cv2.TM_CCOEFF_NORMED))

    assert score > 0.9
    assert (x_px, y_px) == (8, 8)


def test_truth_agrees_with_the_scene_about_what_a_pixel_shows(bench: Rig) -> None:
    truth = truth_of(bench)
    board = next(
        thing for thing in truth.world.animated_scene.file.objects if thing.name == "plain whiteboard"
    )
    x_px, y_px = truth.wide_pixels(np.array([board.position_m]))[0]
    seen = truth.depth_at(float(x_px), float(y_px), bench.clock.now_ns())

    assert seen is not None
    assert (seen.name, seen.textured) == ("plain whiteboard", False)
    assert seen.range_m == pytest.approx(float(np.linalg.norm(board.position_m)), rel=1e-6)
    assert seen.point_rig_m == pytest.approx(board.position_m, abs=1e-5)
    assert seen.contrast < 1e-3


def test_truth_measures_contrast_and_surroundings(bench: Rig) -> None:
    truth = truth_of(bench)
    x_px, y_px = truth.wide_pixels(np.array([[0.40, 0.075, 2.63]]))[0]
    globe = truth.depth_at(float(x_px), float(y_px), bench.clock.now_ns())
    around = truth.surroundings(float(x_px), float(y_px), bench.clock.now_ns(), half_px=20)

    assert globe is not None
    assert (globe.name, globe.textured) == ("globe", True)
    assert globe.contrast > 0.03
    assert around.names == ("globe",)
    assert 2.5 < around.nearest_m < globe.range_m + 0.02 < around.farthest_m + 0.03 < 2.8


def test_the_sky_has_no_distance(street: Rig) -> None:
    truth = truth_of(street)

    assert truth.depth_at(720.0, 30.0, street.clock.now_ns()) is None
    assert truth.surroundings(720.0, 30.0, street.clock.now_ns(), half_px=10).names == ()


def test_people_walk_and_the_cameras_see_it(street: Rig) -> None:
    truth = truth_of(street)
    t_ns = street.clock.now_ns()

    walker = next(
        thing for thing in truth.world.animated_scene.file.objects if thing.name == "walker in ochre"
    )

    def range_m(t_ns: int) -> float:
        """Look at the walker's middle, wherever it is by then."""
        middle = pose(walker, truth.world.scene_s(t_ns))[:3, 3] - [0.0, 0.9, 0.0]
        x_px, y_px = truth.wide_pixels(middle[None, :])[0]
        seen = truth.depth_at(float(x_px), float(y_px), t_ns)
        assert seen is not None
        assert seen.name == walker.name
        return seen.range_m

    assert abs(range_m(t_ns + 2_000_000_000) - range_m(t_ns)) == pytest.approx(1.8, abs=0.1)
    before = street.head.wide().image.astype(np.int16)
    street.clock.sleep_until_ns(street.clock.now_ns() + 1_000_000_000)
    after = street.head.wide(max_age_ms=50.0).image.astype(np.int16)
    changed = np.abs(after - before).max(axis=2) > 60
    assert 0.003 < float(changed.mean()) < 0.3


def test_a_moving_mirror_smears_the_picture(bench: Rig) -> None:
    """Triggered without settling after a large move, the fovea sees a blur; the wide camera does not care."""

    def detail(settle_us: int) -> float:
        bench.head.look(PARKED)
        receipt = bench.mirrors.expose(VOLTS, settle_us=settle_us, pulse_us=4000)
        frame = bench.left.read()
        bench.right.read()
        assert abs(frame.t_ns - receipt.middle_ns(exposure_ns=frame.exposure_ns)) < 2_000_000
        return float(np.abs(np.diff(frame.image.astype(np.int16), axis=1)).mean())

    sharp, smeared = detail(14_000), detail(0)
    assert smeared < 0.9 * sharp


def test_connect_reports_every_missing_device_and_the_rest_works() -> None:
    with simulated_rig(SimulatedRigConfig(), inline=True) as rig:
        truth_of(rig).world.faults.unplugged.update({Role.LEFT, Role.RIGHT})
        for camera in (rig.left, rig.right):
            camera.close()
        found = {problem.device for problem in rig.connect()}
        assert found == {"left", "right"}

        truth_of(rig).world.faults.unplugged.clear()
        assert rig.connect() == ()


def test_everything_is_closed_last_opened_first(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[str] = []
    rig = open_simulated(inline=True)

    def noting(name: str, device: Closeable) -> None:
        inner = device.close

        def close() -> None:
            closed.append(name)
            inner()

        monkeypatch.setattr(device, "close", close)

    noting("mirrors", rig.mirrors)
    noting("stage", truth_of(rig).world.animated_scene)
    for camera in rig.cameras:
        noting(str(camera.role), camera)
    rig.close()

    assert closed == ["right", "left", "wide", "mirrors", "stage"]
    assert not rig.mirrors.state.connected


def test_in_real_time_the_controller_is_a_process_of_its_own_and_a_look_works() -> None:
    with open_simulated("bench") as rig:
        assert rig.problems == ()
        sighting = rig.head.look(VOLTS)

        assert sighting.left.t_ns == sighting.right.t_ns
        assert sighting.left.t_ns - 2_000_000 <= sighting.wide.t_ns <= rig.clock.now_ns()
        assert sighting.volts.left.x_v == pytest.approx(-40.0, abs=0.004)
