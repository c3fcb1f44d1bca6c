"""The parent's side of a far end in its own process: starts it, commands it, receives what it tells.

One thread receives and passes events on; `.port` is a path like a real one.
"""

import contextlib
import logging
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.far_ends.line_faults import Damage
from foveacam_hardware.sim.far_ends.side_channel import ChannelClosed, Message, SideChannel

logger = logging.getLogger(__name__)

START_TIMEOUT_S = 20.0
COMMAND_TIMEOUT_S = 5.0
END_TIMEOUT_S = 3.0

Receiver: TypeAlias = Callable[[Message], Message | None]
"""Takes an event or a question; returns the question's answer."""


class FarEndProcess:
    """A process that runs `python -m module`, not yet waited for: call `wait_until_ready`."""

    def __init__(self, module: str, name: str, receiver: Receiver, *, options: Sequence[str] = ()) -> None:
        self._name = name
        self._receiver = receiver
        self._answers: dict[int, Message] = {}
        self._answered = threading.Condition()
        self._ready = False
        self._gone = False
        self._count = 0
        self._folder = Path(tempfile.mkdtemp(prefix="foveacam-"))
        self.port = str(self._folder / name)
        """The path to open, as one would open /dev/serial/by-id/…; it is gone while unplugged."""
        ours, theirs = socket.socketpair()
        self._connection = ours
        self._channel = SideChannel(ours)
        command = [sys.executable, "-m", module, "--socket", str(theirs.fileno()), "--port", self.port]
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  # our own module, by our own interpreter
                [*command, *options],
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is the parent's; the child follows it
            )
        self._reader = threading.Thread(target=self._receive, name=f"{name}-cables", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The far end's process id."""
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Return once it serves its port; raise `DeviceFault`, and end it, when it does not start."""
        with self._answered:
            self._answered.wait_for(lambda: self._ready or self._gone, START_TIMEOUT_S)
        if not self._ready:
            self.close()
            raise DeviceFault(
                f"simulated {self._name} did not start within {START_TIMEOUT_S:g} s"
                f" (exit status {self._process.returncode}); see its messages above"
            )

    def close(self) -> None:
        """End the process and its thread; harmless when closed."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        try:
            self._process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._reader is not threading.current_thread():
            self._reader.join()
        self._connection.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def obey(self, command: str, **fields: object) -> Message:
        """Command it; return its status once it has done so, and told every event before."""
        with self._answered:
            self._count += 1
            number = self._count
        with contextlib.suppress(ChannelClosed):
            self._channel.send({"command": command, "id": number, **fields})
        with self._answered:
            self._answered.wait_for(lambda: number in self._answers or self._gone, COMMAND_TIMEOUT_S)
            if number not in self._answers:
                raise DeviceFault(
                    f"simulated {self._name} (process {self.pid}) did not answer '{command}'; restart it"
                )
            return self._answers.pop(number)

    def damage(self, damage: Damage, *, to: str) -> None:
        """Damage bytes on their way to the "device" or the "host"."""
        fields = {"skip": damage.skip, "count": damage.count, "value": damage.value}
        self.obey("damage", to=to, kind=str(damage.kind), **fields)

    def _receive(self) -> None:
        try:
            while True:
                for message in self._channel.receive():
                    self._take(message)
        except ChannelClosed:
            logger.debug("simulated %s %d is gone", self._name, self.pid)
        finally:
            with self._answered:
                self._gone = True
                self._answered.notify_all()

    def _take(self, message: Message) -> None:
        if "event" in message or "ask" in message:
            answer = self._receiver(message)
            if answer is not None:
                self._channel.send(answer)
            return
        with self._answered:
            self._ready = self._ready or "ready" in message
            if "done" in message:
                self._answers[message["done"]] = message["status"]
            self._answered.notify_all()
