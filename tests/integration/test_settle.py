"""How the simulated mirrors settle, seen in pictures, against what filters and springs make of a step."""

import math

import numpy as np
import pytest
from tests.support.scenes.marker_room import make_grey

from foveacam_hardware.contract import CameraSettings, Role
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.low_pass import DriveHistory
from foveacam_hardware.sim.presets import RigPreset, find_preset
from foveacam_hardware.sim.render import warm_up
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.calibrate.settle.settle import characterise_settling
from foveacam_pipeline.calibrate.settle.settle_resonance import settle_wait_us
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, SettleReport, SettleSettings
from foveacam_pipeline.verge.aim import EYES
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

pytestmark = pytest.mark.timeout(300)

QUICK = SettleSettings(
    axes=("x",), delays=18, longest_us=16_000, ringing_delays=20, ringing_us=6_000, settled_us=30_000
)
WALL = """
format = "foveacam-scene"
version = 1
title = "A wall with texture of one size, some twenty fovea pixels, and nothing else to draw"

[materials]
stone = {kind="noise", color="#3a352c", accent="#cdbfa6", contrast=1.4, coarsest_m=0.008, finest_m=0.004}

[[objects]]
name = "wall"
shape = "quad"
material = "stone"
position_m = [0, 0, 3]
size_m = [4, 3]
"""
MAX_V = 170.0
TOLERANCE_US = 100.0
"""Half the time between two delays."""


def plainly(rig: Rig) -> CameraSettings:
    """Make all pictures grey and binned, which are drawn faster; return what the foveae are exposed with."""
    make_grey(rig)
    bin_cameras(rig, 2)
    return rig.left.settings


def true_time_us(preset: RigPreset, share: float) -> float:
    """Return when a step is within a share of itself of rest for good."""
    history = DriveHistory(axes=1, mode=preset.mode, cutoff_hz=preset.low_pass_hz, t_ns=0)
    history.set_inputs(0, np.ones(1))
    times_us = np.arange(0, 30_000, 5)
    left = np.array([abs(1.0 - float(history.output_v(int(t) * 1000)[0])) for t in times_us])
    return float(times_us[np.flatnonzero(left > share)[-1]])


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[RigPreset, SettleReport]:
    warm_up()
    preset = find_preset("paper")
    scene = tmp_path_factory.mktemp("scene") / "wall.toml"
    scene.write_text(WALL)
    with open_simulated(str(scene), preset.name, inline=True) as rig:
        before = plainly(rig)
        report = characterise_settling(
            rig.head,
            clock=rig.clock,
            rig_id=rig.rig_id,
            created_utc="2026-02-01T00:00:00+00:00",
            settings=QUICK,
            before=before,
        )
        assert rig.left.settings.exposure_ns == before.exposure_ns
        assert rig.mirrors.low_pass_hz == preset.low_pass_hz
    return preset, report


def _x_axis(report: SettleReport, role: Role) -> AxisSettle:
    return next(found for found in report.axes if (found.role, found.axis) == (role, "x"))


@pytest.mark.parametrize("role", EYES)
def test_the_mirrors_settle_when_the_pictures_say(
    measured: tuple[RigPreset, SettleReport], role: Role
) -> None:
    preset, report = measured
    found = _x_axis(report, role)
    assert found.settle_share_us == pytest.approx(true_time_us(preset, 0.01), abs=TOLERANCE_US)
    assert found.settle_us == pytest.approx(true_time_us(preset, 1.0 / found.step_px), abs=TOLERANCE_US)


def test_largest_move_is_over_after_the_wait_that_follows(measured: tuple[RigPreset, SettleReport]) -> None:
    preset, report = measured
    largest_px = max(axis.step_px * 2.0 * MAX_V / axis.step_v for axis in report.axes)
    true_us = true_time_us(preset, 1.0 / largest_px)
    assert settle_wait_us(report, max_v=MAX_V) == pytest.approx(true_us, abs=TOLERANCE_US + 100.0)


@pytest.mark.parametrize("role", EYES)
def test_the_mirrors_own_resonance_is_found(measured: tuple[RigPreset, SettleReport], role: Role) -> None:
    preset, report = measured
    found = _x_axis(report, role).resonance
    assert found is not None, _x_axis(report, role).ringing
    assert found.frequency_hz == pytest.approx(preset.mode.frequency_hz, rel=0.03)
    assert math.log(found.quality / preset.mode.quality) == pytest.approx(0.0, abs=0.2)
