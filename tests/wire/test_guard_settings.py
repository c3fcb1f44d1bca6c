"""A firmware that watches over its host: given its limits at the connect, fed while the host lives."""

import threading
import time

from tests.support.devices.firmware_board import Item
from tests.support.devices.firmware_process import FirmwareProcess
from tests.wire.firmware.test_firmware_driver import Loop

from foveacam_hardware.contract import PARKED, MirrorLimits, MirrorVolts, MonotonicClock, StereoVolts
from foveacam_hardware.drivers.controller.guard import WATCHDOG_MS, LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.wire.link import SerialLink


def test_the_watchdog_and_the_rigs_limits_are_in_force_after_the_connect() -> None:
    loop = Loop()
    loop.mirrors = ControllerMirrors(loop.open, loop.clock, MirrorLimits(max_v=158.0, bias_v=80.0))
    loop.mirrors.connect()

    items = {
        item: loop.board.item(item) for item in (Item.WATCHDOG_MS, Item.CHANNEL_MAX, Item.DIFFERENCE_MAX)
    }
    assert items == {
        Item.WATCHDOG_MS: WATCHDOG_MS,
        Item.CHANNEL_MAX: round(65_535 * 159 / 200) + 1,
        Item.DIFFERENCE_MAX: round(65_535 * 158 / 200) + 1,
    }
    assert loop.mirrors.state.guarded
    loop.mirrors.close()


def test_a_host_that_says_nothing_keeps_its_mirrors_on_as_long_as_it_lives() -> None:
    with FirmwareProcess() as process:
        mirrors = ControllerMirrors(
            lambda: SerialLink(process.port), MonotonicClock(), supervision=LinkSupervision(answer_s=5.0)
        )
        mirrors.connect()
        began_s, waiting = time.monotonic(), threading.Event()
        end_s = began_s + 1.5 * WATCHDOG_MS / 1000
        while time.monotonic() < end_s:  # silence of its caller is what is tested
            waiting.wait(0.1)

        # Refused by a firmware that has parked them, which a ping tells
        mirrors.steer(StereoVolts(left=MirrorVolts(x_v=5.0, y_v=0.0), right=PARKED.right))
        mirrors.ping()

        assert mirrors.state.enabled
        assert mirrors.telemetry.lost_answers == 0
        mirrors.close()
