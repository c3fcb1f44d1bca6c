"""One exposure for both foveae: found in few looks, alike at every look, and put back when a look fails."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from foveacam_hardware.contract import PARKED, DeviceFault, Frame, Role, Sighting, StereoVolts, ValueRange
from foveacam_server.resources.devices.cameras.pair_exposure import (
    LONGEST_NS,
    PairSettings,
    find_exposure,
    too_bright_stops,
)

MS = 1_000_000
SPAN = ValueRange(low=30_000.0, high=1e9)


def before(exposure_ms: float) -> PairSettings:
    return PairSettings(exposure_ns=round(exposure_ms * MS), gain_db=3.0, span_ns=SPAN)


@dataclass
class FakeHead:
    """Two flat pictures, whose levels are what each eye sees in a millisecond."""

    left_per_ms: float = 0.05
    right_per_ms: float = 0.05
    fails_at: int | None = None
    asked: list[tuple[int, float]] = field(default_factory=list)
    looks: int = 0

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        self.asked.append((exposure_ns, gain_db))

    def look(self, volts: StereoVolts) -> Sighting:
        assert volts == PARKED
        self.looks += 1
        if self.looks == self.fails_at:
            raise DeviceFault("camera left: no frame came")
        left, right = (self._frame(role) for role in (Role.LEFT, Role.RIGHT))
        return Sighting(left=left, right=right, wide=left, volts=volts)

    def _frame(self, role: Role) -> Frame:
        per_ms = self.left_per_ms if role is Role.LEFT else self.right_per_ms
        exposure_ns = self.asked[-1][0]
        return frame(per_ms * exposure_ns / MS, role=role, exposure_ns=exposure_ns)


def frame(level: float, *, bits: int = 8, role: Role = Role.LEFT, exposure_ns: int = MS) -> Frame:
    white = 2**bits - 1
    image = np.full((32, 32), round(min(level, 1.0) * white), np.uint8 if bits == 8 else np.uint16)
    return Frame(image=image, role=role, seq=0, t_ns=0, exposure_ns=exposure_ns, bits=bits)


@pytest.mark.parametrize("exposure_ms", [0.1, 1.0, 8.0, 30.0])
def test_both_eyes_are_brought_to_grey_from_anywhere(exposure_ms: float) -> None:
    found = find_exposure(FakeHead(), before(exposure_ms), gaze=PARKED)

    assert found.exposure_ns == pytest.approx(10 * MS, rel=0.08)  # half of full scale at 0.05 in a ms
    assert found.good
    assert found.looks <= 6
    assert (
        found.summary == f"both foveae expose {found.exposure_ns / MS:.3g} ms, found in {found.looks} looks"
    )


def test_the_brighter_eye_decides() -> None:
    found = find_exposure(FakeHead(right_per_ms=0.2), before(8.0), gaze=PARKED)

    assert found.exposure_ns == pytest.approx(2.5 * MS, rel=0.08)


def test_a_good_exposure_stays_what_it_is() -> None:
    found = find_exposure(FakeHead(), before(10.0), gaze=PARKED)

    assert (found.exposure_ns, found.looks) == (10 * MS, 1)


def test_the_gain_is_left_alone() -> None:
    head = FakeHead()
    find_exposure(head, before(1.0), gaze=PARKED)

    assert {gain_db for _, gain_db in head.asked} == {3.0}


def test_the_dark_ends_at_the_longest_exposure_and_says_what_to_do() -> None:
    found = find_exposure(FakeHead(left_per_ms=0.001, right_per_ms=0.0), before(8.0), gaze=PARKED)

    assert found.exposure_ns == LONGEST_NS
    assert not found.good
    assert found.summary.endswith("stops too dark: raise the gain")


def test_a_lamp_ends_at_the_shortest_exposure_and_says_what_to_do() -> None:
    found = find_exposure(FakeHead(left_per_ms=1e4), before(1.0), gaze=PARKED)

    assert found.exposure_ns == SPAN.low
    assert found.summary.endswith("stops too bright: lower the gain")


def test_a_look_that_fails_leaves_both_as_they_were() -> None:
    head = FakeHead(fails_at=2)
    with pytest.raises(DeviceFault):
        find_exposure(head, before(1.0), gaze=PARKED)

    assert head.asked[-1] == (MS, 3.0)


@pytest.mark.parametrize("bits", [8, 12])
def test_what_is_clipped_is_at_least_half_a_stop_too_bright(bits: int) -> None:
    assert too_bright_stops(frame(1.0, bits=bits)) == pytest.approx(1.0)
    clipped = frame(0.1, bits=bits)
    clipped.image[::8, ::32] = 2**bits - 1  # a quarter of what is measured

    assert too_bright_stops(clipped) == 0.5
    assert too_bright_stops(frame(0.25, bits=bits)) == pytest.approx(-1.0, abs=0.02)
