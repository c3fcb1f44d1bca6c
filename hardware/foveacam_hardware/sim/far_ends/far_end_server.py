"""The event loop of a far end's process: a pty for the host, a socket for the parent.

The kind of far end and its commands are in `controller_main` and `board_main`; `far_end_process` starts it.
"""

import argparse
import contextlib
import os
import select
import socket
import tty
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeAlias

from foveacam_hardware.contract import Clock
from foveacam_hardware.sim.far_ends.line_faults import DamageKind, LineDamage, LineFaults
from foveacam_hardware.sim.far_ends.side_channel import ChannelClosed, Message, SideChannel

READ_BYTES = 4096
ORPHAN_CHECK_S = 1.0
CommandHandler: TypeAlias = Callable[[Message], Message]
"""Executes a command and returns the device's status."""


class PtyPort:
    """A pty as serial port, and a stable path to it that exists while it is plugged in."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._files: tuple[int, int] | None = None

    @property
    def file(self) -> int | None:
        """The master's file descriptor; None while unplugged."""
        return self._files[0] if self._files else None

    def plug(self) -> None:
        """Open a pty and link the path to it."""
        if self._files is not None:
            return
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(slave))
        self._files = master, slave

    def unplug(self) -> None:
        """Close the pty and remove the path: the host's reads and writes fail."""
        if self._files is not None:
            self._path.unlink(missing_ok=True)
            for file in self._files:
                os.close(file)
            self._files = None

    def read(self) -> bytes:
        """Return the bytes that the host has sent."""
        return os.read(self._files[0], READ_BYTES) if self._files else b""

    def write(self, data: bytes) -> None:
        """Send bytes to the host; what is not read is lost, as on a USB port that is not open."""
        if self._files is not None:
            with contextlib.suppress(BlockingIOError):
                os.write(self._files[0], data)


class FarEnd(Protocol):
    """A device at a serial port as a state machine: bytes in, bytes out, in time."""

    to_device: LineFaults
    to_host: LineFaults

    def feed(self, data: bytes) -> None:
        """Receive bytes from the host, now."""
        ...

    def take_output(self) -> bytes:
        """Return the bytes for the host that are due."""
        ...

    def next_event_ns(self) -> int | None:
        """Return the time of the next planned event; None without one."""
        ...

    def advance(self, t_ns: int) -> None:
        """Run everything due up to `t_ns`."""
        ...


class FarEndServer:
    """Passes bytes, time and commands to a far end until the parent ends.

    `inbox` holds the commands received; the far end's cables may add to it.
    """

    def __init__(
        self, far_end: FarEnd, channel: SideChannel, port: PtyPort, *, clock: Clock, inbox: deque[Message]
    ) -> None:
        self._far_end = far_end
        self._channel = channel
        self._port = port
        self._clock = clock
        self._inbox = inbox
        self._parent = os.getppid()

    def run(self, execute: CommandHandler) -> None:
        """Serve until the socket closes or the parent process ends."""
        self._port.plug()
        self._channel.send({"ready": True})
        try:
            while os.getppid() == self._parent:
                self._step(execute)
        except ChannelClosed:
            return
        finally:
            self._port.unplug()

    def _step(self, execute: CommandHandler) -> None:
        sources = [self._channel.file] + ([self._port.file] if self._port.file is not None else [])
        ready, _, _ = select.select(sources, [], [], self._wait_s())
        self._far_end.advance(self._clock.now_ns())
        if self._port.file in ready:
            self._far_end.feed(self._port.read())
        if self._channel.file in ready:
            self._inbox.extend(self._channel.receive())
        self._port.write(self._far_end.take_output())
        while self._inbox:
            self._execute(self._inbox.popleft(), execute)

    def _wait_s(self) -> float:
        due_ns = self._far_end.next_event_ns()
        if due_ns is None:
            return ORPHAN_CHECK_S
        return min(ORPHAN_CHECK_S, max(0.0, (due_ns - self._clock.now_ns()) / 1e9))

    def _execute(self, message: Message, execute: CommandHandler) -> None:
        match message["command"]:
            case "damage":
                line = self._far_end.to_device if message["to"] == "device" else self._far_end.to_host
                kind = DamageKind(message["kind"])
                line.add(
                    LineDamage(
                        kind=kind, skip=message["skip"], count=message["count"], value=message["value"]
                    )
                )
            case "heal":
                self._far_end.to_device.clear()
                self._far_end.to_host.clear()
        status = execute(message)
        match message["command"]:
            case "unplug":
                self._port.unplug()
            case "plug":
                self._port.plug()
        self._channel.send({"done": message["id"], "status": status})


def argument_parser(description: str) -> argparse.ArgumentParser:
    """Return a parser of the options that every far end's process takes."""
    options = argparse.ArgumentParser(description=description)
    options.add_argument("--socket", type=int, required=True, help="file descriptor of the side channel")
    options.add_argument("--port", type=Path, required=True, help="path to link to the pty")
    return options


def inherited_socket(options: argparse.Namespace) -> socket.socket:
    """Return the side channel's socket, inherited from the parent."""
    return socket.socket(fileno=options.socket)
