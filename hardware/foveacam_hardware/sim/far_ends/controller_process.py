"""Handle on a simulated mirror controller that runs in a process of its own."""

from types import TracebackType

from foveacam_hardware.contract import MonotonicClock, Role
from foveacam_hardware.sim.cables import NO_CODES, Cables
from foveacam_hardware.sim.far_ends.far_end_process import FarEndProcess
from foveacam_hardware.sim.far_ends.line_faults import LineDamage
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus, Message
from foveacam_hardware.wire.link import SerialLink

MODULE = "foveacam_hardware.sim.far_ends.controller_main"


class ControllerProcess:
    """A simulated controller in a process of its own, wired to `cables`; a context manager.

    A fault method returns once the fault is in force. When the process dies, the controller's outputs go off,
    and another process replaces it like a controller plugged in again.
    """

    def __init__(
        self,
        cables: Cables,
        *,
        strict: bool = False,
        version: tuple[int, int, int] = (2, 1, 0),
        strobe_delay_us: tuple[int, int] = (0, 0),
        clock_ppm: float = 0.0,
    ) -> None:
        options = ["--version", ".".join(map(str, version)), *(["--strict"] if strict else [])]
        options += ["--strobe-delay-us", *map(str, strobe_delay_us), "--clock-ppm", str(clock_ppm)]
        self._process = FarEndProcess(MODULE, "controller", _CableReceiver(cables), options=lambda: options)
        self._process.wait_until_ready()
        self.port = self._process.port
        """The path of the port, like /dev/serial/by-id/…; it does not exist while unplugged."""

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
        """The process id; it changes when the process dies and is replaced."""
        return self._process.pid

    def close(self) -> None:
        """End the process and its thread; no effect when closed."""
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
        """Change its behaviour; None changes nothing."""
        given = {"strict": strict, "silent": silent, "fragile": fragile, "clock_ppm": clock_ppm}
        self._process.send_command(
            "set", **{name: value for name, value in given.items() if value is not None}
        )

    def damage_to_device(self, damage: LineDamage) -> None:
        """Damage bytes sent to the controller."""
        self._process.damage(damage, to="device")

    def damage_to_host(self, damage: LineDamage) -> None:
        """Damage bytes sent to the host."""
        self._process.damage(damage, to="host")

    def heal(self) -> None:
        """Cancel the damage that has not happened yet."""
        self._process.send_command("heal")

    def die(self) -> None:
        """Stop it for good, its rail unchanged."""
        self._process.send_command("die")

    def power_cycle(self) -> None:
        """Switch its supply off and on."""
        self._process.send_command("power_cycle")

    def unplug(self, *, keep_power: bool = False) -> None:
        """Unplug the cable; unless `keep_power`, it loses its supply too."""
        self._process.send_command("unplug", keep_power=keep_power)

    def plug(self) -> None:
        """Plug the cable in again."""
        self._process.send_command("plug")

    def status(self) -> ControllerStatus:
        """Return its status; every earlier cable event has been delivered by then."""
        return ControllerStatus(**self._process.send_command("status"))


class _CableReceiver:
    """Passes the signals from the controller's process on to `cables`."""

    def __init__(self, cables: Cables) -> None:
        self._cables = cables
        self._clock = MonotonicClock()  # the same clock as the far end's

    def receive(self, message: Message) -> Message | None:
        """Pass an event on, or answer a query."""
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
        """Switch rail, filter clock and DACs off, as without a supply."""
        t_ns = self._clock.now_ns()
        self._cables.set_rail(t_ns, on=False)
        self._cables.set_low_pass(t_ns, 0)
        self._cables.set_codes(t_ns, NO_CODES)
