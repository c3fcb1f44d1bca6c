"""The parent's side of the simulated controller: starts its process, brings its cables to the world.

One thread receives the cable events and calls the world's `Cables`; `.port` is a path like a real one.
"""

import contextlib
import logging
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from types import TracebackType

from foveacam_hardware.contract import DeviceFault, Role
from foveacam_hardware.sim.cables import Cables
from foveacam_hardware.sim.line_faults import Damage
from foveacam_hardware.sim.side_channel import ChannelClosed, ControllerStatus, Message, SideChannel
from foveacam_hardware.wire.link import Link, SerialLink

logger = logging.getLogger(__name__)

START_TIMEOUT_S = 20.0
COMMAND_TIMEOUT_S = 5.0
END_TIMEOUT_S = 3.0


class ControllerProcess:
    """A simulated controller in its own process, wired to `cables`; a context manager.

    Faults are methods; each returns once the controller has taken it.
    """

    def __init__(
        self, cables: Cables, *, strict: bool = False, version: tuple[int, int, int] = (2, 1, 0)
    ) -> None:
        self._cables = cables
        self._answers: dict[int, Message] = {}
        self._answered = threading.Condition()
        self._ready = False
        self._gone = False
        self._count = 0
        self._folder = Path(tempfile.mkdtemp(prefix="foveacam-"))
        self.port = str(self._folder / "controller")
        """The path to open, as one would open /dev/serial/by-id/…; it is gone while unplugged."""
        ours, theirs = socket.socketpair()
        self._connection = ours
        self._channel = SideChannel(ours)
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  # our own module, by our own interpreter
                _command(theirs.fileno(), self.port, strict=strict, version=version),
                pass_fds=(theirs.fileno(),),
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is the parent's; the child follows it
            )
        self._reader = threading.Thread(target=self._receive, name="controller-cables", daemon=True)
        self._reader.start()
        self._wait_until_ready()

    def __enter__(self) -> "ControllerProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """The far end's process id."""
        return self._process.pid

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

    def open(self) -> Link:
        """Open its port, as a driver's link factory."""
        return SerialLink(self.port)

    def configure(
        self, *, strict: bool | None = None, silent: bool | None = None, clock_ppm: float | None = None
    ) -> None:
        """Change how it behaves; what is None stays."""
        given = {"strict": strict, "silent": silent, "clock_ppm": clock_ppm}
        self._obey("set", **{name: value for name, value in given.items() if value is not None})

    def damage_to_device(self, damage: Damage) -> None:
        """Damage bytes on their way to the controller."""
        self._obey("damage", to="device", **_fields(damage))

    def damage_to_host(self, damage: Damage) -> None:
        """Damage bytes on their way to the host."""
        self._obey("damage", to="host", **_fields(damage))

    def heal(self) -> None:
        """Take back the damage that has not happened yet."""
        self._obey("heal")

    def die(self) -> None:
        """Let it stop for good, rail as it is."""
        self._obey("die")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._obey("power_cycle")

    def unplug(self, *, keep_power: bool = False) -> None:
        """Pull the cable; it goes dark as well unless something else feeds it."""
        self._obey("unplug", keep_power=keep_power)

    def plug(self) -> None:
        """Put the cable back."""
        self._obey("plug")

    def status(self) -> ControllerStatus:
        """Return how it is; all cable events before the answer have been delivered."""
        return ControllerStatus(**self._obey("status"))

    def _obey(self, command: str, **fields: object) -> Message:
        with self._answered:
            self._count += 1
            number = self._count
        with contextlib.suppress(ChannelClosed):
            self._channel.send({"command": command, "id": number, **fields})
        with self._answered:
            self._answered.wait_for(lambda: number in self._answers or self._gone, COMMAND_TIMEOUT_S)
            if number not in self._answers:
                raise DeviceFault(
                    f"simulated controller (process {self.pid}) did not answer '{command}'; restart it"
                )
            return self._answers.pop(number)

    def _wait_until_ready(self) -> None:
        with self._answered:
            self._answered.wait_for(lambda: self._ready or self._gone, START_TIMEOUT_S)
        if not self._ready:
            self.close()
            raise DeviceFault(
                f"simulated controller did not start within {START_TIMEOUT_S:g} s"
                f" (exit status {self._process.returncode}); see its messages above"
            )

    def _receive(self) -> None:
        try:
            while True:
                for message in self._channel.receive():
                    self._take(message)
        except ChannelClosed:
            logger.debug("simulated controller %d is gone", self.pid)
        finally:
            with self._answered:
                self._gone = True
                self._answered.notify_all()

    def _take(self, message: Message) -> None:
        if "event" in message:
            self._pass_on(message)
        elif "ask" in message:
            self._channel.send({"strobe_us": self._cables.strobe_us(Role(message["role"]))})
        else:
            with self._answered:
                self._ready = self._ready or "ready" in message
                if "done" in message:
                    self._answers[message["done"]] = message["status"]
                self._answered.notify_all()

    def _pass_on(self, message: Message) -> None:
        t_ns = message["t_ns"]
        match message["event"]:
            case "drive":
                self._cables.drive(t_ns, tuple(message["codes"]))
            case "rail":
                self._cables.rail(t_ns, on=message["on"])
            case "low_pass":
                self._cables.low_pass(t_ns, message["cutoff_hz"])
            case "trigger":
                self._cables.trigger(t_ns, pulse_us=message["pulse_us"], cameras=message["cameras"])


def _command(file: int, port: str, *, strict: bool, version: tuple[int, int, int]) -> list[str]:
    command = [sys.executable, "-m", "foveacam_hardware.sim.controller_process", "--socket", str(file)]
    command += ["--port", port, "--version", ".".join(map(str, version))]
    return [*command, "--strict"] if strict else command


def _fields(damage: Damage) -> dict[str, object]:
    return {
        "kind": str(damage.kind),
        "skip": damage.skip,
        "count": damage.count,
        "value": damage.value,
    }
