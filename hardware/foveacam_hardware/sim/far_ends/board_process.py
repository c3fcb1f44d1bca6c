"""Handle on a simulated motor controller board that runs in a process of its own."""

from types import TracebackType
from typing import Unpack

from foveacam_hardware.contract import MonotonicClock
from foveacam_hardware.sim.far_ends.board_far_end import BoardFaults, BoardKind
from foveacam_hardware.sim.far_ends.far_end_process import FarEndProcess
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.sim.far_ends.side_channel import Message
from foveacam_hardware.sim.pan_tilt import AxisPositions, PanTiltCables, TurningHistory, TurnSegment
from foveacam_hardware.wire.link import ByteLink, SerialLink

MODULE = "foveacam_hardware.sim.far_ends.board_main"


class BoardProcess:
    """A simulated board in a process of its own, whose motors drive `cables`; a context manager.

    It starts in the background; `open` waits for it. A fault method returns once the fault is in force. When
    the process dies, its motors stop, and another process replaces it like a board plugged in again.
    """

    def __init__(self, kind: BoardKind, cables: PanTiltCables) -> None:
        receiver = _ShaftReceiver(cables)
        self._process = FarEndProcess(
            MODULE,
            "pan-tilt",
            receiver,
            options=lambda: ["--kind", kind.value, "--place", *map(repr, receiver.positions())],
        )
        self.port = self._process.port
        """The path of the port, like /dev/serial/by-id/…; it does not exist while unplugged."""

    def __enter__(self) -> "BoardProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """The process id; it changes when the process dies and is replaced."""
        return self._process.pid

    def close(self) -> None:
        """End the process and its thread; no effect when closed."""
        self._process.close()

    def open(self) -> ByteLink:
        """Open its port, as a driver's link factory."""
        self._process.wait_until_ready()
        return SerialLink(self.port)

    def set_faults(self, **changes: Unpack[BoardFaults]) -> None:
        """Change faults; keys left out are not changed."""
        self._process.send_command("impair", changes=changes)

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes sent to the board."""
        self._process.damage(damage, to="device")

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes sent to the host."""
        self._process.damage(damage, to="host")

    def hit_a_limit(self) -> None:
        """Let an axis run into its limit."""
        self._process.send_command("hit_a_limit")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._process.send_command("power_cycle")

    def unplug(self) -> None:
        """Unplug the cable."""
        self._process.send_command("unplug")

    def plug(self) -> None:
        """Plug the cable in again."""
        self._process.send_command("plug")


class _ShaftReceiver:
    """Passes the motion of the motors on to `cables`, and keeps the positions across restarts."""

    def __init__(self, cables: PanTiltCables) -> None:
        self._cables = cables
        self._clock = MonotonicClock()  # the same clock as the far end's
        self._history = TurningHistory()

    def receive(self, message: Message) -> None:
        """Pass a segment of motion on."""
        names = ("place_deg", "speed_deg_s", "acceleration_deg_s2", "slide_mm")
        fields = {name: tuple(message[name]) for name in names}
        self._add_segment(TurnSegment(t_ns=message["t_ns"], **fields))

    def lose_power(self) -> None:
        """Stop every axis where it is: the motors have no supply."""
        pan_deg, tilt_deg, rail_mm = self.positions()
        resting = TurnSegment(
            t_ns=self._clock.now_ns(), place_deg=(pan_deg, tilt_deg), slide_mm=(rail_mm, 0.0, 0.0)
        )
        self._add_segment(resting)

    def positions(self) -> AxisPositions:
        """Return the present positions."""
        return self._history.positions(self._clock.now_ns())

    def _add_segment(self, segment: TurnSegment) -> None:
        self._history.add_segment(segment)
        self._cables.add_segment(segment)
