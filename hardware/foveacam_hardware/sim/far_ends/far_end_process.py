"""The parent's side of a far end that runs in a process of its own: start, commands, events, port folder.

One thread receives the events and passes them on. A process that dies is reaped and replaced after a delay,
during which its port does not exist, like a device that is unplugged and plugged in again.
"""

import contextlib
import fcntl
import logging
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.sim.far_ends.side_channel import ChannelClosed, Message, SideChannel

FOLDER_PREFIX = "foveacam-port-"
LOCK_FILE = "owner"
"""A file in the folder that the owner keeps locked; the system drops the lock when the process ends."""
logger = logging.getLogger(__name__)
START_TIMEOUT_S = 20.0
COMMAND_TIMEOUT_S = 5.0
END_TIMEOUT_S = 3.0
RESTART_DELAY_S = 2.0
"""Delay from the death of a far end's process to the start of the next, as if plugged in by hand."""
OptionsSource: TypeAlias = Callable[[], Sequence[str]]
"""Returns the command-line options of the process to start."""


class PortFolder:
    """A new temporary folder for a port; `close` removes it, or else a later process does."""

    def __init__(self) -> None:
        remove_abandoned_folders(Path(tempfile.gettempdir()))
        self.path = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX))
        self._lock_fd = _create_lock(self.path)

    def close(self) -> None:
        """Remove the folder; no effect when removed."""
        shutil.rmtree(self.path, ignore_errors=True)
        if self._lock_fd >= 0:
            os.close(self._lock_fd)
        self._lock_fd = -1


def remove_abandoned_folders(parent: Path) -> list[Path]:
    """Remove this user's folders whose owner has ended; return those removed."""
    return [
        folder
        for folder in parent.glob(f"{FOLDER_PREFIX}*")
        if _is_abandoned(folder) and _remove_folder(folder)
    ]


