"""The head: one pulse, two foveae of that very pulse, and a wide frame that is no older."""

from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    PARKED,
    AutoMode,
    Binning,
    DeviceFault,
    FoveaError,
    Frame,
    Image,
    InvalidInput,
    LookOptions,
    MirrorVolts,
    NotConnected,
    OutOfRange,
    PixelFormat,
    Role,
    StereoVolts,
    Stopped,
    TriggerHead,
    TriggerSource,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.clock import ClockMap
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.sim.cameras import SimCamera
from foveacam_hardware.sim.exposures import CameraExposure, ExposureInterval
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.world import World

LEFT_AND_RIGHT = 6


def both(x_v: float, y_v: float) -> StereoVolts:
    volts = MirrorVolts(x_v=x_v, y_v=y_v)
    return StereoVolts(left=volts, right=volts)


def world_of(rig: Rig) -> World:
    assert rig.truth is not None
    return rig.truth.world


def opened(preset: str = "rig120") -> AbstractContextManager[Rig]:
    return open_simulated("calibration", preset, inline=True)


@pytest.fixture
def seeing() -> Iterator[Rig]:
    """A rig whose cameras deliver pictures of its room, grey ones, which are drawn in half of the time."""
    with opened() as rig:
        for camera in rig.cameras:
            camera.configure(replace(camera.settings, pixel_format=PixelFormat.MONO8))
        yield rig


@pytest.fixture
def rig(seeing: Rig, monkeypatch: pytest.MonkeyPatch) -> Rig:
    """A rig whose cameras see even light: most tests ask when a picture was taken, not what it shows."""
    light_evenly(monkeypatch)
    return seeing


def light_evenly(monkeypatch: pytest.MonkeyPatch) -> None:
    def even(
        world: World, role: Role, _interval: ExposureInterval, *, channels: int, binning: Binning
    ) -> NDArray[np.float32]:
        view = world.projection(role, world.t0_ns, binning=binning)
        size = (view.height, view.width) if channels == 1 else (view.height, view.width, channels)
        return np.full(size, 0.5, np.float32)

    monkeypatch.setattr(World, "radiance", even)


