"""A far end whose process is killed: it is reaped, and comes back as a device that was plugged in again."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from foveacam_hardware.contract import (
    PARKED,
    MirrorVolts,
    MonotonicClock,
    NotConnected,
    StereoVolts,
)
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import NO_CODES, RecordingCables
from foveacam_hardware.sim.far_ends.board_far_end import BoardKind
from foveacam_hardware.sim.far_ends.board_process import BoardProcess
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.far_end_process import RESTART_DELAY_S
from foveacam_hardware.sim.pan_tilt import TurningHistory
from foveacam_hardware.sim.rig import SLOW_LINK

PATIENCE_S = 30.0
ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=5.0), right=MirrorVolts(x_v=-10.0, y_v=0.0))


def wait_until(true: Callable[[], bool]) -> None:
    """Ask again and again, for another process's doing."""
    end_s = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.02)


def rail_on(cables: RecordingCables) -> bool:
    """Tell what the rail's cable was told last."""
    return cables.rail_on


def reaped(pid: int) -> bool:
    """Tell whether not even a zombie is left."""
    return not Path(f"/proc/{pid}").exists()


def test_mirrors_whose_controller_is_killed_are_dark_and_come_back_parked() -> None:
    cables = RecordingCables()
    with ControllerProcess(cables) as controller:
        port, killed = Path(controller.port), controller.pid
        mirrors = ControllerMirrors(controller.open, MonotonicClock(), supervision=SLOW_LINK)
        mirrors.connect()
        mirrors.steer(ASIDE)
        controller.status()  # every event before it was delivered
        assert rail_on(cables)

        os.kill(killed, signal.SIGKILL)
        killed_s = time.monotonic()
        wait_until(lambda: cables.codes == NO_CODES)
        assert not rail_on(cables)
        assert reaped(killed)
        with pytest.raises(NotConnected):
            mirrors.ping()

        wait_until(lambda: controller.pid != killed and port.exists())
        assert time.monotonic() - killed_s >= RESTART_DELAY_S
        mirrors.connect()
        assert mirrors.state.connected
        assert mirrors.state.volts == PARKED
        controller.status()
        assert rail_on(cables)
        mirrors.close()


def test_closing_while_the_process_is_gone_starts_no_other() -> None:
    controller = ControllerProcess(RecordingCables())
    killed, folder = controller.pid, Path(controller.port).parent
    os.kill(killed, signal.SIGKILL)
    wait_until(lambda: reaped(killed))

    controller.close()

    assert controller.pid == killed
    assert not folder.exists()


@pytest.mark.parametrize(
    ("kind", "orders"),
    [(BoardKind.GRBL_WITH_RAIL, (b"$X\n", b"$J=G91X-60F1500\n")), (BoardKind.PTU, (b"PP1500 ",))],
)
def test_a_killed_board_stops_its_motors_and_comes_back_where_they_stand(
    kind: BoardKind, orders: tuple[bytes, ...]
) -> None:
    rig = TurningHistory()
    with BoardProcess(kind, rig) as board:
        link, killed = board.open(), board.pid
        for order in orders:
            link.write(order)
        wait_until(lambda: abs(rig.bearing_deg(time.monotonic_ns())[0]) > 1.0)

        os.kill(killed, signal.SIGKILL)
        link.close()
        wait_until(lambda: reaped(killed) and rig.speed_deg_s(time.monotonic_ns()) == (0.0, 0.0))
        stood_deg = rig.bearing_deg(time.monotonic_ns())
        assert abs(stood_deg[0]) > 1.0

        wait_until(lambda: board.pid != killed and Path(board.port).exists())
        assert rig.bearing_deg(time.monotonic_ns()) == pytest.approx(stood_deg, abs=0.02)  # to a step
