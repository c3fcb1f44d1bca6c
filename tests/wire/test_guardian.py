"""The guardian: whatever ends a host, its mirrors are at rest with the rail off within a second."""

import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from tests.support.devices import guarded_host
from tests.support.devices.controllers import Controllers, started

from foveacam_hardware.contract import MonotonicClock
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.guardian import Guardian
from foveacam_hardware.drivers.controller.guardian_parking import park_and_disable
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import DacCodes, RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage
from foveacam_hardware.wire.cobs import CobsDecoder
from foveacam_hardware.wire.controller import (
    Packet,
    PacketMethod,
    PacketProperty,
    decode_packet,
    encode_packet,
)
from foveacam_hardware.wire.controller_payloads import pack_u8
from foveacam_hardware.wire.guardian import ParkingPlan
from foveacam_hardware.wire.open_file import OpenPort

REST = (29490,) * 8
HOST = Path(guarded_host.__file__)
PATIENCE_S = 30.0


class WatchedCables(RecordingCables):
    """Cables that tell when the rail goes off."""

    def __init__(self) -> None:
        super().__init__()
        self.off = threading.Event()

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        super().set_rail(t_ns, on=on)
        if not on:
            self.off.set()

    def codes_at(self, t_ns: int) -> DacCodes:
        return [codes for at_ns, codes in self.drives if at_ns <= t_ns][-1]


@dataclass
class Host:
    process: subprocess.Popen[str]
    guardian_pid: int

    def await_guardians_end(self) -> None:
        try:
            handle = os.pidfd_open(self.guardian_pid)
        except ProcessLookupError:
            return
        with os.fdopen(handle):
            ended, _, _ = select.select([handle], [], [], PATIENCE_S)
        assert ended


@contextmanager
def hosting(controller: ControllerProcess, ending: str) -> Iterator[Host]:
    command = [sys.executable, str(HOST), controller.port, ending]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        ready, guardian_pid, guarded = process.stdout.readline().split()
        assert (ready, guarded) == ("ready", "True")
        try:
            yield Host(process, int(guardian_pid))
        finally:
            process.kill()


@pytest.fixture
def cables() -> WatchedCables:
    return WatchedCables()


@pytest.fixture(scope="module")
def controllers() -> Iterator[Controllers]:
    with started() as running:
        yield running


@pytest.fixture
def controller(controllers: Controllers, cables: WatchedCables) -> ControllerProcess:
    return controllers.fresh(cables, strict=True)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGSEGV])
def test_a_host_that_is_killed_leaves_parked_mirrors_and_a_free_port(
    number: int, controller: ControllerProcess, cables: WatchedCables
) -> None:
    with hosting(controller, "wait") as host:
        controller.status()
        assert cables.rail_on
        assert cables.codes != REST
        killed_ns = time.monotonic_ns()
        host.process.send_signal(number)
        assert cables.off.wait(PATIENCE_S)
        host.await_guardians_end()

    off_ns = cables.rails[-1][0]
    assert (off_ns - killed_ns) / 1e9 < 1.0
    assert cables.codes_at(off_ns) == REST
    assert controller.status().malformed == 0
    second = ControllerMirrors(controller.open, MonotonicClock(), supervision=LinkSupervision(answer_s=5.0))
    second.connect()
    second.close()


def test_a_host_that_forgets_to_close_is_relieved_too(
    controller: ControllerProcess, cables: WatchedCables
) -> None:
    with hosting(controller, "leave") as host:
        assert cables.off.wait(PATIENCE_S)
        host.await_guardians_end()

    assert cables.codes == REST


def test_a_host_that_closes_as_it_should_needs_no_guardian(
    controller: ControllerProcess, cables: WatchedCables
) -> None:
    with hosting(controller, "close") as host:
        assert host.process.wait(PATIENCE_S) == 0
        host.await_guardians_end()

    controller.status()
    assert [on for _, on in cables.rails] == [True, False]
    assert cables.codes == REST


@pytest.fixture
def guardian() -> Iterator[Guardian]:
    built = Guardian()
    yield built
    built.close()


def test_a_port_handed_over_is_free_again_after_each_close(
    controller: ControllerProcess, guardian: Guardian
) -> None:
    mirrors = ControllerMirrors(
        controller.open, MonotonicClock(), supervision=LinkSupervision(guardian=guardian, answer_s=5.0)
    )
    for _ in range(3):
        mirrors.connect()
        assert mirrors.state.guarded
        mirrors.close()
        assert not mirrors.state.guarded


def test_the_guardian_holds_the_port_of_a_reconnect(
    controller: ControllerProcess, guardian: Guardian
) -> None:
    mirrors = ControllerMirrors(
        controller.open, MonotonicClock(), supervision=LinkSupervision(guardian=guardian, answer_s=5.0)
    )
    mirrors.connect()
    before = guardian.pid
    controller.unplug()
    controller.plug()
    controller.status()

    mirrors.connect()

    assert mirrors.state.guarded
    assert guardian.pid == before
    mirrors.close()


def test_a_guardian_that_was_killed_is_replaced_at_the_next_ping(
    controller: ControllerProcess, guardian: Guardian
) -> None:
    mirrors = ControllerMirrors(
        controller.open, MonotonicClock(), supervision=LinkSupervision(guardian=guardian, answer_s=5.0)
    )
    mirrors.connect()
    first = guardian.pid
    assert first is not None
    with os.fdopen(os.pidfd_open(first)) as handle:
        os.kill(first, signal.SIGKILL)
        assert select.select([handle], [], [], PATIENCE_S)[0]
    alone = mirrors.state

    mirrors.ping()

    assert (alone.guarded, mirrors.state.guarded) == (False, True)
    assert guardian.pid != first
    mirrors.close()


class ClingingPort(OpenPort):
    """A controller whose rail is still on after it has acknowledged the first request to switch it off."""

    def __init__(self) -> None:
        self.asked_off = 0
        self._answers = b""

    def write(self, data: bytes) -> None:
        for frame in CobsDecoder().feed(data):
            asked = decode_packet(frame)
            if asked.prop is PacketProperty.ENABLE:
                self.asked_off += asked.method is PacketMethod.SET
                on = asked.method is PacketMethod.GET and self.asked_off < 2
                answer = Packet(PacketMethod.ACK, asked.prop, asked.sequence, pack_u8(int(on)))
                self._answers += encode_packet(answer)

    def read(self, timeout_s: float) -> bytes:
        answers, self._answers = self._answers, b""
        return answers

    def wait(self, duration_s: float) -> None:
        """Need no time."""


def test_a_rail_that_stays_on_although_its_end_was_acknowledged_is_switched_off_again() -> None:
    port = ClingingPort()

    outcome = park_and_disable(port, ParkingPlan(port="here", rest=b"", settle_ms=13))

    assert outcome.rail_off
    assert port.asked_off == 2


def test_a_byte_lost_while_the_guardian_parks_does_not_stop_it(
    controllers: Controllers, cables: WatchedCables
) -> None:
    controller = controllers.fresh(cables, strict=False)
    with hosting(controller, "wait") as host:
        # The last byte of the packets to rest: without it the first request to switch off is lost.
        controller.damage_to_device(LineDamage(kind=DamageKind.DROP, skip=4 * 24 - 1))
        host.process.kill()
        assert cables.off.wait(PATIENCE_S)
        host.await_guardians_end()
    assert cables.codes == REST
