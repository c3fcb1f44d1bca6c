"""Entry point of `foveacam`, also `python -m foveacam_server`: sets the environment before numpy is loaded.

It limits linear algebra to one thread: the matrices of a calibration are small, and threads that share small
matrices wait for each other most of the time. A variable that the user has set is not changed.
"""

import os

from foveacam_server.foundation.collection_pause import collection_paused

ALGEBRA_THREADS = "OPENBLAS_NUM_THREADS"


def main() -> None:
    """Run the program."""
    os.environ.setdefault(ALGEBRA_THREADS, "1")
    with collection_paused():
        from foveacam_server.cli import main as run  # loads numpy, which reads the variable once

    run()


if __name__ == "__main__":
    main()
