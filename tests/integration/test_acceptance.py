"""Acceptance runs of the simulated rig: a sound one is accepted, a planted fault is named, and it alone."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from foveacam_bench.accept.planted import PLANTED, PlantedFault
from foveacam_bench.accept.runs import accepted
from foveacam_hardware.contract import PARKED, Frame, LookOptions, Sighting, StereoVolts, Timeout
from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.rig import simulated_rig
from foveacam_pipeline.accept.environment import AcceptanceOptions
from foveacam_pipeline.accept.frames import check_frames
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.order import TITLES
from foveacam_pipeline.accept.rig_under_test import REST, RigUnderTest, both
from foveacam_pipeline.accept.run import run_acceptance
from foveacam_pipeline.accept.stopping import check_stop
from foveacam_pipeline.accept.values import Fault, Verdict
from foveacam_pipeline.calibrate.settle.settle_values import SettleSettings
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.watcher import SilentWatcher
from foveacam_server.commands.rig import OwnRig
from foveacam_server.resources.calibrating.acceptances.environment import environment_of_rig

FEW = AcceptanceOptions(looks=20, wide_s=2.0, step=SettleSettings(delays=6, ringing_delays=6))
"""Enough to find a fault; the sound rigs are traced as densely as in the product."""
IN_CI = (
    "wide camera unplugged",
    "no strobe cable, right",
    "left and right cameras exchanged",
    "upside down, wide",
    "mirrors exchanged",
    "late strobe, left",
    "noise, right",
    "baseline 1 % longer",
    "markers printed at 98 %",
)
"""Planted faults of every kind; `foveacam bench accept` plants them all."""


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["rig120", "paper"])
def test_a_sound_rig_is_accepted(preset: str) -> None:
    options = replace(FEW, step=AcceptanceOptions().step)
    found = accepted({"scene": "calibration", "preset": preset}, calibrated=True, options=options)
    assert [each.detail for each in found.findings] == []
    assert found.accepted
    assert [check.name for check in found.checks] == list(TITLES)
    assert {check.picture for check in found.checks if check.picture} == set(found.pictures)
    assert len(found.pictures) == 9
    assert all(picture.startswith(b"\x89PNG") for picture in found.pictures.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", IN_CI)
def test_a_planted_fault_is_named_alone(name: str, tmp_path: Path) -> None:
    planted = next(one for one in PLANTED if one.name == name)
    found = accepted(planted.rig_file(tmp_path), calibrated=True, options=FEW)
    assert {(each.fault, each.subject) for each in found.findings} == {planted.named}
    assert not found.accepted


def test_enough_faults_are_planted() -> None:
    names = [planted.name for planted in PLANTED]
    assert len(set(names)) == len(names) >= 24
    never = set(Fault) - {planted.named[0] for planted in PLANTED}
    assert never == {Fault.FRAME_RATE, Fault.NOT_PARKED}  # the simulated rig cannot have them


@pytest.mark.parametrize("planted", [one for one in PLANTED if not one.rig], ids=lambda one: one.name)
def test_a_planted_scene_is_another_one(planted: PlantedFault, tmp_path: Path) -> None:
    config = SimulatedRigConfig.model_validate(planted.rig_file(tmp_path))
    usual = SimulatedRigConfig(scene="calibration")
    with simulated_rig(config, inline=True) as rig, simulated_rig(usual, inline=True) as sound:
        same_tape = [a.distance_m == b.distance_m for a, b in zip(rig.stations, sound.stations, strict=True)]
        assert all(same_tape) == (planted.taped_scale == 1.0)
        rig.mirrors.enable()
        sound.mirrors.enable()
        seen = [each.head.wide().image for each in (rig, sound)]
        assert (np.abs(seen[0].astype(int) - seen[1]).max() > 50) == (planted.printed_scale != 1.0)


class CancelledIn(SilentWatcher):
    """Cancels in a check, at its third step, and keeps the progress."""

    def __init__(self, check: str) -> None:
        self.check = check
        self.seen: list[tuple[int, int]] = []
        self.notes: list[str] = []

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        self.seen.append((done, total))
        self.notes.append(note)

    def cancelled(self) -> bool:
        return self.notes.count(self.check) > 3


@pytest.mark.slow
@pytest.mark.parametrize("check", ["Sensors", "At rest"])
def test_a_cancelled_run_keeps_what_it_has_measured_and_restores_all_settings(check: str) -> None:
    watch = CancelledIn(check)
    with simulated_rig(SimulatedRigConfig(scene="calibration"), inline=True) as rig:
        rig.mirrors.enable()
        before = [camera.settings for camera in rig.cameras]
        environment = environment_of_rig(rig, None, access_of=OwnRig)
        found = run_acceptance(environment, begun_utc="2026-01-01T00:00:00+00:00", watch=watch, options=FEW)
        assert [camera.settings for camera in rig.cameras] == before
    assert not found.complete
    assert not found.accepted
    assert [check.name for check in found.checks] == list(TITLES)[: len(found.checks)]
    assert watch.notes[-1] == check
    assert 2 <= len(found.checks) < len(TITLES)
    assert all(check.verdict is Verdict.PASSED for check in found.checks)
    assert [done for done, _ in watch.seen] == sorted(done for done, _ in watch.seen)
    assert len({total for _, total in watch.seen}) == 1


@pytest.mark.slow
def test_a_scene_without_markers_is_told() -> None:
    found = accepted({"scene": "bench"}, calibrated=True, options=FEW)
    pictures = next(check for check in found.checks if check.name == "pictures")
    assert pictures.verdict is Verdict.NOT_DONE
    assert "no station with markers" in pictures.note
    assert found.findings == ()


@pytest.fixture
def under_test() -> Iterator[tuple[Rig, RigUnderTest]]:
    """A sound rig before its markers, its mirrors enabled, and the access of the checks."""
    with simulated_rig(SimulatedRigConfig(scene="calibration"), inline=True) as rig:
        rig.mirrors.enable()
        watch, environment = SilentWatcher(), environment_of_rig(rig, None, access_of=OwnRig)
        with environment.use(None) as access:
            environment.turn(access, environment.stations[0], watch)
            yield rig, RigUnderTest(access, MarkerLayout(), watch, begun=lambda: None)


def test_a_stop_that_is_not_confirmed_is_named(
    under_test: tuple[Rig, RigUnderTest], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, access = under_test
    assert check_stop(access, AcceptanceLimits(), spread_px=0.0).verdict is Verdict.PASSED

    def silent(*, within_s: float) -> None:
        rig.mirrors.park()  # they do rest, and nothing says so
        raise Timeout(f"no acknowledgement within {within_s:g} s")

    monkeypatch.setattr(rig.mirrors, "park_confirmed", silent)
    found = check_stop(access, AcceptanceLimits(), spread_px=0.0)
    assert [each.fault for each in found.findings] == [Fault.NOT_PARKED]


def test_mirrors_that_do_not_park_are_named(
    under_test: tuple[Rig, RigUnderTest], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, access = under_test
    monkeypatch.setattr(rig.mirrors, "park_confirmed", lambda *, within_s: None)  # confirms and does nothing
    look = access.look
    away = both((30.0, 0.0), (30.0, 0.0))

    def stuck(volts: StereoVolts = PARKED, *, options: LookOptions = REST) -> Sighting:
        return look(away if options.settle_us == 0 else volts, options=options)

    monkeypatch.setattr(access, "look", stuck)
    found = check_stop(access, AcceptanceLimits(), spread_px=0.0)
    assert [each.fault for each in found.findings] == [Fault.NOT_PARKED]


def test_a_wide_camera_of_another_rate_is_named(
    under_test: tuple[Rig, RigUnderTest], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, access = under_test
    frames = rig.wide.frames

    def slow(n: int, *, timeout_ms: float = 1000.0) -> Iterator[Frame]:
        for frame in frames(n, timeout_ms=timeout_ms):
            yield replace(frame, t_ns=round(1.1 * frame.t_ns))

    monkeypatch.setattr(rig.wide, "frames", slow)
    found, _ = check_frames(access, AcceptanceLimits(), looks=2, wide_s=1.0)
    assert [(each.fault, each.subject) for each in found.findings] == [(Fault.FRAME_RATE, "wide")]
