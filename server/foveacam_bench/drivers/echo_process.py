"""A pty that echoes its input, in a process of its own: the reference of the serial bench.

`python -m foveacam_bench.drivers.echo_process` prints the port's path and ends when stdin closes.
"""

import os
import select
import subprocess
import sys
import tty
from collections.abc import Iterator
from contextlib import contextmanager

READ_BYTES = 4096
END_TIMEOUT_S = 3.0


@contextmanager
def echo_port() -> Iterator[str]:
    """Run an echo process; yield its port's path."""
    process = subprocess.Popen(
        [sys.executable, "-m", "foveacam_bench.drivers.echo_process"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        if process.stdin is None or process.stdout is None:
            raise RuntimeError("the echo process has no pipes")
        yield process.stdout.readline().strip()
        process.stdin.close()
        process.wait(END_TIMEOUT_S)


def main() -> int:
    """Echo until stdin closes."""
    master, slave = os.openpty()
    tty.setraw(slave)
    sys.stdout.write(os.ttyname(slave) + "\n")
    sys.stdout.flush()
    standard_input = sys.stdin.fileno()
    while True:
        ready, _, _ = select.select([master, standard_input], [], [])
        if standard_input in ready:
            return 0
        os.write(master, os.read(master, READ_BYTES))


if __name__ == "__main__":
    sys.exit(main())
