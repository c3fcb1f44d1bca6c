"""Main program of a simulated motor controller board: a pty for the host, a socket for the world.

`python -m foveacam_hardware.sim.far_ends.board_main --socket FD --port PATH --kind KIND
--place PAN TILT RAIL` is started by `board_process.BoardProcess` and ends with it. Both use
CLOCK_MONOTONIC. Messages are JSON lines.
"""

import dataclasses
import sys
from collections import deque

from foveacam_hardware.contract import Clock, MonotonicClock
from foveacam_hardware.sim.far_ends.board_far_end import BoardFarEnd, BoardKind
from foveacam_hardware.sim.far_ends.far_end_server import (
    FarEndServer,
    PtyPort,
    argument_parser,
    inherited_socket,
)
from foveacam_hardware.sim.far_ends.grbl_far_end import GrblFarEnd
from foveacam_hardware.sim.far_ends.ptu_far_end import PtuFarEnd
from foveacam_hardware.sim.far_ends.side_channel import Message, SideChannel
from foveacam_hardware.sim.pan_tilt import ZERO_POSITIONS, AxisPositions, PanTiltCables, TurnSegment


def make_board(
    kind: BoardKind, clock: Clock, cables: PanTiltCables, *, start: AxisPositions = ZERO_POSITIONS
) -> BoardFarEnd:
    """Return a board whose motors, at `start`, drive `cables`."""
    match kind:
        case BoardKind.PTU:
            return PtuFarEnd(clock, cables, start=start)
        case BoardKind.GRBL | BoardKind.GRBL_WITH_RAIL:
            return GrblFarEnd(clock, cables, has_rail=kind is BoardKind.GRBL_WITH_RAIL, start=start)


class _ShaftSender:
    """Sends the motion of the motors to the rig in the parent process."""

    def __init__(self, channel: SideChannel) -> None:
        self._channel = channel

    def add_segment(self, segment: TurnSegment) -> None:
        self._channel.send({"event": "turn", **dataclasses.asdict(segment)})


def execute_command(far_end: BoardFarEnd, message: Message) -> Message:
    """Execute a command from the parent; return the board's status."""
    match message["command"]:
        case "impair":
            far_end.set_faults(**message["changes"])
        case "hit_a_limit":
            far_end.hit_a_limit()
        case "power_cycle":
            far_end.power_cycle()
        case "unplug":
            far_end.unplug()
        case "plug":
            far_end.plug()
    return {"state": far_end.state}


def main(arguments: list[str] | None = None) -> int:
    """Run the board until its parent ends."""
    options = argument_parser("simulated pan-tilt on a pty")
    options.add_argument("--kind", type=BoardKind, required=True, help="which board answers")
    options.add_argument(
        "--place", type=float, nargs=3, required=True, help="positions of its motors: deg, deg, mm"
    )
    given = options.parse_args(arguments)
    with inherited_socket(given) as link:
        channel, clock = SideChannel(link), MonotonicClock()
        inbox: deque[Message] = deque()
        far_end = make_board(given.kind, clock, _ShaftSender(channel), start=tuple(given.place))
        FarEndServer(far_end, channel, PtyPort(given.port), clock=clock, inbox=inbox).run(
            lambda message: execute_command(far_end, message)
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
