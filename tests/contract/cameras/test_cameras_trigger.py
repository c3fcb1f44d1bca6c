"""What a trigger edge does to a fovea, and what its strobe line answers."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from foveacam_hardware.contract import InvalidInput, OutOfRange, PixelFormat, Role, Timeout, TriggerSource
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.cameras import default_settings
from foveacam_hardware.sim.exposures import QUEUE_FRAMES, TriggeredSchedule
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.sensor import supported_settings
from foveacam_hardware.sim.world import World

LEFT_AND_RIGHT = 6


@pytest.fixture
def rig() -> Iterator[Rig]:
    with open_simulated(inline=True) as opened:
        yield opened


def world_of(rig: Rig) -> World:
    assert rig.truth is not None
    return rig.truth.world


def schedule() -> TriggeredSchedule:
    return TriggeredSchedule(supported_settings(Role.LEFT, default_settings(Role.LEFT)), first_seq=0)


def test_a_strobe_shows_the_exposure_of_a_camera_that_waits_for_a_trigger(rig: Rig) -> None:
    assert world_of(rig).strobe_us(Role.LEFT) == rig.left.settings.exposure_ns // 1000


@pytest.mark.parametrize(
    "break_it",
    [
        lambda rig: rig.left.stop(),
        lambda rig: rig.left.close(),
        lambda rig: world_of(rig).faults.no_strobe.add(Role.LEFT),
        lambda rig: world_of(rig).faults.no_trigger.add(Role.LEFT),
        lambda rig: world_of(rig).faults.unplugged.add(Role.LEFT),
    ],
    ids=["stopped", "closed", "no strobe cable", "no trigger cable", "unplugged"],
)
def test_there_is_no_strobe_without_an_exposure_or_a_cable(rig: Rig, break_it: Callable[[Rig], None]) -> None:
    break_it(rig)

    assert world_of(rig).strobe_us(Role.LEFT) is None
    assert world_of(rig).strobe_us(Role.RIGHT) is not None


def test_the_wide_camera_has_no_strobe_because_it_runs_freely(rig: Rig) -> None:
    assert world_of(rig).strobe_us(Role.WIDE) is None


def test_one_edge_exposes_both_foveae_at_the_same_moment(rig: Rig) -> None:
    world_of(rig).trigger(rig.clock.now_ns(), pulse_us=1000, cameras=LEFT_AND_RIGHT)
    left, right = rig.left.read(), rig.right.read()

    assert left.t_ns == right.t_ns


def test_an_edge_during_an_exposure_is_lost_and_counted() -> None:
    busy = schedule()
    busy.trigger(0)
    busy.trigger(3_000_000)
    busy.trigger(9_000_000)

    first = busy.oldest(0)
    assert first is not None
    assert (busy.consume(first), busy.missed) == (0, 1)
    second = busy.oldest(0)
    assert second is not None
    assert (second.seq, second.interval.start_ns) == (1, 9_000_000)


def test_an_edge_during_the_readout_of_a_short_exposure_is_lost_and_counted() -> None:
    short = replace(default_settings(Role.LEFT), exposure_ns=1_000_000)
    busy = TriggeredSchedule(supported_settings(Role.LEFT, short), first_seq=0)
    for edge_ns in (0, 3_000_000, 4_500_000):  # the readout takes 4.38 ms
        busy.trigger(edge_ns)

    newest = busy.newest(20_000_000)
    assert newest is not None
    assert (newest.seq, newest.interval.start_ns, busy.missed) == (1, 4_500_000, 1)


def test_readout_overlaps_the_next_exposure() -> None:
    """A global shutter exposes while the last picture is read: 8 ms apart, no edge is lost."""
    fast = schedule()
    for k in range(4):
        fast.trigger(k * 8_001_000)

    newest = fast.newest(100_000_000)
    assert newest is not None
    assert newest.seq == 3


def test_the_queue_is_bounded_and_keeps_the_newest() -> None:
    full = schedule()
    for k in range(QUEUE_FRAMES + 5):
        full.trigger(k * 10_000_000)

    oldest = full.oldest(0)
    assert oldest is not None
    assert oldest.seq == 5
    assert full.consume(oldest) == 5


@pytest.mark.parametrize("role", list(Role), ids=str)
def test_software_exposes_a_camera_that_waits_for_it(rig: Rig, role: Role) -> None:
    camera = rig.camera(role)
    camera.configure(replace(camera.settings, triggered=True, trigger_source=TriggerSource.SOFTWARE))
    with pytest.raises(Timeout):
        camera.read(timeout_ms=100.0)
    asked_ns = rig.clock.now_ns()
    camera.software_trigger()
    frame = camera.read(timeout_ms=100.0)
    assert asked_ns <= frame.t_ns <= rig.clock.now_ns()
    assert world_of(rig).strobe_us(role) is None  # the line does not expose it now


def test_software_does_not_expose_a_camera_that_waits_for_its_line(rig: Rig) -> None:
    with pytest.raises(InvalidInput, match="configure it as triggered by software"):
        rig.left.software_trigger()


def test_black_is_lifted_by_the_black_level_in_every_format(rig: Rig) -> None:
    before = rig.wide.settings
    for pixel_format, unit in ((PixelFormat.MONO8, 1), (PixelFormat.MONO12, 16)):
        settings = replace(before, pixel_format=pixel_format)
        rig.wide.configure(settings)
        plain = rig.wide.read().image
        rig.wide.configure(replace(settings, black_level=20.0))
        lifted = rig.wide.read().image
        assert float(np.median(lifted)) - float(np.median(plain)) == pytest.approx(20 * unit, abs=2 * unit)


def test_a_format_that_the_sensor_lacks_is_refused_with_those_it_has(rig: Rig) -> None:
    with pytest.raises(OutOfRange, match="Mono8, Mono12, RGB8"):
        rig.left.configure(replace(rig.left.settings, pixel_format=PixelFormat.BAYER_RG12P))
