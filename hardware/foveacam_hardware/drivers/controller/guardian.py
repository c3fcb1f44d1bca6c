"""The host's side of the guardian process: starts it, hands the open port over, requests its release.

The guardian parks the mirrors when this process dies by any means; until then it only keeps the port open.
"""

import contextlib
import logging
import os
import socket
import subprocess
import sys
import threading

from foveacam_hardware.wire.guardian import (
    GuardRequest,
    ParkingPlan,
    await_answer,
    send_guarded,
    send_released,
)

logger = logging.getLogger(__name__)

MODULE = "foveacam_hardware.drivers.controller.guardian_process"
START_TIMEOUT_S = 15.0
RELEASE_TIMEOUT_S = 2.0
END_TIMEOUT_S = 3.0


class Guardian:
    """A guardian for one port at a time; its process starts with the first hand-over.

    A failure to start it blocks nothing: it is logged, and `watching` stays False.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: socket.socket | None = None
        self._holds = False

    @property
    def watching(self) -> bool:
        """Whether it runs and holds a port."""
        process = self._process
        return self._holds and process is not None and process.poll() is None

    @property
    def pid(self) -> int | None:
        """Process id; None when not running."""
        return None if self._process is None else self._process.pid

    def guard(self, file: int, plan: ParkingPlan) -> None:
        """Hand an open port over, replacing any previous one; start a new process if the last one died."""
        with self._lock:
            for _ in range(2):
                if self._hand_over(GuardRequest(file=file, plan=plan)):
                    self._holds = True
                    return
                self._end()
        logger.error("the guardian does not start: the mirrors are not parked if this program is killed")

    def release(self) -> None:
        """Make it close the port, so that it can be opened again; do nothing when it holds none."""
        with self._lock:
            if not self._holds or self._connection is None:
                return
            self._holds = False
            with contextlib.suppress(OSError):
                send_released(self._connection)
                if await_answer(self._connection, timeout_s=RELEASE_TIMEOUT_S):
                    return
            logger.warning("the guardian did not give the port back; ending it")
            self._end(by_force=True)

    def close(self) -> None:
        """Release the port and end the process; do nothing when ended."""
        self.release()
        with self._lock:
            self._end()

    def _hand_over(self, order: GuardRequest) -> bool:
        if self._connection is None:
            self._start()
        connection = self._connection
        if connection is None:
            return False
        try:
            send_guarded(connection, order)
        except OSError as failure:
            logger.warning("the guardian is gone (%s); starting another", failure)
            return False
        return await_answer(connection, timeout_s=START_TIMEOUT_S)

    def _start(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        options = ["--socket", str(theirs.fileno()), "--host", str(os.getpid())]
        with theirs:
            try:
                self._process = subprocess.Popen(  # noqa: S603  # our own module, by our own interpreter
                    [sys.executable, "-m", MODULE, *options],
                    pass_fds=(theirs.fileno(),),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    start_new_session=True,  # Ctrl-C and a closing terminal must reach the host only
                )
            except OSError:
                logger.exception("the guardian could not be started")
                ours.close()
                return
        self._connection = ours

    def _end(self, *, by_force: bool = False) -> None:
        connection, self._connection = self._connection, None
        process, self._process = self._process, None
        self._holds = False
        if process is not None and by_force:
            process.kill()
        if connection is not None:
            connection.close()
        if process is None:
            return
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
