"""Where the `foveacam` program starts, before numpy is loaded.

Linear algebra is told to stay on one thread: the matrices of a calibration are small, and threads that share
out small matrices wait for each other most of the time. Whoever has set the variable is left alone.
"""

import os

ALGEBRA_THREADS = "OPENBLAS_NUM_THREADS"


def main() -> None:
    """Run the program."""
    os.environ.setdefault(ALGEBRA_THREADS, "1")
    from foveacam_server.cli import main as run  # loads numpy, which reads the variable once

    run()
