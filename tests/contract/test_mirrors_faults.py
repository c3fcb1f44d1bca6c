"""What the mirror driver makes of broken lines: survived or reported within a second, mirrors parked."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from tests.support.devices.controllers import PATIENT, Controllers, started

from foveacam_hardware.contract import (
    PARKED,
    MirrorVolts,
    MonotonicClock,
    NotConnected,
    StereoVolts,
    Timeout,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.drivers.controller.recovery import PROBES
from foveacam_hardware.drivers.controller.replies import STALL_S
from foveacam_hardware.sim.cables import DacCodes, RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController, LoopbackLink
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage

REST = (29490,) * 8
ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-10.0, y_v=5.0))
HUNG_S = 10.0
"""Nothing waits so long; how long silence is waited for is a sum of deadlines, tested as such."""

Controller = LoopbackController | ControllerProcess


class Rig:
    """A connected driver, its mirrors aside, on a controller that can be damaged."""

    def __init__(self, controller: Controller, cables: RecordingCables) -> None:
        self.controller = controller
        self.cables = cables
        clock = controller.clock if isinstance(controller, LoopbackController) else MonotonicClock()
        self.mirrors = ControllerMirrors(controller.open, clock)
        self.mirrors.connect()
        self.mirrors.steer(ASIDE)
        self.mirrors.ping()

    def outcome(self, action: Callable[[], object]) -> str:
        """Return 'done', 'recovered', 'silent' or 'gone'; nothing may hang."""
        began_s = time.monotonic()
        try:
            action()
            result = "done"
        except Timeout as silence:
            result = "recovered" if "answers again" in str(silence) else "silent"
        except NotConnected:
            result = "gone"
        assert time.monotonic() - began_s < HUNG_S
        return result

    def codes(self) -> DacCodes:
        self.controller.status()
        return self.cables.codes


def loopback(*, strict: bool) -> Rig:
    cables = RecordingCables()
    clock = VirtualClock(1_000_000_000)
    controller = LoopbackController(clock, cables, strict=strict)
    return Rig(controller, cables)


class WaitingLink(LoopbackLink):
    """A link on which only a deadline tells that no answer comes, as on a port."""

    @property
    def quiet(self) -> None:  # type: ignore[override]  # a link may not know
        return None


class WaitingController(LoopbackController):
    """A controller in this process whose silence lasts as long as that of one behind a port."""

    def open(self) -> LoopbackLink:
        return WaitingLink(self.far_end, self.clock)


@pytest.fixture(scope="module")
def controllers() -> Iterator[Controllers]:
    with started() as running:
        yield running


def behind_a_port(request: pytest.FixtureRequest) -> Rig:
    controllers: Controllers = request.getfixturevalue("controllers")
    cables = RecordingCables()
    return Rig(controllers.fresh(cables, strict=False), cables)


@pytest.fixture(params=["loopback", "process"])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    built = loopback(strict=False) if request.param == "loopback" else behind_a_port(request)
    yield built
    built.mirrors.close()


@pytest.fixture(params=["loopback", "process"])
def waiting(request: pytest.FixtureRequest) -> Iterator[Rig]:
    """A rig whose controller lets a host wait when it is silent, in this process too."""
    if request.param == "loopback":
        cables = RecordingCables()
        built = Rig(WaitingController(VirtualClock(1_000_000_000), cables), cables)
    else:
        built = behind_a_port(request)
    yield built
    built.mirrors.close()


def actions(rig: Rig) -> dict[str, Callable[[], object]]:
    return {
        "ping": rig.mirrors.ping,
        "expose": lambda: rig.mirrors.expose(ASIDE, settle_us=100, pulse_us=4000),
        "disable": rig.mirrors.disable,
    }


@pytest.mark.parametrize("action", ["ping", "expose", "disable"])
@pytest.mark.parametrize("kind", list(DamageKind))
@pytest.mark.parametrize(("direction", "skip"), [("device", 0), ("device", 4), ("host", 0), ("host", 5)])
def test_one_damaged_byte_is_recovered_and_the_mirrors_are_parked(
    action: str, kind: DamageKind, direction: str, skip: int
) -> None:
    rig = loopback(strict=False)
    damage = LineDamage(kind=kind, skip=skip)
    (rig.controller.damage_to_device if direction == "device" else rig.controller.damage_to_host)(damage)

    outcome = rig.outcome(actions(rig)[action])

    assert outcome == "recovered" or (outcome == "done" and rig.mirrors.state.fault is None)
    assert rig.mirrors.state.connected
    if outcome == "recovered":
        assert rig.mirrors.state.volts == PARKED
        assert rig.codes() == REST
    rig.controller.heal()
    rig.mirrors.enable()
    assert rig.outcome(lambda: rig.mirrors.expose(ASIDE, settle_us=100, pulse_us=4000)) == "done"
    rig.mirrors.close()
    assert not rig.cables.rail_on


def test_a_byte_lost_from_a_silent_update_costs_no_more_than_that_update() -> None:
    rig = loopback(strict=False)
    rig.controller.damage_to_device(LineDamage(kind=DamageKind.DROP, skip=8))
    rig.mirrors.steer(PARKED)

    assert rig.outcome(rig.mirrors.ping) == "done"
    rig.mirrors.steer(PARKED)
    assert rig.codes() == REST
    rig.mirrors.close()


def test_half_a_packet_swallows_the_next_and_is_then_over() -> None:
    rig = loopback(strict=False)
    rig.controller.damage_to_device(LineDamage(kind=DamageKind.DROP, skip=12, count=100))
    rig.mirrors.steer(PARKED)

    assert rig.outcome(rig.mirrors.ping) in ("recovered", "done")
    assert rig.outcome(rig.mirrors.ping) == "done"
    rig.mirrors.close()


def test_replies_buried_in_noise_are_found_and_the_noise_is_counted() -> None:
    rig = loopback(strict=False)
    rig.controller.damage_to_host(LineDamage(kind=DamageKind.INSERT, skip=0, count=3, value=0))

    before = rig.mirrors.telemetry.bad_packets
    assert rig.outcome(rig.mirrors.ping) == "done"
    assert rig.mirrors.telemetry.bad_packets - before == 3
    rig.mirrors.close()


@pytest.mark.parametrize("skip", [0, 3, 5])
def test_a_strict_controller_that_stops_is_reported_with_its_rail_on(skip: int) -> None:
    rig = loopback(strict=True)
    rig.controller.damage_to_device(LineDamage(kind=DamageKind.DROP, skip=skip))

    assert rig.outcome(rig.mirrors.ping) in ("silent", "recovered", "done")
    if not rig.controller.status().dead:  # the byte took only the checksum with it
        rig.controller.die()
        assert rig.outcome(rig.mirrors.ping) == "silent"
    assert rig.cables.rail_on
    state = rig.mirrors.state
    assert not state.connected
    assert "only a power cycle" in (state.fault or "")
    with pytest.raises(NotConnected, match="power cycle"):
        rig.mirrors.steer(ASIDE)


def test_a_strict_controller_works_again_after_a_power_cycle_and_starts_parked() -> None:
    rig = loopback(strict=True)
    rig.controller.die()
    assert rig.outcome(rig.mirrors.ping) == "silent"
    with pytest.raises(Timeout, match="power cycle"):
        rig.mirrors.connect()
    assert "power cycle" in (rig.mirrors.state.fault or "")

    rig.controller.power_cycle()
    seen = len(rig.cables.drives)
    rig.mirrors.connect()

    assert rig.mirrors.state.fault is None
    assert rig.mirrors.state.volts == PARKED
    assert [codes for _, codes in rig.cables.drives[seen:]] == [REST]
    assert rig.outcome(lambda: rig.mirrors.expose(ASIDE, settle_us=100, pulse_us=4000)) == "done"
    rig.mirrors.close()


def test_an_exposure_after_a_lost_packet_waits_for_the_mirrors() -> None:
    rig = loopback(strict=False)
    rig.controller.damage_to_host(LineDamage(kind=DamageKind.DROP, skip=5))
    assert rig.outcome(rig.mirrors.ping) == "recovered"
    rig.controller.heal()

    rig.mirrors.expose(ASIDE, settle_us=14_000, pulse_us=4000)

    moved_ns = next(t_ns for t_ns, codes in reversed(rig.cables.drives) if codes == REST)
    assert rig.cables.triggers[-1].t_ns - rig.cables.drives[-1][0] >= 14_000_000
    assert rig.cables.drives[-1][0] > moved_ns
    rig.mirrors.close()


def test_silence_is_reported_within_a_second() -> None:
    supervision = LinkSupervision()
    answer_s, probe_s = (one + min(STALL_S, one) for one in (supervision.answer_s, supervision.probe_s))
    assert answer_s + PROBES * probe_s <= 0.75


def test_silence_is_reported_and_ends_with_a_reconnect(rig: Rig) -> None:
    rig.controller.configure(silent=True)
    assert rig.outcome(lambda: rig.mirrors.expose(PARKED, settle_us=0, pulse_us=1000)) == "silent"
    assert rig.outcome(rig.mirrors.ping) == "gone"
    assert "power cycle" in (rig.mirrors.state.fault or "")

    rig.controller.configure(silent=False)
    rig.mirrors.connect()

    assert rig.codes() == REST
    assert rig.mirrors.state.fault is None


def test_unplugging_ends_a_pending_request_at_once(waiting: Rig) -> None:
    waiting.controller.configure(silent=True)
    with ThreadPoolExecutor(1) as pool:
        began_s = time.monotonic()
        pending = pool.submit(waiting.mirrors.ping)
        waiting.controller.unplug()
        with pytest.raises(NotConnected, match="plug"):
            pending.result(timeout=5)

    assert time.monotonic() - began_s < HUNG_S
    assert not waiting.mirrors.state.connected
    assert "plug" in (waiting.mirrors.state.fault or "")


@pytest.mark.parametrize("keep_power", [False, True])
def test_a_replugged_controller_is_initialised_and_parked_before_anything_else(
    rig: Rig, keep_power: bool
) -> None:
    rig.controller.unplug(keep_power=keep_power)
    assert rig.outcome(rig.mirrors.ping) == "gone"
    with pytest.raises(NotConnected):
        rig.mirrors.connect()
    rig.controller.plug()
    rig.controller.status()
    seen = len(rig.cables.drives)

    rig.mirrors.connect()

    rig.controller.status()
    assert {codes for _, codes in rig.cables.drives[seen:]} == {REST}
    assert [on for _, on in rig.cables.rails] == [True, False, True]
    assert rig.mirrors.state.volts == PARKED
    assert rig.mirrors.steer(ASIDE) == rig.mirrors.state.volts


def test_a_controller_that_restarted_by_itself_is_noticed_by_the_watchdog() -> None:
    rig = loopback(strict=False)
    rig.mirrors.ping()
    assert isinstance(rig.controller, LoopbackController)
    rig.controller.clock.sleep_until_ns(3_000_000_000)
    rig.controller.power_cycle()

    with pytest.raises(NotConnected, match="restarted by itself"):
        rig.mirrors.ping()

    assert "restarted" in (rig.mirrors.state.fault or "")
    rig.mirrors.connect()
    assert rig.mirrors.state.enabled
    rig.mirrors.close()


class MovingCables(RecordingCables):
    """Cables that tell when the mirrors have left their rest."""

    def __init__(self) -> None:
        super().__init__()
        self.moved = threading.Event()

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        super().set_codes(t_ns, codes)
        if codes != REST and any(codes):
            self.moved.set()


def test_park_moves_the_mirrors_at_once_while_another_thread_waits_for_its_exposure(
    controllers: Controllers,
) -> None:
    cables = MovingCables()
    process = controllers.fresh(cables, strict=True)
    with ThreadPoolExecutor(1) as pool:
        mirrors = ControllerMirrors(process.open, MonotonicClock(), supervision=PATIENT)
        mirrors.connect()
        pending = pool.submit(mirrors.expose, ASIDE, settle_us=3_000_000, pulse_us=4000)
        assert cables.moved.wait(5)

        began_s = time.monotonic()
        mirrors.park()
        took_s = time.monotonic() - began_s
        receipt = pending.result(timeout=20)
        process.status()

        assert took_s < 1.5  # it did not wait for the exposure
        assert receipt.volts == PARKED == mirrors.state.volts
        parked_ns = cables.drives[-1][0]
        assert cables.codes == REST
        assert cables.triggers[-1].t_ns > parked_ns
        mirrors.close()


def test_park_waits_for_no_pending_request_of_a_silent_controller(waiting: Rig) -> None:
    waiting.controller.configure(silent=True)
    with ThreadPoolExecutor(1) as pool:
        pending = pool.submit(waiting.outcome, waiting.mirrors.ping)
        waiting.mirrors.park()
        assert not pending.done()
        assert pending.result(timeout=5) == "silent"


def test_a_park_that_nobody_acknowledges_is_not_called_confirmed(rig: Rig) -> None:
    rig.controller.configure(silent=True)
    assert rig.outcome(lambda: rig.mirrors.park_confirmed(within_s=0.2)) == "silent"


@pytest.mark.parametrize("skip", [0, 8, 30, 60])
@pytest.mark.parametrize("damage", ["damage_to_device", "damage_to_host"])
def test_a_park_is_confirmed_although_a_byte_is_lost(damage: str, skip: int) -> None:
    rig = loopback(strict=False)
    getattr(rig.controller, damage)(LineDamage(kind=DamageKind.DROP, skip=skip))

    assert rig.outcome(lambda: rig.mirrors.park_confirmed(within_s=0.4)) == "done"

    assert rig.codes() == REST
    rig.mirrors.close()


def test_threads_share_the_driver_without_mixing_their_replies(rig: Rig) -> None:
    def work(_: int) -> int:
        for step in range(25):
            rig.mirrors.steer(PARKED if step % 2 else ASIDE)
            rig.mirrors.ping()
        rig.mirrors.expose(ASIDE, settle_us=100, pulse_us=4000)
        return 1

    with ThreadPoolExecutor(4) as pool:
        assert sum(pool.map(work, range(4))) == 4

    assert rig.mirrors.state.connected
    assert rig.controller.status().malformed == 0
    assert len(rig.cables.triggers) == 4
