"""Main program of the simulated mirror controller: a pty for the host, a socket for the world.

`python -m foveacam_hardware.sim.far_ends.controller_main --socket FD --port PATH [--strict]
[--version 2.1.0]` is started by `controller_process.ControllerProcess` and ends with it. Both use
CLOCK_MONOTONIC. Messages on the socket are JSON lines, documented in `side_channel`.
"""

import dataclasses
import sys
from collections import deque

from foveacam_hardware.contract import MonotonicClock, Role
from foveacam_hardware.sim.far_ends.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.far_ends.far_end_server import (
    FarEndServer,
    PtyPort,
    argument_parser,
    inherited_socket,
)
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus, Message, SideChannel


class _CableSender:
    """Cables whose signals go to the parent process."""

    def __init__(self, channel: SideChannel) -> None:
        self._channel = channel
        self.commands: deque[Message] = deque()
        """Commands that arrived during the wait for a strobe."""

    def set_codes(self, t_ns: int, codes: tuple[int, ...]) -> None:
        self._channel.send({"event": "drive", "t_ns": t_ns, "codes": codes})

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        self._channel.send({"event": "rail", "t_ns": t_ns, "on": on})

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        self._channel.send({"event": "low_pass", "t_ns": t_ns, "cutoff_hz": cutoff_hz})

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        self._channel.send({"event": "trigger", "t_ns": t_ns, "pulse_us": pulse_us, "cameras": cameras})

    def strobe_us(self, role: Role) -> int | None:
        self._channel.send({"ask": "strobe", "role": str(role)})
        while True:
            for message in self._channel.receive():
                if "strobe_us" not in message:
                    self.commands.append(message)
                    continue
                exposure_us: int | None = message["strobe_us"]
                return exposure_us


def execute_command(far_end: ControllerFarEnd, message: Message) -> Message:
    """Execute a command from the parent; return the controller's status."""
    match message["command"]:
        case "set":
            far_end.strict = message.get("strict", far_end.strict)
            far_end.silent = message.get("silent", far_end.silent)
            far_end.fragile = message.get("fragile", far_end.fragile)
            far_end.firmware.clock_ppm = message.get("clock_ppm", far_end.firmware.clock_ppm)
        case "die":
            far_end.die()
        case "power_cycle":
            far_end.power_cycle()
        case "unplug":
            far_end.unplug(keep_power=message["keep_power"])
        case "plug":
            far_end.plug()
    status = ControllerStatus(
        dead=far_end.dead, enabled=far_end.firmware.enabled, malformed=far_end.malformed
    )
    return dataclasses.asdict(status)


def main(arguments: list[str] | None = None) -> int:
    """Run the controller until its parent ends."""
    options = argument_parser("simulated mirror controller on a pty")
    options.add_argument(
        "--strict", action="store_true", help="have the faults of the controllers in the field"
    )
    options.add_argument("--version", default="2.1.0", help="firmware version to answer with")
    options.add_argument(
        "--strobe-delay-us", nargs=2, type=int, default=(0, 0), help="of the left and the right camera"
    )
    options.add_argument("--clock-ppm", type=float, default=0.0, help="how much faster its clock runs")
    given = options.parse_args(arguments)
    major, minor, patch = (int(part) for part in given.version.split("."))
    with inherited_socket(given) as link:
        channel, clock = SideChannel(link), MonotonicClock()
        cables = _CableSender(channel)
        far_end = ControllerFarEnd(clock, cables, strict=given.strict, version=(major, minor, patch))
        far_end.be_flawed(strobe_delay_us=given.strobe_delay_us, clock_ppm=given.clock_ppm)
        host = FarEndServer(far_end, channel, PtyPort(given.port), clock=clock, inbox=cables.commands)
        host.run(lambda message: execute_command(far_end, message))
    return 0


if __name__ == "__main__":
    sys.exit(main())
