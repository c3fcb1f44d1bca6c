"""The driver of the real rig on the compiled firmware: in this process on simulated time, and on a pty."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import cast

import pytest
from tests.support.devices.firmware_board import REST, START_US, FirmwareBoard, Item
from tests.support.devices.firmware_build import built
from tests.support.devices.firmware_process import FirmwareProcess

from foveacam_hardware.contract import (
    PARKED,
    DeviceFault,
    MirrorVolts,
    MonotonicClock,
    NotConnected,
    StereoVolts,
    VirtualClock,
)
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import TRIGGER_TO_EXPOSURE_US
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackLink
from foveacam_hardware.wire.link import SerialLink

ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-170.0, y_v=5.0))
STEP_V = 200 / 65_535


class ClockedBoard(FirmwareBoard):
    """A board whose time follows a clock that others move too."""

    def __init__(self, clock: VirtualClock) -> None:
        super().__init__(now_us=clock.now_ns() // 1000)
        self._clock = clock

    def feed(self, data: bytes) -> None:
        self.advance(self._clock.now_ns())
        super().feed(data)


class Loop:
    """Driver and firmware in one process."""

    def __init__(self) -> None:
        self.clock = VirtualClock(START_US * 1000)
        self.board = ClockedBoard(self.clock)
        self.mirrors = ControllerMirrors(self.open, self.clock)

    def open(self) -> LoopbackLink:
        # The link asks of a far end only what the board has as well.
        return LoopbackLink(cast(ControllerFarEnd, self.board), self.clock)


@pytest.fixture
def loop() -> Iterator[Loop]:
    loop = Loop()
    loop.mirrors.connect()
    yield loop
    loop.mirrors.close()


def differences(codes: tuple[int, ...]) -> list[float]:
    return [(codes[i] - codes[i + 1]) * STEP_V for i in (0, 2, 4, 6)]


def axes_v(volts: StereoVolts) -> list[float]:
    return [volts.left.x_v, volts.left.y_v, volts.right.x_v, volts.right.y_v]


def test_the_driver_connects_and_finds_the_mirrors_parked(loop: Loop) -> None:
    state = loop.mirrors.state

    assert (state.connected, state.enabled, state.volts, state.fault) == (True, True, PARKED, None)
    assert loop.mirrors.info.version == "2.1.0"
    assert loop.board.pins.codes == REST
    assert loop.board.pins.rail_on
    assert loop.board.pins.clocks[-1][1] == 120 * 60


def test_the_driver_steers_exposes_parks_and_closes(loop: Loop) -> None:
    actual = loop.mirrors.steer(ASIDE)
    assert differences(loop.board.pins.codes) == pytest.approx(axes_v(actual), abs=1e-9)
    assert axes_v(actual) == pytest.approx(axes_v(ASIDE), abs=STEP_V / 2 + 1e-9)

    receipt = loop.mirrors.expose(ASIDE, settle_us=10_000, pulse_us=4000)
    assert receipt.volts == actual
    assert receipt.t_exposure_start_ns - receipt.t_trigger_ns == pytest.approx(
        TRIGGER_TO_EXPOSURE_US * 1000, abs=1000
    )

    loop.mirrors.park()
    assert loop.board.pins.codes == REST
    loop.mirrors.close()
    assert not loop.board.pins.rail_on


def test_a_missing_strobe_reaches_the_caller_in_words_and_the_next_exposure_is_served(loop: Loop) -> None:
    loop.board.strobe(1, None)
    with pytest.raises(DeviceFault, match="Strobe timeout"):
        loop.mirrors.expose(ASIDE, settle_us=0, pulse_us=4000)
    assert loop.board.pins.high == 0

    loop.board.strobe(1, 5000)
    assert loop.mirrors.expose(ASIDE, settle_us=0, pulse_us=4000).frame_id == 1


def test_a_driver_that_was_away_too_long_reconnects_to_mirrors_that_the_watchdog_parked() -> None:
    loop = Loop()
    loop.mirrors.connect()
    loop.mirrors.steer(ASIDE)
    loop.board.run_for(3_000_000)  # the host hangs
    assert loop.board.pins.codes == REST
    assert not loop.board.pins.rail_on

    loop.clock.sleep_until_ns(loop.board.now_us * 1000)
    again = ControllerMirrors(loop.open, loop.clock)
    again.connect()
    actual = again.steer(ASIDE)

    assert differences(loop.board.pins.codes) == pytest.approx(axes_v(actual), abs=1e-9)
    again.close()
    assert loop.board.item(Item.WATCHDOG_PARKS) == 1
    with pytest.raises(NotConnected, match="restarted, or another program"):
        loop.mirrors.expose(ASIDE, settle_us=0, pulse_us=4000)
    loop.mirrors.close()


def test_on_a_pty_the_driver_connects_steers_exposes_parks_and_closes() -> None:
    with FirmwareProcess() as process:
        mirrors = ControllerMirrors(
            lambda: SerialLink(process.port), MonotonicClock(), supervision=LinkSupervision(answer_s=5.0)
        )
        mirrors.connect()
        try:
            actual = mirrors.steer(ASIDE)
            mirrors.ping()
            process.wait_until(
                lambda: differences(process.pins.codes) == pytest.approx(axes_v(actual), abs=1e-9), "the move"
            )
            receipt = mirrors.expose(ASIDE, settle_us=2000, pulse_us=4000)
            assert receipt.volts == actual
            process.wait_until(
                lambda: [high for _, high in process.pins.triggers][-2:] == [6, 0], "rise and fall"
            )
            mirrors.park()
            process.wait_until(lambda: process.pins.codes == REST, "the park")
        finally:
            mirrors.close()
        process.wait_until(lambda: not process.pins.rail_on, "the rail")
        assert process.pins.clocks[-1][1] == 0


HOST = """
import sys, time
from foveacam_hardware.contract import MirrorVolts, MonotonicClock, StereoVolts
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.wire.link import SerialLink
link = LinkSupervision(answer_s=5.0)
mirrors = ControllerMirrors(lambda: SerialLink(sys.argv[1]), MonotonicClock(), supervision=link)
mirrors.connect()
aside = MirrorVolts(x_v=100.0, y_v=0.0)
mirrors.steer(StereoVolts(left=aside, right=aside))
print(mirrors.ping(), flush=True)
sys.stdin.read()
"""


def test_on_a_pty_the_watchdog_parks_the_mirrors_of_a_host_that_was_killed() -> None:
    with FirmwareProcess() as process:
        host = subprocess.Popen(
            [sys.executable, "-c", HOST, process.port], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        try:
            assert host.stdout is not None
            assert host.stdout.readline()
            process.wait_until(lambda: process.pins.codes not in (REST, (0,) * 8), "the move")
        finally:
            os.kill(host.pid, signal.SIGKILL)
            host.communicate()

        process.wait_until(lambda: process.pins.codes == REST, "the park")
        process.wait_until(lambda: not process.pins.rail_on, "the rail")
        assert process.pins.rails[-1][0] > process.pins.drives[-1][0]


def test_on_stdio_the_program_answers_and_tells_its_pins() -> None:
    said = subprocess.run(
        [built("fovea-controller")],
        input=bytes.fromhex("04 13 12 01 01 00"),
        capture_output=True,
        check=True,
        timeout=10,
    )

    assert said.stdout == bytes.fromhex("04 30 32 01 03 02 01 01 00")
    assert said.stderr.startswith(b"rail ")
