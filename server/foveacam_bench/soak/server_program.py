"""The product's server with a clock that skips: `python -m … .server_program PORT DATA ORDERS`.

The simulated boards run in this process, on the same clock; otherwise all is as in `foveacam serve`. ORDERS
is a Unix socket on which the bench sends orders, one JSON object a line, each answered by one: `{"skip_s":
300}` lets time pass, `{"must_rest": true}` counts the time in which mirrors are driven.
"""

import functools
import json
import socket
import sys
import threading
from pathlib import Path

from rich.console import Console

from foveacam_bench.soak.drive_watch import DriveWatch
from foveacam_bench.soak.skipping_clock import SkippingClock
from foveacam_hardware.contract import MirrorLimits
from foveacam_hardware.sim import rig as simulation
from foveacam_server.foundation.settings import Settings
from foveacam_server.serving import run_server


def main() -> None:
    """Serve until interrupted."""
    port, data, orders = sys.argv[1:]
    clock, drives = SkippingClock(), DriveWatch(MirrorLimits())
    drives.attach()
    inline = functools.partial(simulation.simulated_rig, inline=True)
    simulation.simulated_rig = inline  # in their own processes the boards would have other clocks
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(orders)
    listener.listen()
    threading.Thread(target=_obey, args=(listener, clock, drives), daemon=True).start()
    run_server(Settings(port=int(port), data=Path(data)), console=Console(), clock=clock)


def _obey(listener: socket.socket, clock: SkippingClock, drives: DriveWatch) -> None:
    connection, _ = listener.accept()
    with connection, connection.makefile("rw") as lines:
        for line in lines:
            order = json.loads(line)
            if "skip_s" in order:
                clock.skip(round(1e9 * order["skip_s"]))
            if "must_rest" in order:
                drives.require_rest(order["must_rest"])
            lines.write(json.dumps({"t_s": clock.now_ns() / 1e9, "unparked_s": drives.unparked_s}) + "\n")
            lines.flush()


if __name__ == "__main__":
    main()