def _create_lock(folder: Path) -> int:
    """Create and lock the lock file; return its descriptor. It gets its name once locked, never before."""
    unnamed = folder / f".{LOCK_FILE}"
    lock_fd = os.open(unnamed, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    fcntl.flock(lock_fd, fcntl.LOCK_EX)
    unnamed.rename(folder / LOCK_FILE)
    return lock_fd


def _is_abandoned(folder: Path) -> bool:
    """Return whether a folder is this user's and its lock is free; False when it cannot be read."""
    try:
        if folder.is_symlink() or folder.stat().st_uid != os.getuid():
            return False
        lock_fd = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(lock_fd)
    return True


def _remove_folder(folder: Path) -> bool:
    with contextlib.suppress(OSError):
        shutil.rmtree(folder)
    return not folder.exists()


class FarEndCables(Protocol):
    """Receiver, in this process, of a far end's events."""

    def receive(self, message: Message) -> Message | None:
        """Receive an event or a query; return the answer to a query."""
        ...

    def lose_power(self) -> None:
        """Reset every signal that the far end drove: its process, and with it its supply, is gone."""
        ...


class FarEndProcess:
    """A process that runs `python -m module`; `wait_until_ready` waits for its start."""

    def __init__(self, module: str, name: str, cables: FarEndCables, *, options: OptionsSource) -> None:
        self._module = module
        self._name = name
        self._cables = cables
        self._options = options
        self._answers: dict[int, Message] = {}
        self._changed = threading.Condition()
        self._ready = self._gone = self._closing = False
        self._count = 0
        self._folder = PortFolder()
        self.port = str(self._folder.path / name)
        """The path of the port, like /dev/serial/by-id/…; it does not exist while unplugged."""
        try:
            self._process, self._channel = self._start()
        except OSError:
            self._folder.close()
            raise
        self._receiver = threading.Thread(
            target=self._receive_until_closed, name=f"{name}-cables", daemon=True
        )
        self._receiver.start()

    @property
    def pid(self) -> int:
        """The process id; it changes when the process dies and is replaced."""
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Return once it serves its port; end it and raise `DeviceFault` when it does not start."""
        with self._changed:
            self._changed.wait_for(lambda: self._ready or self._gone, START_TIMEOUT_S)
        if not self._ready:
            self.close()
            raise DeviceFault(
                f"simulated {self._name} did not start within {START_TIMEOUT_S:g} s"
                f" (exit status {self._process.returncode}); see its messages above"
            )

    def close(self) -> None:
        """End the process and its thread; no effect when closed."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._channel.shut_down()
        self._reap()
        if self._receiver is not threading.current_thread():
            self._receiver.join()
        self._channel.close()
        self._folder.close()

    def send_command(self, command: str, **fields: object) -> Message:
        """Send a command; return the status once it is executed and every earlier event is delivered."""
        with self._changed:
            self._count += 1
            number = self._count
        with contextlib.suppress(ChannelClosed):
            self._channel.send({"command": command, "id": number, **fields})
        with self._changed:
            self._changed.wait_for(lambda: number in self._answers or self._gone, COMMAND_TIMEOUT_S)
            if number not in self._answers:
                raise DeviceFault(
                    f"simulated {self._name} (process {self.pid}) did not answer '{command}'; if it has died,"
                    f" another one starts within {RESTART_DELAY_S:g} s"
                )
            return self._answers.pop(number)

    def damage(self, damage: LineDamage, *, to: str) -> None:
        """Damage bytes sent to the "device" or the "host"."""
        fields = {"skip": damage.skip, "count": damage.count, "value": damage.value}
        self.send_command("damage", to=to, kind=str(damage.kind), **fields)

    def _start(self) -> tuple[subprocess.Popen[bytes], SideChannel]:
        ours, theirs = socket.socketpair()
        command = [sys.executable, "-m", self._module, "--socket", str(theirs.fileno()), "--port", self.port]
        with contextlib.ExitStack() as cleanup, theirs:
            cleanup.callback(ours.close)
            process = subprocess.Popen(  # noqa: S603  # our own module, by our own interpreter
                [*command, *self._options()],
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C ends the parent, and the child with it
            )
            cleanup.pop_all()
        return process, SideChannel(ours)

    # The receiving thread

    def _receive_until_closed(self) -> None:
        """Receive from one process after the other until closed."""
        while True:
            try:
                self._receive()
            finally:
                with self._changed:
                    self._gone = True
                    self._changed.notify_all()
            if self._closing:
                return
            self._handle_death()
            if not self._restart():
                return

    def _receive(self) -> None:
        with contextlib.suppress(ChannelClosed):
            while True:
                for message in self._channel.receive():
                    self._handle_message(message)

    def _handle_death(self) -> None:
        """Reap the process that has died, and reset its signals."""
        self._reap()
        self._channel.close()
        logger.warning(
            "simulated %s: its process %d has died (exit status %s); another one starts in %g s",
            self._name,
            self.pid,
            self._process.returncode,
            RESTART_DELAY_S,
        )
        self._cables.lose_power()

    def _restart(self) -> bool:
        """Start another process after a delay; return False when closed meanwhile."""
        while True:
            with self._changed:
                if self._changed.wait_for(lambda: self._closing, RESTART_DELAY_S):
                    return False
                try:
                    self._process, self._channel = self._start()
                except OSError as failure:
                    logger.warning("simulated %s: no process starts (%s)", self._name, failure)
                    continue
                self._gone = False
                return True

    def _reap(self) -> None:
        try:
            self._process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _handle_message(self, message: Message) -> None:
        if "event" in message or "ask" in message:
            answer = self._cables.receive(message)
            if answer is not None:
                self._channel.send(answer)
            return
        with self._changed:
            self._ready = self._ready or "ready" in message
            if "done" in message:
                self._answers[message["done"]] = message["status"]
            self._changed.notify_all()
