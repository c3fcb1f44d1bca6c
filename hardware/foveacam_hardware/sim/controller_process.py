"""The simulated controller in a process of its own: a pty for the host, a socket for the world.

`python -m foveacam_hardware.sim.controller_process --socket FD --port PATH [--strict] [--version 2.1.0]`
is started by `controller_host.ControllerProcess` and ends with it. Both share CLOCK_MONOTONIC.
Messages on the socket are JSON lines, documented in `side_channel`.
"""

import argparse
import contextlib
import dataclasses
import os
import select
import socket
import sys
import tty
from collections import deque
from pathlib import Path

from foveacam_hardware.contract import MonotonicClock, Role
from foveacam_hardware.sim.controller_far_end import ControllerFarEnd
from foveacam_hardware.sim.line_faults import Damage, DamageKind
from foveacam_hardware.sim.side_channel import ChannelClosed, ControllerStatus, Message, SideChannel

ORPHAN_CHECK_S = 1.0
READ_BYTES = 4096


class _WorldCables:
    """Cables whose other ends are in the parent process."""

    def __init__(self, channel: SideChannel) -> None:
        self._channel = channel
        self.commands: deque[Message] = deque()
        """Commands that arrived while a strobe was waited for."""

    def drive(self, t_ns: int, codes: tuple[int, ...]) -> None:
        self._channel.send({"event": "drive", "t_ns": t_ns, "codes": codes})

    def rail(self, t_ns: int, *, on: bool) -> None:
        self._channel.send({"event": "rail", "t_ns": t_ns, "on": on})

    def low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        self._channel.send({"event": "low_pass", "t_ns": t_ns, "cutoff_hz": cutoff_hz})

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        self._channel.send({"event": "trigger", "t_ns": t_ns, "pulse_us": pulse_us, "cameras": cameras})

    def strobe_us(self, role: Role) -> int | None:
        self._channel.send({"ask": "strobe", "role": str(role)})
        while True:
            for message in self._channel.receive():
                if "strobe_us" not in message:
                    self.commands.append(message)
                    continue
                exposure_us: int | None = message["strobe_us"]
                return exposure_us


class _Port:
    """The pty and the stable path that leads to it while it is plugged in."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._files: tuple[int, int] | None = None

    @property
    def file(self) -> int | None:
        """The master's file number; None while unplugged."""
        return self._files[0] if self._files else None

    def plug(self) -> None:
        """Open a pty and point the path at it."""
        if self._files is not None:
            return
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        self._path.unlink(missing_ok=True)
        self._path.symlink_to(os.ttyname(slave))
        self._files = master, slave

    def unplug(self) -> None:
        """Hang up: the host's reads and writes fail, and the path is gone."""
        if self._files is not None:
            self._path.unlink(missing_ok=True)
            for file in self._files:
                os.close(file)
            self._files = None

    def read(self) -> bytes:
        """Return what the host has sent."""
        return os.read(self._files[0], READ_BYTES) if self._files else b""

    def write(self, data: bytes) -> None:
        """Send to the host; what nobody reads is lost, as on a USB port that nobody has opened."""
        if self._files is not None:
            with contextlib.suppress(BlockingIOError):
                os.write(self._files[0], data)


class ControllerHost:
    """Gives the far end its bytes, its time and its faults, until the parent is gone."""

    def __init__(
        self, channel: SideChannel, port: Path, *, strict: bool, version: tuple[int, int, int]
    ) -> None:
        self._channel = channel
        self._clock = MonotonicClock()
        self._cables = _WorldCables(channel)
        self._far_end = ControllerFarEnd(self._clock, self._cables, strict=strict, version=version)
        self._port = _Port(port)
        self._parent = os.getppid()

    def run(self) -> None:
        """Serve until the socket closes or the parent process ends."""
        self._port.plug()
        self._channel.send({"ready": True})
        try:
            while os.getppid() == self._parent:
                self._step()
        except ChannelClosed:
            return
        finally:
            self._port.unplug()

    def _step(self) -> None:
        sources = [self._channel.file] + ([self._port.file] if self._port.file is not None else [])
        ready, _, _ = select.select(sources, [], [], self._wait_s())
        self._far_end.advance(self._clock.now_ns())
        if self._port.file in ready:
            self._far_end.feed(self._port.read())
        if self._channel.file in ready:
            self._cables.commands.extend(self._channel.receive())
        self._port.write(self._far_end.take())
        while self._cables.commands:
            self._obey(self._cables.commands.popleft())

    def _wait_s(self) -> float:
        due_ns = self._far_end.next_event_ns()
        if due_ns is None:
            return ORPHAN_CHECK_S
        return min(ORPHAN_CHECK_S, max(0.0, (due_ns - self._clock.now_ns()) / 1e9))

    def _obey(self, message: Message) -> None:
        far_end = self._far_end
        match message["command"]:
            case "set":
                far_end.strict = message.get("strict", far_end.strict)
                far_end.silent = message.get("silent", far_end.silent)
                far_end.firmware.clock_ppm = message.get("clock_ppm", far_end.firmware.clock_ppm)
            case "damage":
                line = far_end.to_device if message["to"] == "device" else far_end.to_host
                kind = DamageKind(message["kind"])
                line.add(
                    Damage(kind=kind, skip=message["skip"], count=message["count"], value=message["value"])
                )
            case "heal":
                far_end.to_device.clear()
                far_end.to_host.clear()
            case "die":
                far_end.die()
            case "power_cycle":
                far_end.power_cycle()
            case "unplug":
                far_end.unplug(keep_power=message["keep_power"])
                self._port.unplug()
            case "plug":
                far_end.plug()
                self._port.plug()
            case "status":
                pass
        self._channel.send({"done": message["id"], "status": dataclasses.asdict(self._status())})

    def _status(self) -> ControllerStatus:
        far_end = self._far_end
        return ControllerStatus(
            dead=far_end.dead,
            enabled=far_end.firmware.enabled,
            malformed=far_end.malformed,
        )


def main(arguments: list[str] | None = None) -> int:
    """Run the controller until its parent is gone."""
    parser = argparse.ArgumentParser(description="simulated mirror controller on a pty")
    parser.add_argument("--socket", type=int, required=True, help="file number of the side channel")
    parser.add_argument("--port", type=Path, required=True, help="path that shall lead to the pty")
    parser.add_argument("--strict", action="store_true", help="err as controllers in the field do")
    parser.add_argument("--version", default="2.1.0", help="firmware version to answer with")
    options = parser.parse_args(arguments)
    major, minor, patch = (int(part) for part in options.version.split("."))
    with socket.socket(fileno=options.socket) as connection:
        channel = SideChannel(connection)
        ControllerHost(channel, options.port, strict=options.strict, version=(major, minor, patch)).run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