@pytest.mark.parametrize("preset", ["rig120", "paper"])
def test_a_look_returns_frames_of_one_pulse_with_their_volts(
    preset: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    light_evenly(monkeypatch)
    with opened(preset) as rig:
        sighting = rig.head.look(both(60.0, -30.0))

    assert sighting.left.t_ns == sighting.right.t_ns
    assert sighting.left.volts == sighting.volts.left
    assert sighting.right.volts == sighting.volts.right
    assert sighting.volts.left.x_v == pytest.approx(60.0, abs=0.004)  # a DAC step is 3.05 mV
    assert sighting.volts.left.y_v == pytest.approx(-30.0, abs=0.004)


def test_the_wide_frame_of_a_look_is_not_older_than_the_exposure_and_next_to_it(rig: Rig) -> None:
    for k in range(4):
        sighting = rig.head.look(both(10.0 * k, 0.0))
        late_ms = (sighting.wide.t_ns - sighting.left.t_ns) / 1e6

        assert 0.0 <= late_ms <= 1000.0 / 30.0 + 1.0


@pytest.mark.parametrize(
    ("reading_ms", "order"),
    [(5, [Role.LEFT, Role.RIGHT, Role.WIDE]), (60, [Role.LEFT, Role.WIDE, Role.RIGHT])],
)
def test_the_wide_frame_is_read_before_the_other_fovea_only_once_it_must_be_there(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, reading_ms: int, order: list[Role]
) -> None:
    found: list[Role] = []
    deliver = SimCamera._deliver

    def slowly(self: SimCamera, exposure: CameraExposure) -> Frame:
        found.append(self.role)
        if self.role is not Role.WIDE:
            rig.clock.sleep_until_ns(rig.clock.now_ns() + reading_ms * 1_000_000)
        return deliver(self, exposure)

    monkeypatch.setattr(SimCamera, "_deliver", slowly)
    sighting = rig.head.look(both(20.0, 10.0))
    assert found == order
    assert sighting.wide.t_ns >= sighting.left.t_ns


def test_a_look_tells_what_the_controller_said_of_its_exposure(rig: Rig) -> None:
    first, second = (rig.head.look(both(10.0 * k, 0.0)) for k in range(2))

    assert first.exposure_after_trigger_ns == pytest.approx(TRIGGER_TO_EXPOSURE_US * 1000, abs=2000)
    number = first.left.frame_id
    assert number is not None
    assert (first.right.frame_id, second.left.frame_id) == (number, number + 1)
    assert second.wide.frame_id is None


@pytest.mark.parametrize("exposure_ms", [1, 20, 50, 100])
def test_no_look_hands_out_a_wide_frame_older_than_its_foveae(rig: Rig, exposure_ms: int) -> None:
    rig.head.expose_foveae(exposure_ns=exposure_ms * 1_000_000, gain_db=0.0)
    for step in range(24):  # at every phase of the wide camera's period
        rig.clock.sleep_until_ns(rig.clock.now_ns() + step * 1_700_000)
        sighting = rig.head.look(PARKED)

        late_ms = (sighting.wide.t_ns - sighting.left.t_ns) / 1e6
        assert 0.0 <= late_ms <= exposure_ms / 2 + 1000.0 / 30.0 + 6.0  # readout
        assert sighting.left.exposure_ns == pytest.approx(exposure_ms * 1e6, abs=30_000)


def test_a_look_brings_the_wide_frames_that_waited_before_its_own(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = rig.head.look(both(0.0, 0.0))
    rig.clock.sleep_until_ns(rig.clock.now_ns() + 150_000_000)
    monkeypatch.setattr(SimCamera, "waiting", 3)
    second = rig.head.look(both(10.0, 0.0))
    wides = [first.wide, *second.wide_before, second.wide]

    assert first.wide_before == ()
    assert [frame.seq - first.wide.seq for frame in wides] == list(range(len(wides)))
    assert len(wides) > 4  # three that waited, and then the one that the look needs
    assert wides[-2].t_ns < second.left.t_ns <= second.wide.t_ns


def test_the_mirrors_move_on_while_the_last_exposure_is_read(rig: Rig) -> None:
    head = rig.head
    assert isinstance(head, TriggerHead)
    settle_us, exposure_us = head.settle_us, rig.left.settings.exposure_ns // 1000
    first = head.begin(both(20.0, 0.0), settle_us=settle_us).wait()
    second = head.begin(both(-20.0, 0.0), settle_us=settle_us)
    left, right = head.frames_of(first)
    after = second.wait()

    middle_ns = first.middle_ns(exposure_ns=rig.left.settings.exposure_ns)
    assert left.t_ns == right.t_ns == pytest.approx(middle_ns, abs=2000)
    between_us = (after.t_exposure_start_ns - first.t_exposure_start_ns) / 1e3
    assert between_us < settle_us + exposure_us + 1000.0
    drive = head.frames_of(after)[0].volts
    assert drive is not None
    assert drive.x_v == pytest.approx(-20.0, abs=0.004)


def test_the_mirror_has_settled_when_the_exposure_begins(rig: Rig) -> None:
    """After the full stroke of both axes, the gaze is within a pixel of where it will come to rest."""
    world = world_of(rig)
    world.drift.amplitude_rad = 0.0
    rig.head.look(both(-165.0, -165.0))
    sighting = rig.head.look(both(165.0, 165.0))

    for role, volts in ((Role.LEFT, sighting.volts.left), (Role.RIGHT, sighting.volts.right)):
        at_rest = world.static_view(role, volts)
        far = at_rest.centre_m + 10.0 * at_rest.direction(719.5, 539.5)
        seen = world.projection(role, sighting.left.t_ns - sighting.left.exposure_ns // 2).project(far)[0]
        assert np.linalg.norm(seen - [719.5, 539.5]) < 1.0


@pytest.mark.parametrize("slow_answers", [1, 100])
def test_a_clock_that_was_asked_slowly_after_a_long_pause_loses_no_frame(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, slow_answers: int
) -> None:
    """A busy machine hears the controller's time late: 18 ms at one ping, or at all of them."""
    rig.head.look(both(10.0, 0.0))
    late, add = [True] * slow_answers, ClockMap.add

    def add_late(clock: ClockMap, *, sent_ns: int, received_ns: int, controller_us: int) -> bool:
        late_ns = 18_000_000 if late and late.pop() else 0
        return add(clock, sent_ns=sent_ns, received_ns=received_ns + late_ns, controller_us=controller_us)

    monkeypatch.setattr(ClockMap, "add", add_late)
    rig.clock.sleep_until_ns(rig.clock.now_ns() + 200_000_000_000)
    before_ns = rig.clock.now_ns()
    sighting = rig.head.look(both(-20.0, 5.0))

    assert sighting.left.t_ns > before_ns
    drive = sighting.left.volts
    assert drive is not None and drive.x_v == pytest.approx(-20.0, abs=0.004)
    assert len(late) < slow_answers


def commanded(rig: Rig) -> Rig:
    """Let both foveae wait for commands: a rig without trigger cables."""
    for camera in (rig.left, rig.right):
        camera.configure(replace(camera.settings, trigger_source=TriggerSource.SOFTWARE))
    return rig


def test_foveae_without_trigger_cables_are_exposed_by_commands_when_the_mirrors_rest(seeing: Rig) -> None:
    pulsed = seeing.head.look(both(60.0, -30.0))
    began_ns = seeing.clock.now_ns()
    sighting = commanded(seeing).head.look(both(60.0, -30.0))

    assert sighting.volts == pulsed.volts
    assert sighting.left.volts == sighting.volts.left
    settled_ns = began_ns + seeing.head.settle_us * 1000
    assert min(sighting.left.t_ns, sighting.right.t_ns) > settled_ns
    assert sighting.wide.t_ns >= max(sighting.left.t_ns, sighting.right.t_ns)
    assert np.corrcoef(sighting.left.image.ravel(), pulsed.left.image.ravel())[0, 1] > 0.99


def test_commanded_exposure_can_be_begun_and_read_later_and_with_one_fovea_alone(rig: Rig) -> None:
    head = commanded(rig).head
    assert isinstance(head, TriggerHead)
    receipt = head.begin(both(20.0, 0.0), settle_us=5000).wait()
    assert [frame.role for frame in head.frames_of(receipt)] == [Role.LEFT, Role.RIGHT]
    assert not head.look(both(0.0, 0.0), options=LookOptions(missing=Role.LEFT)).left.image.any()


def test_commanded_exposure_whose_mirrors_were_parked_meanwhile_is_refused(rig: Rig) -> None:
    head = commanded(rig).head
    assert isinstance(head, TriggerHead)
    begun = head.begin(both(20.0, 0.0), settle_us=5000)
    rig.mirrors.park()
    with pytest.raises(Stopped, match="parked during the exposure"):
        begun.wait()


def test_one_fovea_that_waits_for_a_command_is_missed_by_the_pulse(rig: Rig) -> None:
    rig.left.configure(replace(rig.left.settings, trigger_source=TriggerSource.SOFTWARE))
    with pytest.raises(DeviceFault, match=r"[Ss]trobe"):
        rig.head.look(both(0.0, 0.0))


def test_frames_of_earlier_triggers_are_dropped(rig: Rig) -> None:
    world_of(rig).trigger(rig.clock.now_ns(), pulse_us=1000, cameras=LEFT_AND_RIGHT)
    rig.clock.sleep_until_ns(rig.clock.now_ns() + 50_000_000)
    stale_until_ns = rig.clock.now_ns()

    sighting = rig.head.look(both(20.0, 20.0))

    assert sighting.left.t_ns > stale_until_ns
    assert sighting.right.t_ns == sighting.left.t_ns


def test_a_lost_frame_is_a_fault_that_names_the_camera(rig: Rig) -> None:
    """The strobe came, but the frame did not: the far end is content, the head is not."""
    world = world_of(rig)
    left, world_trigger = rig.left, world.trigger

    def lose_left(t_ns: int, *, pulse_us: int, cameras: int) -> None:
        world_trigger(t_ns, pulse_us=pulse_us, cameras=cameras & ~2)

    world.trigger = lose_left  # type: ignore[method-assign]  # the frame is lost on its way, in no part of ours
    with pytest.raises(DeviceFault, match=r"camera left: exposure .* no frame came"):
        rig.head.look(both(0.0, 0.0))
    assert left.counters.delivered == 0


def test_a_missing_strobe_is_reported_and_the_next_look_succeeds(rig: Rig) -> None:
    world_of(rig).faults.no_strobe.add(Role.RIGHT)
    with pytest.raises(FoveaError, match=r"[Ss]trobe"):
        rig.head.look(both(5.0, 0.0))
    world_of(rig).faults.no_strobe.clear()

    assert rig.head.look(both(5.0, 0.0)).right.role is Role.RIGHT


def test_an_unplugged_fovea_is_reported(rig: Rig) -> None:
    world_of(rig).faults.unplugged.add(Role.LEFT)

    with pytest.raises(FoveaError):
        rig.head.look(both(0.0, 0.0))
    with pytest.raises(NotConnected, match="left"):
        rig.left.read()


@pytest.mark.parametrize(("missing", "there"), [(Role.LEFT, Role.RIGHT), (Role.RIGHT, Role.LEFT)])
def test_without_one_fovea_the_other_sees_and_the_missing_ones_frame_is_black(
    seeing: Rig, missing: Role, there: Role
) -> None:
    world_of(seeing).faults.unplugged.add(missing)

    sighting = seeing.head.look(both(12.0, -8.0), options=LookOptions(missing=missing))
    frames = {frame.role: frame for frame in (sighting.left, sighting.right)}

    assert sighting.missing is missing
    assert not frames[missing].image.any()
    assert frames[there].image.std() > 5.0
    drive = frames[missing].volts
    assert drive is not None and drive.x_v == pytest.approx(12.0, abs=0.004)
    world_of(seeing).faults.unplugged.clear()
    seeing.connect()
    assert seeing.head.look(both(0.0, 0.0)).missing is None


def test_no_look_does_without_the_wide_camera() -> None:
    with pytest.raises(InvalidInput, match=r"wide camera.*plug it in"):
        LookOptions(missing=Role.WIDE)


def test_foveae_with_different_exposures_are_refused(rig: Rig) -> None:
    rig.left.configure(replace(rig.left.settings, exposure_ns=4_000_000))

    with pytest.raises(InvalidInput, match="same exposure"):
        rig.head.look(PARKED)


def test_a_fovea_that_sets_its_exposure_itself_is_refused_until_one_is_set(rig: Rig) -> None:
    rig.right.configure(replace(rig.right.settings, exposure_auto=AutoMode.ONCE))

    with pytest.raises(InvalidInput, match=r"camera right: it sets its exposure itself.*switch that off"):
        rig.head.look(PARKED)
    rig.head.expose_foveae(exposure_ns=5_000_000, gain_db=0.0)

    assert rig.right.settings.exposure_auto is AutoMode.OFF
    assert rig.head.look(PARKED).right.exposure_ns == rig.left.settings.exposure_ns


def test_foveae_that_round_one_exposure_each_in_its_own_way_look(rig: Rig) -> None:
    exposure_ns = rig.right.settings.exposure_ns
    rig.left.configure(replace(rig.left.settings, exposure_ns=exposure_ns + 30_000))

    assert rig.left.settings.exposure_ns > exposure_ns
    assert rig.head.look(PARKED).left.role is Role.LEFT


def test_volts_beyond_the_limit_are_refused_before_anything_moves(rig: Rig) -> None:
    with pytest.raises(OutOfRange):
        rig.head.look(both(180.0, 0.0))
    assert rig.left.counters.delivered == 0


def test_a_stuck_mirror_shows_the_same_picture_wherever_it_is_sent(seeing: Rig) -> None:
    world = world_of(seeing)
    first = seeing.head.look(both(0.0, 0.0))
    world.faults.dead_axes = {"left x", "left y"}
    seeing.head.look(both(0.0, 0.0))
    moved = seeing.head.look(both(60.0, 20.0))

    def differ(a: Image, b: Image) -> float:
        return float(np.abs(a.astype(float) - b).mean())

    assert differ(moved.left.image, first.left.image) < 6.0  # noise alone
    assert differ(moved.right.image, first.right.image) > 12.0


def test_a_knock_to_the_mount_moves_the_picture(rig: Rig) -> None:
    world = world_of(rig)
    before = world.projection(Role.LEFT, rig.clock.now_ns())
    world.faults.drift_step_rad = {Role.LEFT: (0.0, 1e-4, 0.0)}
    after = world.projection(Role.LEFT, rig.clock.now_ns())
    far = np.array([[-0.1, 0.0, 100.0]])

    assert before.project(far)[0, 0] - after.project(far)[0, 0] == pytest.approx(2.876, abs=0.05)


def test_wide_moves_nothing(rig: Rig) -> None:
    frame = rig.head.wide(max_age_ms=100.0)

    assert frame.role is Role.WIDE
    assert frame.volts is None
    assert rig.left.counters.delivered == 0


def test_virtual_time_runs_only_as_far_as_the_physics_needs(rig: Rig) -> None:
    """Settle 14 ms, expose 8 ms, read 4.4 ms, and at most a wide period: nothing else takes time."""
    assert isinstance(rig.clock, VirtualClock)
    rig.head.look(PARKED)
    before_ns = rig.clock.now_ns()
    rig.head.look(both(30.0, 0.0))

    assert 26.3e6 < rig.clock.now_ns() - before_ns < 62e6
