"""The guardian: holds the controller's open port, does nothing, and parks the mirrors when the host is gone.

`python -m foveacam_hardware.drivers.controller.guardian_process --socket FD --host PID`, as started by
`guardian.Guardian`.
It waits on the host's death without polling, sends nothing before, and gives the port back at its end.
"""

import argparse
import logging
import signal
import socket
import sys

from foveacam_hardware.drivers.controller.guardian_parking import park_and_disable
from foveacam_hardware.wire.guardian import (
    GuardRequest,
    HostGone,
    answer,
    receive,
    wait_for_message_or_exit,
    watch_process,
)
from foveacam_hardware.wire.open_file import OpenPort

logger = logging.getLogger("foveacam.guardian")


class GuardedPort:
    """The port that is watched over now, if any."""

    def __init__(self) -> None:
        self._held: tuple[OpenPort, GuardRequest] | None = None

    def obey(self, connection: socket.socket) -> None:
        """Take one message of the host's; raise `HostGone` after its last."""
        order = receive(connection)
        self.give_back()
        if isinstance(order, GuardRequest):
            self._held = OpenPort(order.file), order
        answer(connection)

    def give_back(self) -> None:
        """Close what is held; harmless when nothing is."""
        if self._held is not None:
            self._held[0].close()
            self._held = None

    def relieve(self) -> None:
        """The host is gone: bring to rest what it left, and give the port back."""
        if self._held is None:
            return
        port, order = self._held
        parking = park_and_disable(port, order.plan)
        self.give_back()
        # Last: whoever reads these messages may be gone too, and a full pipe would keep the mirrors waiting.
        level = logging.WARNING if parking.rail_off else logging.ERROR
        logger.log(level, "the host is gone; %s: %s", order.plan.port, parking.detail)


def watch(connection: socket.socket, host_pid: int) -> None:
    """Serve one host until it is gone, and then in its place once."""
    post = GuardedPort()
    process = watch_process(host_pid)
    try:
        while True:
            if wait_for_message_or_exit(connection, process):
                connection.setblocking(False)  # its last words are in the socket, or there are none
            post.obey(connection)
    except (HostGone, BlockingIOError):
        post.relieve()


def main(arguments: list[str] | None = None) -> int:
    """Run until the host is gone."""
    options = argparse.ArgumentParser(description="parks the mirrors when the host process is gone")
    options.add_argument("--socket", type=int, required=True, help="file number of the host's socket")
    options.add_argument("--host", type=int, required=True, help="process id of the host")
    given = options.parse_args(arguments)
    logging.basicConfig(level=logging.WARNING, format="guardian: %(message)s")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # what ends the host must not end its guardian first
    with socket.socket(fileno=given.socket) as connection:
        watch(connection, given.host)
    return 0


if __name__ == "__main__":
    sys.exit(main())
