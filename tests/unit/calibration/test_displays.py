"""Screens that show the calibration pattern: which are connected, what they show and keep."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from foveacam_hardware.contract import Busy, InvalidInput, VirtualClock
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.store import Store
from foveacam_server.resources.devices.displays.schema import (
    BlankPattern,
    CharucoPattern,
    DisplayRequest,
    MarkersPattern,
)
from foveacam_server.resources.devices.displays.service import MOST, SILENT_S, PatternDisplayService

CHARUCO = CharucoPattern(kind="charuco", columns=9, rows=6, square_mm=20.0, marker_mm=15.0)
TABLET = DisplayRequest(name="Tablet", width_px=2400, height_px=1600, px_per_mm=10.0)


@dataclass
class Bench:
    """A service on virtual time, and its events."""

    service: PatternDisplayService
    clock: VirtualClock
    events: EventLog
    folder: Path

    def wait_s(self, seconds: float) -> None:
        self.clock.sleep_until_ns(self.clock.now_ns() + round(1e9 * seconds))

    @property
    def emitted(self) -> list[str]:
        return [event.kind for event in self.events.recent(100)]


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Store(tmp_path / "data") as store:
        events, clock = EventLog(store), VirtualClock()
        folder = store.subfolder("displays")
        yield Bench(PatternDisplayService(folder, clock=clock, events=events), clock, events, folder)
        events.close()


def test_displays_are_blank_until_a_pattern_is_chosen(bench: Bench) -> None:
    assert bench.service.pattern().pattern == BlankPattern(kind="blank")
    with pytest.raises(NotFound, match="PUT /api/v1/displays/pattern"):
        bench.service.svg()


def test_a_pattern_is_shown_told_and_kept_over_a_restart(bench: Bench) -> None:
    shown = bench.service.show(CHARUCO)
    assert (shown.width_mm, shown.height_mm) == (220.0, 160.0)
    assert shown.description == "ChArUco board of 9 x 6 inner corners, squares of 20 mm"
    assert bench.emitted == ["display.pattern"]
    again = PatternDisplayService(bench.folder, clock=bench.clock, events=bench.events)
    assert again.pattern() == shown
    assert 'width="220mm"' in again.svg()


def test_a_damaged_file_leaves_the_displays_blank(bench: Bench) -> None:
    (bench.folder / "pattern.json").write_text("{", encoding="utf-8")
    again = PatternDisplayService(bench.folder, clock=bench.clock, events=bench.events)
    assert again.pattern().description == "blank"


def test_a_board_that_cannot_be_is_refused_and_nothing_changes(bench: Bench) -> None:
    before = bench.service.show(CHARUCO)
    with pytest.raises(InvalidInput, match="marker side"):
        bench.service.show(CHARUCO.model_copy(update={"marker_mm": 30.0}))
    assert bench.service.pattern() == before


def test_a_screen_is_listed_with_its_size_and_whether_the_pattern_fits(bench: Bench) -> None:
    assert bench.service.register("a" * 12, TABLET) == bench.service.pattern()
    bench.service.register("b" * 12, TABLET.model_copy(update={"name": "Phone", "px_per_mm": None}))
    bench.service.show(CHARUCO)
    phone, tablet = bench.service.connected()
    assert (tablet.width_mm, tablet.height_mm, tablet.fits) == (240.0, 160.0, True)
    assert (phone.width_mm, phone.height_mm, phone.fits) == (None, None, None)
    bench.service.show(MarkersPattern(kind="markers", side_mm=60.0, spacing_mm=100.0))
    assert [display.fits for display in bench.service.connected()] == [None, False]


def test_a_screen_that_is_silent_for_15_s_is_dropped_and_one_that_is_heard_stays(bench: Bench) -> None:
    bench.service.register("a" * 12, TABLET)
    bench.service.register("b" * 12, TABLET)
    bench.wait_s(0.6 * SILENT_S)
    bench.service.register("b" * 12, TABLET)
    bench.wait_s(0.6 * SILENT_S)
    assert [display.id for display in bench.service.connected()] == ["b" * 12]
    assert bench.emitted == ["display.changed"] * 3, "two came, one was lost; what only repeats is not told"


def test_a_screen_that_leaves_is_dropped_at_once(bench: Bench) -> None:
    bench.service.register("a" * 12, TABLET)
    bench.service.forget("a" * 12)
    bench.service.forget("a" * 12)
    assert bench.service.connected() == []
    assert bench.emitted == ["display.changed"] * 2


def test_too_many_screens_are_refused(bench: Bench) -> None:
    for number in range(MOST):
        bench.service.register(f"{number:012x}", TABLET)
    with pytest.raises(Busy, match="64 displays"):
        bench.service.register("f" * 12, TABLET)
