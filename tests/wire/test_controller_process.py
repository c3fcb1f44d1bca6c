"""The simulated controller's own process: its port, its cables to the world, and its end."""

import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from foveacam_hardware.contract import DeviceFault, Role
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.wire.link import ByteLink

ORPHAN_MAKER = """
import os
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
print(ControllerProcess(RecordingCables()).pid, flush=True)
os._exit(1)
"""


def exchange(link: ByteLink, sent: str, *, reply_bytes: int) -> bytes:
    link.write(bytes.fromhex(sent))
    received = b""
    while len(received) < reply_bytes and (piece := link.read(2.0)):
        received += piece
    return received


def test_the_port_answers_the_golden_request() -> None:
    with ControllerProcess(RecordingCables()) as process:
        link = process.open()
        reply = exchange(link, "04 13 12 01 01 00", reply_bytes=9)
        link.close()

    assert reply == bytes.fromhex("04 30 32 01 03 02 01 01 00")


def test_the_process_ends_and_the_port_goes_with_close() -> None:
    process = ControllerProcess(RecordingCables())
    port = Path(process.port)
    assert port.exists()

    process.close()
    process.close()

    assert not port.parent.exists()
    with pytest.raises(ProcessLookupError):
        os.kill(process.pid, 0)
    with pytest.raises(DeviceFault, match="did not answer 'status'"):
        process.status()


def test_the_process_dies_with_a_parent_that_was_killed() -> None:
    orphan = subprocess.run([sys.executable, "-c", ORPHAN_MAKER], capture_output=True, text=True, check=False)
    pid = int(orphan.stdout)
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:  # it is gone already
        ended = [pid]
    else:
        with os.fdopen(handle):
            ended, _, _ = select.select([handle], [], [], 10)
    assert ended


def test_the_port_is_gone_while_unplugged_and_the_same_again_after() -> None:
    with ControllerProcess(RecordingCables()) as process:
        process.unplug()
        assert not Path(process.port).exists()

        process.plug()
        link = process.open()
        assert exchange(link, "04 13 12 01 01 00", reply_bytes=9)
        link.close()


class AskedCables(RecordingCables):
    """Cables that count what is asked of them."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[Role] = []

    def strobe_us(self, role: Role) -> int | None:
        self.asked.append(role)
        return super().strobe_us(role)


def test_strobes_are_asked_of_the_world_at_the_trigger_and_events_precede_the_report() -> None:
    cables = AskedCables()
    with ControllerProcess(cables) as process:
        link = process.open()
        exchange(link, "04 2d 24 08 02 01 00", reply_bytes=30)
        # Create stream 5, then the golden frame request of it.
        exchange(
            link,
            "04 2a 28 07 01 02 05 01 01 01 01 01 01 01 01 01 01 01 01 01 01 01 01 00",
            reply_bytes=24,
        )
        report = exchange(link, "04 b6 19 15 05 05 06 20 4e 01 03 d0 07 01 01 00", reply_bytes=7 + 30)
        process.status()
        link.close()

    assert cables.asked == [Role.LEFT, Role.RIGHT]
    assert [(edge.pulse_us, edge.cameras) for edge in cables.triggers] == [(20_000, 6)]
    assert report.startswith(bytes.fromhex("04 2c 39 15 01 01 00"))
    assert len(report) > 7
