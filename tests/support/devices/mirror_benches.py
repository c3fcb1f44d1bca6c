"""Controllers to hold the Mirrors contract on: in process on simulated time, on a pty, and on a port.

The port is that of a controller that others provide, named by FOVEACAM_CONTROLLER_PORT; what is asked of
pins or supply, which nobody here sees or switches, is skipped there (the marker `external_controller`).
"""

import os
from collections.abc import Callable, Iterator

import pytest

from foveacam_hardware.contract import Clock, MonotonicClock, VirtualClock
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.sim.far_ends.controller_loopback import LoopbackController
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_hardware.sim.far_ends.side_channel import ControllerStatus
from foveacam_hardware.wire.link import SerialLink
from tests.support.devices.controllers import PATIENT, Controllers, started

PORT_VARIABLE = "FOVEACAM_CONTROLLER_PORT"


class ExternalController:
    """A controller that others provide on a port, as it is: nobody sees its pins or switches its supply."""

    def __init__(self, port: str) -> None:
        self._port = port

    def open(self) -> SerialLink:
        return SerialLink(self._port)

    def status(self) -> ControllerStatus:
        pytest.skip("nobody sees into an external controller")

    def power_cycle(self) -> None:
        pytest.skip("nobody switches the supply of an external controller")


class Bench:
    """A controller on one of its hosts, and a driver not yet connected to it; no cables: nobody sees them."""

    def __init__(
        self,
        controller: LoopbackController | ControllerProcess | ExternalController,
        cables: RecordingCables | None,
        clock: Clock,
    ) -> None:
        self.controller = controller
        self._cables = cables
        self.clock = clock
        self.mirrors = ControllerMirrors(controller.open, clock, supervision=PATIENT)

    @property
    def cables(self) -> RecordingCables:
        """What its pins did; skips the rest of a test where nobody sees them."""
        if self._cables is None:
            pytest.skip("nobody sees the pins of an external controller")
        return self._cables

    def seen(self) -> RecordingCables:
        """Return what the cables saw of everything that was sent so far; skip where nobody sees them."""
        self.mirrors.ping()
        cables = self.cables
        self.controller.status()
        return cables

    def shows(self, look: Callable[[RecordingCables], object]) -> bool:
        """Tell whether the pins show it after all that was sent so far; yes where nobody sees them."""
        if self.mirrors.state.connected:
            self.mirrors.ping()
        if self._cables is None:
            return True
        self.controller.status()
        return bool(look(self._cables))


Make = Callable[[tuple[int, int, int]], Bench]


@pytest.fixture(scope="module")
def controllers() -> Iterator[Controllers]:
    with started() as running:
        yield running


@pytest.fixture(
    params=["loopback", "process", pytest.param("external", marks=pytest.mark.external_controller)]
)
def make(request: pytest.FixtureRequest) -> Iterator[Make]:
    benches: list[Bench] = []

    def build(version: tuple[int, int, int]) -> Bench:
        if request.param == "external":
            if version != (2, 1, 0):
                pytest.skip("an external controller has the version that it has")
            external = ExternalController(os.environ[PORT_VARIABLE])
            benches.append(Bench(external, None, MonotonicClock()))
            return benches[-1]
        cables = RecordingCables()
        if request.param == "loopback":
            clock = VirtualClock(1_000_000_000)
            controller = LoopbackController(clock, cables, strict=True, version=version)
            benches.append(Bench(controller, cables, clock))
        else:
            controllers: Controllers = request.getfixturevalue("controllers")
            process = controllers.fresh(cables, strict=True, version=version)
            benches.append(Bench(process, cables, MonotonicClock()))
        return benches[-1]

    yield build
    for bench in benches:
        bench.mirrors.close()


@pytest.fixture
def bench(make: Make) -> Bench:
    bench = make((2, 1, 0))
    bench.mirrors.connect()
    return bench
