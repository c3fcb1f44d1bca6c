"""Simulated controllers in processes of their own, each started once for all tests of a module."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from foveacam_hardware.contract import Role
from foveacam_hardware.drivers.controller.guard import LinkSupervision
from foveacam_hardware.sim.cables import Cables, DacCodes, RecordingCables
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess

PATIENT = LinkSupervision(answer_s=5.0)
"""Of a driver in real time on a busy machine, where silence is not what is tested."""


class SwitchedCables:
    """Cables that lead to whichever test runs."""

    def __init__(self) -> None:
        self.to: Cables = RecordingCables()

    def set_codes(self, t_ns: int, codes: DacCodes) -> None:
        self.to.set_codes(t_ns, codes)

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        self.to.set_rail(t_ns, on=on)

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        self.to.set_low_pass(t_ns, cutoff_hz)

    def trigger(self, t_ns: int, *, pulse_us: int, cameras: int) -> None:
        self.to.trigger(t_ns, pulse_us=pulse_us, cameras=cameras)

    def strobe_us(self, role: Role) -> int | None:
        return self.to.strobe_us(role)


class Controllers:
    """Processes by firmware version; each test gets one as it comes from the factory."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self._running: dict[tuple[int, int, int], tuple[ControllerProcess, SwitchedCables]] = {}

    def fresh(
        self, cables: Cables, *, strict: bool, version: tuple[int, int, int] = (2, 1, 0)
    ) -> ControllerProcess:
        """Return a controller that was just switched on, wired to `cables`."""
        if version not in self._running:
            switched = SwitchedCables()
            process = self._stack.enter_context(ControllerProcess(switched, version=version))
            self._running[version] = process, switched
        process, switched = self._running[version]
        process.plug()
        process.heal()
        process.configure(strict=strict, silent=False, fragile=False, clock_ppm=0.0)
        process.power_cycle()
        process.status()  # what it did on its way down is told
        switched.to = cables
        return process


@contextmanager
def started() -> Iterator[Controllers]:
    with ExitStack() as stack:
        yield Controllers(stack)
