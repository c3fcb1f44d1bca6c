"""The simulated FLIR unit in its own process, as its parent sees it: shafts, faults, port."""

from types import TracebackType

from foveacam_hardware.sim.far_ends.far_end_process import FarEndProcess
from foveacam_hardware.sim.far_ends.line_faults import Damage
from foveacam_hardware.sim.far_ends.side_channel import Message
from foveacam_hardware.sim.pan_tilt import PanTiltCables, Turning
from foveacam_hardware.wire.link import Link, SerialLink

MODULE = "foveacam_hardware.sim.far_ends.ptu_process"


class PtuProcess:
    """A simulated FLIR unit in its own process, whose motors turn `cables`; a context manager.

    It starts while others do: `open` and the faults wait for it. Each fault returns once it is in force.
    """

    def __init__(self, cables: PanTiltCables) -> None:
        self._cables = cables
        self._process = FarEndProcess(MODULE, "pan-tilt", self._receive)
        self.port = self._process.port
        """The path to open, as one would open /dev/serial/by-id/…; it is gone while unplugged."""

    def __enter__(self) -> "PtuProcess":
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

    def configure(
        self,
        *,
        silent: bool | None = None,
        slow_ns: int | None = None,
        seized: bool | None = None,
        steps_per_s: int | None = None,
    ) -> None:
        """Change how it behaves, or how fast it can turn; what is None stays."""
        given = {"silent": silent, "slow_ns": slow_ns, "seized": seized, "steps_per_s": steps_per_s}
        self._process.obey("set", **{name: value for name, value in given.items() if value is not None})

    def damage_to_device(self, damage: Damage) -> None:
        """Damage bytes on their way to the unit."""
        self._process.damage(damage, to="device")

    def damage_to_host(self, damage: Damage) -> None:
        """Damage bytes on their way to the host."""
        self._process.damage(damage, to="host")

    def hit_a_limit(self) -> None:
        """Let the pan axis run into its limit."""
        self._process.obey("hit_a_limit")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._process.obey("power_cycle")

    def unplug(self) -> None:
        """Pull its serial cable."""
        self._process.obey("unplug")

    def plug(self) -> None:
        """Put the cable back."""
        self._process.obey("plug")

    def _receive(self, message: Message) -> None:
        names = ("place_deg", "speed_deg_s", "acceleration_deg_s2", "slide_mm")
        fields = {name: tuple(message[name]) for name in names}
        self._cables.turn(Turning(t_ns=message["t_ns"], **fields))
