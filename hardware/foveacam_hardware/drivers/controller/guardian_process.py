"""The guardian process: holds the controller's open port and parks the mirrors when the host is gone.

`python -m foveacam_hardware.drivers.controller.guardian_process --socket FD --host PID`, started by
`guardian.Guardian`. It waits for the host's death without polling and sends nothing before.
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
    """The port that the guardian holds, if any."""

    def __init__(self) -> None:
        self._held: tuple[OpenPort, GuardRequest] | None = None

    def handle_message(self, connection: socket.socket) -> None:
        """Receive one message of the host and carry it out; raise `HostGone` after the last one."""
        order = receive(connection)
        self.release()
        if isinstance(order, GuardRequest):
            self._held = OpenPort(order.file), order
        answer(connection)

    def release(self) -> None:
        """Close the held port; do nothing when none is held."""
        if self._held is not None:
            self._held[0].close()
            self._held = None

    def park(self) -> None:
        """Park the mirrors on the held port of a host that is gone, and release the port."""
        if self._held is None:
            return
        port, order = self._held
        parking = park_and_disable(port, order.plan)
        self.release()
        # Logged last: the reader of the log may be gone too, and a full pipe would delay parking.
        level = logging.WARNING if parking.rail_off else logging.ERROR
        logger.log(level, "the host is gone; %s: %s", order.plan.port, parking.detail)


def watch(connection: socket.socket, host_pid: int) -> None:
    """Serve one host until it is gone, then park."""
    port = GuardedPort()
    process = watch_process(host_pid)
    try:
        while True:
            if wait_for_message_or_exit(connection, process):
                connection.setblocking(False)  # its last messages are in the socket already
            port.handle_message(connection)
    except (HostGone, BlockingIOError):
        port.park()


def main(arguments: list[str] | None = None) -> int:
    """Run until the host is gone."""
    options = argparse.ArgumentParser(description="parks the mirrors when the host process is gone")
    options.add_argument("--socket", type=int, required=True, help="file number of the host's socket")
    options.add_argument("--host", type=int, required=True, help="process id of the host")
    given = options.parse_args(arguments)
    logging.basicConfig(level=logging.WARNING, format="guardian: %(message)s")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # a signal that ends the host must not end its guardian first
    with socket.socket(fileno=given.socket) as connection:
        watch(connection, given.host)
    return 0


if __name__ == "__main__":
    sys.exit(main())
