"""Sweeps that the simulated rig refuses, or ends early, with the reason: markers, mirrors, cameras, plans."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.scenes.marker_room import RecordingWatcher, changed_room, make_grey
from tests.support.scenes.small_sweeps import PLAN, SETTINGS, sweep

from foveacam_hardware.contract import (
    DeviceFault,
    Frame,
    Head,
    InvalidInput,
    LookOptions,
    MirrorVolts,
    OutOfRange,
    Role,
    Sighting,
    StereoVolts,
)
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.sweep.sweep_file import load_sweep
from foveacam_pipeline.calibrate.sweep.sweep_plan import SweepPlan
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

LEFT_FAR = 'name = "far left"\nshape = "quad"\nmaterial = "marker_left"'
RIGHT_FAR = 'name = "far right"\nshape = "quad"\nmaterial = "marker_right"'


@pytest.fixture(scope="module")
def plain_room(tmp_path_factory: pytest.TempPathFactory) -> str:
    return changed_room(tmp_path_factory.mktemp("plain"), plain=True)


def draw_quickly(rig: Rig) -> None:
    """Let all cameras deliver grey, binned frames."""
    make_grey(rig)
    bin_cameras(rig, 2)


@pytest.fixture
def rig(plain_room: str) -> Iterator[Rig]:
    with open_simulated(plain_room, inline=True) as opened:
        draw_quickly(opened)
        yield opened


def test_swapped_markers_end_the_sweep_before_it_begins(tmp_path: Path) -> None:
    scene = changed_room(
        tmp_path,
        (LEFT_FAR, LEFT_FAR.replace("marker_left", "marker_right ")),
        (RIGHT_FAR, RIGHT_FAR.replace("marker_right", "marker_left")),
        ("marker_right ", "marker_right"),
        plain=True,
    )
    with (
        open_simulated(scene, inline=True) as rig,
        pytest.raises(InvalidInput, match=r"from the left its markers are 2, 0, 1.* swapped"),
    ):
        draw_quickly(rig)
        sweep(rig, tmp_path)

    assert not (tmp_path / "sweep-markers.jsonl").exists()


def test_a_marker_that_is_hidden_throughout_ends_the_sweep_early(tmp_path: Path) -> None:
    scene = changed_room(tmp_path, (LEFT_FAR, LEFT_FAR.replace("marker_left", "paper")), plain=True)
    watch = RecordingWatcher()
    with (
        open_simulated(scene, inline=True) as rig,
        pytest.raises(
            InvalidInput, match=r"left eye was refused at 3 poses.* marker 1 is not in the wide view"
        ),
    ):
        draw_quickly(rig)
        sweep(rig, tmp_path, watch, settings=replace(SETTINGS, give_up_after=3))

    kept = load_sweep(tmp_path / "sweep-markers.jsonl")
    assert len(kept.poses) == 3
    assert len(kept.accepted(Role.RIGHT)) == 3
    assert "left refused: marker 1 is not in the wide view" in watch.notes[-1][2]


def test_a_stuck_mirror_is_named_before_the_sweep_begins(rig: Rig, tmp_path: Path) -> None:
    assert rig.truth is not None
    rig.truth.world.faults.dead_axes = {"right x", "right y"}

    with pytest.raises(DeviceFault, match=r"right mirror, x axis.*does not answer"):
        sweep(rig, tmp_path)


class DeadAxis:
    """A head whose left mirror never gets its y volts, without noticing."""

    def __init__(self, head: Head) -> None:
        self._head = head

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        left = replace(volts.left, y_v=0.0)
        seen = self._head.look(StereoVolts(left=left, right=volts.right), options=options)
        told = MirrorVolts(x_v=seen.volts.left.x_v, y_v=volts.left.y_v)
        return replace(seen, left=seen.left.with_volts(told))

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        return self._head.wide(max_age_ms=max_age_ms)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        self._head.expose_foveae(exposure_ns=exposure_ns, gain_db=gain_db)

    def set_low_pass(self, cutoff_hz: int) -> int:
        return self._head.set_low_pass(cutoff_hz)


def test_a_dead_axis_is_named_before_the_sweep_begins(rig: Rig, tmp_path: Path) -> None:
    with pytest.raises(DeviceFault, match=r"left mirror, y axis.*it turned by 0.0"):
        sweep(rig, tmp_path, head=DeadAxis(rig.head))


class Blindfold(DeadAxis):
    """A head whose left eye has its cap on."""

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        seen = self._head.look(volts, options=options)
        dark = np.random.default_rng(seen.left.seq).integers(0, 4, seen.left.image.shape, dtype=np.uint8)
        return replace(seen, left=replace(seen.left, image=dark))


def test_an_eye_that_sees_nothing_ends_the_sweep_early(rig: Rig, tmp_path: Path) -> None:
    settings = replace(SETTINGS, give_up_after=1, centring=replace(SETTINGS.centring, most_looks=4))

    with pytest.raises(InvalidInput, match=r"left eye was refused at 1 pose.*its marker is not in the view"):
        sweep(rig, tmp_path, head=Blindfold(rig.head), settings=settings)


def test_a_frozen_camera_is_named(rig: Rig, tmp_path: Path) -> None:
    assert rig.truth is not None
    rig.truth.world.faults.frozen = {Role.LEFT}

    with pytest.raises(DeviceFault, match=r"left mirror, x axis.*delivers new pictures"):
        sweep(rig, tmp_path)


def test_a_sweep_beyond_the_volts_is_refused(rig: Rig, tmp_path: Path) -> None:
    with pytest.raises(
        OutOfRange, match=r"sweep to ±6\.00° along x: with ±60 V the left mirror reaches ±3\."
    ):
        sweep(rig, tmp_path, settings=replace(SETTINGS, max_v=60.0))


@pytest.mark.parametrize(
    ("plan", "at", "message"),
    [
        (SweepPlan(half_width_rad=math.radians(12.0)), "markers", "the markers leave the wide view"),
        (PLAN, "board", "shows a board: a sweep needs one of markers"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused_before_anything_moves(
    rig: Rig, tmp_path: Path, plan: SweepPlan, at: str, message: str
) -> None:
    before_ns = rig.clock.now_ns()

    with pytest.raises(InvalidInput, match=message):
        sweep(rig, tmp_path, plan=plan, at=at)

    assert rig.clock.now_ns() == before_ns
    assert list(tmp_path.iterdir()) == []
