"""The simulated controller in its own process, as its parent sees it: its cables, its faults, its port."""

from types import TracebackType

from foveacam_hardware.contract import MonotonicClock, Role
from foveacam_hardware.sim.cables import NO_CODES, Cables
from foveacam_hardware.sim.far_ends.far_end_process import FarEndProcess
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus, Message
from foveacam_hardware.wire.link import SerialLink

MODULE = "foveacam_hardware.sim.far_ends.controller_main"


class ControllerProcess:
    """A simulated controller in its own process, wired to `cables`; a context manager.

    Faults are methods; each returns once the controller has taken it. When its process dies, it goes dark,
    and comes back by itself as one that was plugged in again.
    """

    def __init__(
        self, cables: Cables, *, strict: bool = False, version: tuple[int, int, int] = (2, 1, 0)
    ) -> None:
        options = ["--version", ".".join(map(str, version)), *(["--strict"] if strict else [])]
        self._process = FarEndProcess(MODULE, "controller", _CableReceiver(cables), options=lambda: options)
        self._process.wait_until_ready()
        self.port = self._process.port
        """The path to open, as one would open /dev/serial/by-id/…; it is gone while unplugged."""

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
        self._process.close()

    def open(self) -> SerialLink:
        """Open its port, as a driver's link factory."""
        return SerialLink(self.port)

    def configure(
        self,
        *,
        strict: bool | None = None,
        silent: bool | None = None,
        fragile: bool | None = None,
        clock_ppm: float | None = None,
    ) -> None:
        """Change how it behaves; what is None stays."""
        given = {"strict": strict, "silent": silent, "fragile": fragile, "clock_ppm": clock_ppm}
        self._process.send_command(
            "set", **{name: value for name, value in given.items() if value is not None}
        )

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes on their way to the controller."""
        self._process.damage(damage, to="device")

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes on their way to the host."""
        self._process.damage(damage, to="host")

    def heal(self) -> None:
        """Take back the damage that has not happened yet."""
        self._process.send_command("heal")

    def die(self) -> None:
        """Let it stop for good, rail as it is."""
        self._process.send_command("die")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._process.send_command("power_cycle")

    def unplug(self, *, keep_power: bool = False) -> None:
        """Pull the cable; it goes dark as well unless something else feeds it."""
        self._process.send_command("unplug", keep_power=keep_power)

    def plug(self) -> None:
        """Put the cable back."""
        self._process.send_command("plug")

    def status(self) -> ControllerStatus:
        """Return how it is; all cable events before the answer have been delivered."""
        return ControllerStatus(**self._process.send_command("status"))


class _CableReceiver:
    """The world's ends of the controller's cables."""

    def __init__(self, cables: Cables) -> None:
        self._cables = cables
        self._clock = MonotonicClock()  # the far end's, as `controller_main` says

    def receive(self, message: Message) -> Message | None:
        """Pass an event on, or answer a question."""
        if message.get("ask") == "strobe":
            return {"strobe_us": self._cables.strobe_us(Role(message["role"]))}
        t_ns = message["t_ns"]
        match message["event"]:
            case "drive":
                self._cables.set_codes(t_ns, tuple(message["codes"]))
            case "rail":
                self._cables.set_rail(t_ns, on=message["on"])
            case "low_pass":
                self._cables.set_low_pass(t_ns, message["cutoff_hz"])
            case "trigger":
                self._cables.trigger(t_ns, pulse_us=message["pulse_us"], cameras=message["cameras"])
        return None

    def lose_power(self) -> None:
        """Let rail, filter clock and DACs go out, as those of a controller without a supply do."""
        t_ns = self._clock.now_ns()
        self._cables.set_rail(t_ns, on=False)
        self._cables.set_low_pass(t_ns, 0)
        self._cables.set_codes(t_ns, NO_CODES)
