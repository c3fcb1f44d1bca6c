"""The driver on the compiled firmware, in one process and on virtual time, behind a line that has faults."""

from collections.abc import Callable
from typing import cast

from foveacam_hardware.contract import MirrorVolts, StereoVolts, VirtualClock
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackLink
from foveacam_hardware.sim.far_ends.line_faults import LineFaults
from tests.support.devices.firmware_board import START_US
from tests.wire.firmware.test_firmware_driver import ClockedBoard

ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-170.0, y_v=5.0))


class DamagedBoard(ClockedBoard):
    """The firmware behind a line that has faults; `sent`: by the host, `received`: by it, undamaged."""

    def __init__(self, clock: VirtualClock) -> None:
        self.to_device, self.to_host = LineFaults(), LineFaults()
        self.sent = self.received = b""
        super().__init__(clock)

    def feed(self, data: bytes) -> None:
        self.sent += data
        super().feed(self.to_device.apply(data))

    def take_output(self) -> bytes:
        data = super().take_output()
        self.received += data
        return self.to_host.apply(data)


class Rig:
    """The driver on the compiled firmware."""

    def __init__(
        self,
        supervision: LinkSupervision | None = None,
        *,
        board: Callable[[VirtualClock], DamagedBoard] = DamagedBoard,
    ) -> None:
        self.clock = VirtualClock(START_US * 1000)
        self.board = board(self.clock)
        self.mirrors = ControllerMirrors(self.open, self.clock, supervision=supervision)

    def open(self) -> LoopbackLink:
        # The link asks of a far end only what the board has as well.
        return LoopbackLink(cast(ControllerFarEnd, self.board), self.clock)
