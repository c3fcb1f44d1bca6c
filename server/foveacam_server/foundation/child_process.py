"""Runs a module of the project in a child process and reads the JSON lines that it prints.

For work that would block the interpreter for long, and with it live views and requests. The child ends when
its stdin is closed, as the server has then ended.
"""

import json
import os
import select
import subprocess
import sys
from collections.abc import Callable, Sequence

from foveacam_hardware.contract import Cancelled, FoveaError
from foveacam_server.foundation.child_work import ChildError, ChildProgress

LOOK_S = 0.1
"""Interval between two checks for cancellation."""
END_S = 5.0

OnProgress = Callable[[ChildProgress], None]


def run_child(
    module: str,
    arguments: Sequence[str],
    *,
    on_progress: OnProgress,
    cancelled: Callable[[], bool],
) -> None:
    """Run `python -m module` to its end; `on_progress` is called with each step that it prints.

    Raise Cancelled when it was cancelled, the error that it printed, or RuntimeError when it failed
    otherwise.
    """
    process = subprocess.Popen(  # noqa: S603 - our own module, by our own interpreter
        [sys.executable, "-m", module, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,  # Ctrl-C must reach only the server, which ends the child
    )
    with process:
        try:
            trouble = _follow(process, on_progress=on_progress, cancelled=cancelled)
            status = process.wait(END_S)
        finally:
            _end(process)
    if trouble is not None:
        raise trouble
    if status != 0:
        raise RuntimeError(f"{module} ended with status {status}; see its messages above")


def _follow(
    process: subprocess.Popen[bytes], *, on_progress: OnProgress, cancelled: Callable[[], bool]
) -> FoveaError | None:
    """Forward the child's messages until its output ends; return the error that it printed."""
    if process.stdout is None:
        raise AssertionError("the child was started with a pipe")
    rest, trouble, source = b"", None, process.stdout.fileno()
    while True:
        if cancelled():
            raise Cancelled("the job was cancelled")
        if not select.select([source], [], [], LOOK_S)[0]:
            continue
        read = os.read(source, 65536)
        if not read:
            return trouble
        *lines, rest = (rest + read).split(b"\n")
        for line in lines:
            message = json.loads(line)
            if "error" in message:
                trouble = ChildError.model_validate(message).as_error()
            else:
                on_progress(ChildProgress.model_validate(message))


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
