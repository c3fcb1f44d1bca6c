"""A simulated pan-tilt's or rail's board in its own process, as its parent sees it: shafts, faults, port."""

from types import TracebackType
from typing import Unpack

from foveacam_hardware.sim.far_ends.board_far_end import Impairment
from foveacam_hardware.sim.far_ends.board_kinds import BoardKind
from foveacam_hardware.sim.far_ends.far_end_process import FarEndProcess
from foveacam_hardware.sim.far_ends.line_faults import Damage
from foveacam_hardware.sim.far_ends.side_channel import Message
from foveacam_hardware.sim.pan_tilt import PanTiltCables, Turning
from foveacam_hardware.wire.link import Link, SerialLink

MODULE = "foveacam_hardware.sim.far_ends.board_process"


class BoardProcess:
    """A simulated board in its own process, whose motors turn `cables`; a context manager.

    It starts while others do: `open` and the faults wait for it. Each fault returns once it is in force.
    """

    def __init__(self, kind: BoardKind, cables: PanTiltCables) -> None:
        self._cables = cables
        self._process = FarEndProcess(MODULE, "pan-tilt", self._receive, options=["--kind", kind.value])
        self.port = self._process.port
        """The path to open, as one would open /dev/serial/by-id/…; it is gone while unplugged."""

    def __enter__(self) -> "BoardProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process and its thread; harmless when closed."""
        self._process.close()

    def open(self) -> Link:
        """Open its port, as a driver's link factory."""
        self._process.wait_until_ready()
        return SerialLink(self.port)

    def impair(self, **changes: Unpack[Impairment]) -> None:
        """Change how it behaves; what is left out stays."""
        self._process.obey("impair", changes=changes)

    def damage_to_device(self, damage: Damage) -> None:
        """Damage bytes on their way to the board."""
        self._process.damage(damage, to="device")

    def damage_to_host(self, damage: Damage) -> None:
        """Damage bytes on their way to the host."""
        self._process.damage(damage, to="host")

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit."""
        self._process.obey("hit_a_limit")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._process.obey("power_cycle")

    def unplug(self) -> None:
        """Pull the cable."""
        self._process.obey("unplug")

    def plug(self) -> None:
        """Put the cable back."""
        self._process.obey("plug")

    def _receive(self, message: Message) -> None:
        names = ("place_deg", "speed_deg_s", "acceleration_deg_s2", "slide_mm")
        fields = {name: tuple(message[name]) for name in names}
        self._cables.turn(Turning(t_ns=message["t_ns"], **fields))
