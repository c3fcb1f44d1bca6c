"""The simulated FLIR unit in a process of its own: a pty for the host, a socket for the world.

`python -m foveacam_hardware.sim.far_ends.ptu_process --socket FD --port PATH` is started by
`ptu_host.PtuProcess` and ends with it. Both share CLOCK_MONOTONIC. Messages on the socket are JSON lines.
"""

import dataclasses
import sys
from collections import deque

from foveacam_hardware.contract import MonotonicClock
from foveacam_hardware.sim.far_ends.far_end_host import FarEndHost, connection, parser
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.far_ends.pty_port import PtyPort
from foveacam_hardware.sim.far_ends.side_channel import Message, SideChannel
from foveacam_hardware.sim.pan_tilt import Turning


class _WorldShafts:
    """Motors whose rig is in the parent process."""

    def __init__(self, channel: SideChannel) -> None:
        self._channel = channel

    def turn(self, turning: Turning) -> None:
        self._channel.send({"event": "turn", **dataclasses.asdict(turning)})


def obey(far_end: PtuFarEnd, message: Message) -> Message:
    """Do what a command says, and return the unit's status."""
    match message["command"]:
        case "set":
            far_end.silent = message.get("silent", far_end.silent)
            far_end.slow_ns = message.get("slow_ns", far_end.slow_ns)
            far_end.firmware.seized = message.get("seized", far_end.firmware.seized)
            if "steps_per_s" in message:
                far_end.firmware.hurry(message["steps_per_s"])
        case "hit_a_limit":
            far_end.hit_a_limit()
        case "power_cycle":
            far_end.power_cycle()
        case "unplug":
            far_end.unplug()
        case "plug":
            far_end.plug()
    return {"state": far_end.firmware.state}


def main(arguments: list[str] | None = None) -> int:
    """Run the unit until its parent is gone."""
    given = parser("simulated FLIR pan-tilt unit on a pty").parse_args(arguments)
    with connection(given) as link:
        channel, clock = SideChannel(link), MonotonicClock()
        inbox: deque[Message] = deque()
        far_end = PtuFarEnd(clock, _WorldShafts(channel))
        FarEndHost(far_end, channel, PtyPort(given.port), clock=clock, inbox=inbox).run(
            lambda message: obey(far_end, message)
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
