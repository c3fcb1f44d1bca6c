"""Entry point of `foveacam`, also `python -m foveacam_server`: sets the environment before numpy is imported.

It limits linear algebra to one thread: the matrices of a calibration are small, and threads that share small
matrices wait for each other most of the time. A variable that the user has set is not changed. File names and
texts are UTF-8 in every locale: names of users become file names.
"""

import io
import locale
import os
import sys

from foveacam_server.foundation.gc_pause import gc_paused

ALGEBRA_THREADS = "OPENBLAS_NUM_THREADS"
UTF8_MODE = "PYTHONUTF8"


def main() -> None:
    """Run the program."""
    ensure_utf8()
    for stream in (sys.stdout, sys.stderr):  # their encoding may be another one by PYTHONIOENCODING
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    os.environ.setdefault(ALGEBRA_THREADS, "1")
    with gc_paused():
        from foveacam_server.cli import main as run  # loads numpy, which reads the variable once

    run()


def ensure_utf8() -> None:
    """Return if file names and texts are UTF-8; else replace this process by a new run of the program.

    Python's UTF-8 mode cannot be turned on later.
    """
    if {sys.getfilesystemencoding(), locale.getpreferredencoding(do_setlocale=False).lower()} == {"utf-8"}:
        return
    os.environ[UTF8_MODE] = "1"  # of child processes; the interpreter's own may be told to ignore it
    os.execv(sys.executable, [sys.orig_argv[0], "-X", "utf8", *sys.orig_argv[1:]])  # noqa: S606 - itself


if __name__ == "__main__":
    main()
