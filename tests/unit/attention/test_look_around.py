import numpy as np
import pytest
from tests.support.scenes.plane_head import CALIBRATION, PlaneHead, noise_texture, plain_texture

from foveacam_hardware.contract import Cancelled, LookOptions, OutOfRange, Sighting, StereoVolts
from foveacam_pipeline.attention.field import FieldGrid
from foveacam_pipeline.attention.look_around import MOST_LOOKS, LookAroundProgress, look_around
from foveacam_pipeline.attention.looks import Candidates
from foveacam_pipeline.attention.policy import AttentionPolicy
from foveacam_pipeline.attention.watching import FieldMemory, Watcher
from foveacam_pipeline.wide_depth.wide_context import WideContext

GRID = FieldGrid.of(CALIBRATION.wide, context_cell_px=8)
CANDIDATES = Candidates(CALIBRATION, GRID)


def both_reach() -> np.ndarray:
    """Return (135, 180) bool: the context's cells about which both eyes verge."""
    field = CANDIDATES.near_directions.any(axis=0).reshape(GRID.rows, GRID.columns)
    return np.repeat(np.repeat(field, 3, axis=0), 3, axis=1)


@pytest.mark.parametrize("z_m", [2.5, 12.0])
def test_a_look_around_measures_the_field_and_says_when_it_is_done(z_m: float) -> None:
    head = PlaneHead(z_m=z_m, texture=noise_texture(), binning=2)
    context = WideContext(CALIBRATION.wide)
    told: list[LookAroundProgress] = []
    found = look_around(head, CALIBRATION, context, clock=head.clock, on_look=told.append)
    assert not found.cancelled
    assert found.looks == len(told) < MOST_LOOKS
    assert found.shown_fraction > 0.9
    known = context.snapshot()
    field = both_reach()
    assert known.known[0][field].mean() > 0.85
    q = known.inverse_z_per_m[0][known.known[0]]
    sigma = known.sigma_per_m[0][known.known[0]]
    assert np.mean(np.abs(q - 1.0 / z_m) <= 3.0 * sigma) > 0.97
    done = [one.done for one in told]
    assert done == sorted(done)
    assert done[-1] > 0.6  # what the last look is worth above what ends it differs between processors
    assert told[0].look.loss > told[-1].look.loss
    assert all(one.look.look.reason for one in told)


def test_a_cancelled_look_around_keeps_what_it_has_seen() -> None:
    head = PlaneHead(z_m=2.5, texture=noise_texture(), binning=2)
    context = WideContext(CALIBRATION.wide)
    told: list[LookAroundProgress] = []
    found = look_around(
        head,
        CALIBRATION,
        context,
        clock=head.clock,
        on_look=told.append,
        cancelled=lambda: len(told) >= 2,
    )
    assert (found.looks, found.cancelled) == (2, True)
    assert 0.0 < found.shown_fraction < 0.3
    assert context.snapshot().known.sum() > 100


class EndedHead(PlaneHead):
    """A head whose session ends after some looks, as by the stop."""

    left = 3

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        if self.left == 0:
            raise Cancelled("the session has ended")
        self.left -= 1
        return super().look(volts, options=options)


def test_a_session_that_ends_ends_the_look_around() -> None:
    head = EndedHead(z_m=2.5, texture=noise_texture(), binning=2)
    found = look_around(head, CALIBRATION, WideContext(CALIBRATION.wide), clock=head.clock)
    assert (found.looks, found.cancelled) == (3, True)


def test_a_field_without_texture_ends_it_soon() -> None:
    head = PlaneHead(z_m=4.0, texture=plain_texture(), binning=2)
    context = WideContext(CALIBRATION.wide)
    found = look_around(head, CALIBRATION, context, clock=head.clock)
    assert found.looks <= 3
    assert context.snapshot().known[0].mean() < 1e-3


def test_a_field_that_is_known_takes_no_look() -> None:
    head = PlaneHead(z_m=2.5, texture=noise_texture(), binning=2)
    context = WideContext(CALIBRATION.wide)
    first = look_around(head, CALIBRATION, context, clock=head.clock)
    again = look_around(head, CALIBRATION, context, clock=head.clock)
    assert again.looks < 0.3 * first.looks


def test_looks_that_bring_nothing_make_their_kind_and_their_cells_less_worth() -> None:
    head = PlaneHead(z_m=2.5, texture=plain_texture(), binning=2)
    memory = FieldMemory(GRID)
    candidates = Candidates(CALIBRATION, GRID)
    context = WideContext(CALIBRATION.wide)
    watcher = Watcher(head, CALIBRATION, context, memory, candidates, clock=head.clock)
    textured = np.random.default_rng(1).integers(0, 255, (1080, 1440), dtype=np.uint8)
    made = watcher.look(AttentionPolicy(candidates), textured)
    assert made is not None
    assert made.loss == pytest.approx(1.0)
    assert min(memory.yields.apart, memory.yields.verged) == pytest.approx(0.8)
    assert memory.tries.sum() > 20
    assert np.isfinite(memory.looked_s).sum() == memory.tries.sum()


class NarrowHead(PlaneHead):
    """A head whose mirrors refuse the left part of their field."""

    refused = 0

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        if min(volts.left.x_v, volts.right.x_v) < 0.0:
            self.refused += 1
            raise OutOfRange("the driver does not reach that")
        return super().look(volts, options=options)


def test_looks_that_the_head_refuses_are_left_out() -> None:
    head = NarrowHead(z_m=2.5, texture=noise_texture(), binning=2)
    context = WideContext(CALIBRATION.wide)
    found = look_around(head, CALIBRATION, context, clock=head.clock)
    assert head.refused > 0
    assert not found.cancelled
    assert found.looks > 5
    assert context.snapshot().known[0].mean() > 0.05
