"""A child process that computes for requests, one function at a time, within limits of CPU time and memory.

`python -m` of this module with FD CPU_S MEMORY_BYTES MODULE... imports the modules, then reads pickled
functions with their argument from the socket FD and answers each, for a `ComputeProcess`.
"""

import importlib
import logging
import math
import os
import pickle
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from foveacam_hardware.contract import Cancelled, FoveaError, InvalidInput
from foveacam_server.foundation.child_work import ChildError, become_child

_log = logging.getLogger(__name__)

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class ComputeLimits:
    """Limits of one computation.

    `memory_bytes`: address space beyond that of the process after its imports, so that all allocations of
    GEOS, OpenCV and numpy count, but not what they reserve at their start. `longest_s`: wall-clock time, for
    a machine under load.
    """

    cpu_s: int = 10
    memory_bytes: int = 512 * 2**20
    longest_s: float = 60.0


_ADDRESS_SPACE = Path("/proc/self/statm")
_ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
_OUT_OF_MEMORY = ("bad_alloc", "Insufficient memory", "OutOfMemory")
"""Messages of GEOS and OpenCV when they lack memory."""


class ComputeProcess:
    """Owns a worker process, started at its first use and again after it was ended.

    For one thread at a time; `kill` may be called from any other.
    """

    def __init__(self, modules: Sequence[str], *, limits: ComputeLimits) -> None:
        """`modules`: those with the functions that are computed."""
        self._modules, self._limits = modules, limits
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._closed = threading.Event()

    def prepare(self) -> Connection:
        """Start the process unless it runs; it imports its modules meanwhile."""
        if self._closed.is_set():
            raise Cancelled("the server is ending, and with it what it computes")
        if self._connection is not None and self._process is not None and self._process.poll() is None:
            return self._connection
        self.end()
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603 - our own module, by our own interpreter
                [sys.executable, "-m", __name__, *self._arguments(theirs.fileno())],
                stdin=subprocess.PIPE,
                env={**os.environ, **_ONE_THREAD},
                pass_fds=[theirs.fileno()],
                start_new_session=True,  # Ctrl-C must reach only the server, which ends the child
            )
        self._connection = Connection(ours.detach())
        if self._closed.is_set():  # killed meanwhile by another thread
            self.end()
            raise Cancelled("the server is ending, and with it what it computes")
        return self._connection

    def _arguments(self, channel: int) -> list[str]:
        limits = self._limits
        return [str(channel), str(limits.cpu_s), str(limits.memory_bytes), *self._modules]

    def compute(self, function: Callable[[T], R], argument: T) -> R:
        """Return the result of a function of a module; raise its error.

        Raise InvalidInput for one that needs too much time or memory, which ends the process.
        """
        asked = _pickled((function, argument))
        connection = self.prepare()
        try:
            connection.send_bytes(asked)
            if not connection.poll(self._limits.longest_s):
                raise self._ended_with(f"{self._limits.longest_s:g} s")
            answer = pickle.loads(connection.recv_bytes())  # noqa: S301 - of our own process
        except (EOFError, OSError) as error:
            raise self._lost() from error
        match answer:
            case ChildError():
                raise answer.as_error()
            case MemoryError():
                raise self._ended_with(f"{self._limits.memory_bytes >> 20} MB of memory")
            case Exception():
                raise RuntimeError("the computation failed; see the messages above") from answer
        result: R = answer
        return result

    def kill(self) -> None:
        """Kill the process at once, and start no further one."""
        self._closed.set()
        if self._process is not None:
            self._process.kill()

    def end(self) -> None:
        """End the process, and wait for its end."""
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            if self._process.stdin is not None:
                self._process.stdin.close()
        self._process = self._connection = None

    def _lost(self) -> Exception:
        """Return the error for a process that has ended by itself."""
        if self._closed.is_set():
            return Cancelled("the server is ending, and with it what it computes")
        status = None if self._process is None else self._process.wait()
        if status == -signal.SIGXCPU:
            return self._ended_with(f"{self._limits.cpu_s} s of CPU time")
        self.end()
        return RuntimeError(f"the process that computes ended with status {status}")

    def _ended_with(self, most: str) -> InvalidInput:
        self.end()
        return InvalidInput(
            f"this needs more than the {most} that a computation may take, and was ended",
            asked="a computation",
            found=f"a limit of {most}",
            remedy="ask for something smaller or simpler",
        )


def _pickled(asked: object) -> bytes:
    try:
        return pickle.dumps(asked)
    except RecursionError as error:
        raise InvalidInput(
            "this is nested too deeply to be computed",
            remedy="send lists and objects that are fewer in one another",
        ) from error


def main() -> None:
    """Serve requests until the socket is closed."""
    channel, cpu_s, memory_bytes = map(int, sys.argv[1:4])
    connection = Connection(channel)
    become_child()
    for module in sys.argv[4:]:
        importlib.import_module(module)
    _limit(resource.RLIMIT_CORE, 0)  # no core dump: SIGXCPU would write the memory to the disk
    if _ADDRESS_SPACE.exists():  # other systems do not enforce this limit
        _limit(resource.RLIMIT_AS, _address_space_bytes() + memory_bytes)
    while True:
        try:
            function, argument = pickle.loads(connection.recv_bytes())  # noqa: S301 - of our own server
        except EOFError:
            return
        _limit(resource.RLIMIT_CPU, math.ceil(time.process_time()) + cpu_s)
        connection.send_bytes(_answer(function, argument))


def _answer(function: Callable[[Any], object], argument: object) -> bytes:  # Any: the argument
    """Return the pickled result of a function, or its error, in the form that `ComputeProcess` reads."""
    try:
        return pickle.dumps(function(argument))
    except Exception as error:  # noqa: BLE001 - the outermost frame of a computation
        if _out_of_memory(error):
            return pickle.dumps(MemoryError())
        if isinstance(error, FoveaError):
            return pickle.dumps(ChildError.of(error))
        _log.exception("a computation failed unexpectedly")
        return pickle.dumps(RuntimeError(repr(error)))


def _out_of_memory(error: BaseException | None) -> bool:
    """Return whether an error, or one of its causes, is a lack of memory."""
    while error is not None:
        if isinstance(error, MemoryError) or any(phrase in str(error) for phrase in _OUT_OF_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def _limit(what: int, most: int) -> None:
    _, hard = resource.getrlimit(what)
    resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def _address_space_bytes() -> int:
    pages = int(_ADDRESS_SPACE.read_text().split()[0])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    main()
