"""A controller that stops for good when the ends of packets are cut off, as firmware 2.1.0 was seen to do."""

import time
from collections.abc import Callable, Iterator

import pytest
from tests.support.devices.controllers import Controllers, started

from foveacam_hardware.contract import MirrorVolts, MonotonicClock, NotConnected, StereoVolts, Timeout
from foveacam_hardware.drivers.controller.mirrors import ControllerMirrors
from foveacam_hardware.sim.cables import RecordingCables
from foveacam_hardware.wire.link import Backlog, PortLink
from foveacam_hardware.wire.usb_ports import PortIdentity

ASIDE = StereoVolts(left=MirrorVolts(x_v=10.0, y_v=-20.0), right=MirrorVolts(x_v=-10.0, y_v=5.0))


@pytest.fixture(scope="module")
def controllers() -> Iterator[Controllers]:
    with started() as running:
        yield running


class CuttingLink:
    """A link that loses the last three bytes of every fiftieth write."""

    def __init__(self, link: PortLink) -> None:
        self._link = link
        self._writes = 0
        self.cut_s: float | None = None
        """When it first did, by the monotonic clock."""

    @property
    def identity(self) -> PortIdentity:
        return self._link.identity

    @property
    def file(self) -> int | None:
        return self._link.file

    @property
    def quiet(self) -> bool | None:
        return self._link.quiet

    def backlog(self) -> Backlog:
        return self._link.backlog()

    def read(self, timeout_s: float) -> bytes:
        return self._link.read(timeout_s)

    def close(self) -> None:
        self._link.close()

    def write(self, data: bytes) -> None:
        self._writes += 1
        if self._writes % 50:
            self._link.write(data)
            return
        self.cut_s = self.cut_s or time.monotonic()
        self._link.write(data[:-3])


@pytest.mark.parametrize("cut", ["steer", "ping", "expose"])
def test_a_controller_that_dies_of_cut_off_packets_is_told_within_a_second_with_the_remedy(
    controllers: Controllers, cut: str
) -> None:
    cables = RecordingCables()
    process = controllers.fresh(cables, strict=False)
    process.configure(fragile=True)
    links: list[CuttingLink] = []

    def open_link() -> CuttingLink:
        links.append(CuttingLink(process.open()))
        return links[-1]

    mirrors = ControllerMirrors(open_link, MonotonicClock())
    mirrors.connect()
    works: dict[str, Callable[[], object]] = {
        "steer": lambda: mirrors.steer(ASIDE),
        "ping": mirrors.ping,
        "expose": lambda: mirrors.expose(ASIDE, settle_us=0, pulse_us=4000),
    }
    with pytest.raises((Timeout, NotConnected)) as told:
        for _ in range(50):
            works[cut]()
        mirrors.ping()  # of a silent update nobody would hear
    told_s = time.monotonic()

    assert links[-1].cut_s is not None
    assert told_s - links[-1].cut_s <= 1.0
    assert process.status().dead
    assert "only a power cycle clears it: switch its supply off and on" in str(told.value)
    assert "switch its supply off and on" in (mirrors.state.fault or "")
    assert cables.rail_on  # as it died
    process.configure(fragile=False)
    process.power_cycle()
    mirrors.connect()
    assert mirrors.state.fault is None
    mirrors.close()
