"""The judgements of an acceptance run on made-up measurements: each names its fault, and a sound rig none."""

import math
from dataclasses import replace

import numpy as np
import pytest

from foveacam_hardware.contract import Role
from foveacam_pipeline.accept.axes import AxisResponse, check_gains, findings_of
from foveacam_pipeline.accept.geometry import StationMeasure, named
from foveacam_pipeline.accept.limits import AcceptanceLimits
from foveacam_pipeline.accept.repeatability import (
    RETURNS,
    SIDES,
    RestPlaces,
    Returns,
    check_rest,
    check_returns,
)
from foveacam_pipeline.accept.sensors import SensorFrames, judge_sensors, photon_transfer
from foveacam_pipeline.accept.timing import filter_response, step_timing
from foveacam_pipeline.accept.values import (
    REMEDIES,
    Acceptance,
    AcceptanceCheck,
    Fault,
    NamedFault,
    judged,
    not_done,
)
from foveacam_pipeline.calibrate.settle.settle_values import AxisSettle, StepTrace
from foveacam_pipeline.models.calibration_file import load_calibration
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED

LIMITS = AcceptanceLimits()
CALIBRATION = load_calibration(SHIPPED / "sim-rig120.json")
GAINS = np.diag([0.060, 0.052, 0.060, 0.052])
FULL_WELL = 0.024
"""Grey levels per electron."""


def faults(found: AcceptanceCheck | list[NamedFault]) -> list[tuple[Fault, str]]:
    findings = found if isinstance(found, list) else list(found.findings)
    return [(each.fault, each.subject) for each in findings]


# Axes


def response(gains: np.ndarray) -> AxisResponse:
    return AxisResponse(gains_deg_per_v=gains)


def test_sound_axes_name_nothing() -> None:
    assert findings_of(response(GAINS)) == []
    assert faults(check_gains(response(GAINS), LIMITS, None)) == []


def test_each_fault_of_the_axes_is_named() -> None:
    mirrors_exchanged = GAINS[[2, 3, 0, 1]]
    axes_exchanged = GAINS[[1, 0, 2, 3]]
    reversed_y = GAINS * np.array([1.0, 1.0, 1.0, -1.0])
    stuck_x = GAINS * np.array([0.0, 1.0, 1.0, 1.0])
    for gains, fault in (
        (mirrors_exchanged, (Fault.EXCHANGED_MIRRORS, "left and right")),
        (axes_exchanged, (Fault.EXCHANGED_AXES, "left")),
        (reversed_y, (Fault.REVERSED_AXIS, "right y")),
        (stuck_x, (Fault.STUCK_AXIS, "left x")),
    ):
        assert faults(findings_of(response(gains))) == [fault]


def test_a_gain_is_judged_against_the_design_more_loosely() -> None:
    weak = response(0.9 * GAINS)
    assert faults(check_gains(weak, LIMITS, None)) == []
    assert faults(check_gains(response(0.8 * GAINS), LIMITS, None)) == [(Fault.WEAK_DRIVE, "left and right")]
    assert faults(check_gains(weak, LIMITS, CALIBRATION)) == [(Fault.WEAK_DRIVE, "left and right")]


# Repeatability


def rest(noise_deg: float = 1e-4, *, at_s: float = 0.0, shift_deg: float = 0.0) -> RestPlaces:
    rng = np.random.default_rng(5)
    places = shift_deg * np.array([1.0, 0.0, 0.0, 0.0]) + noise_deg * rng.standard_normal((10, 4))
    return RestPlaces(t_s=at_s + 0.5 * np.arange(10.0), places_deg=places)


def returns(noise_deg: float = 1e-4, *, hysteresis_deg: float = 0.0) -> Returns:
    rng = np.random.default_rng(6)
    sides = np.array(list(range(len(SIDES))) * RETURNS)
    towards = np.array([[*SIDES[side], *SIDES[side]] for side in sides])
    places = hysteresis_deg * towards + noise_deg * rng.standard_normal((len(sides), 4))
    return Returns(sides=sides, places_deg=places)


def test_a_picture_that_moves_at_rest_is_a_loose_mount() -> None:
    assert faults(check_rest(rest(), LIMITS)) == []
    loose = rest()
    loose.places_deg[:, 2:] += 0.02 * np.random.default_rng(7).standard_normal((10, 2))
    assert faults(check_rest(loose, LIMITS)) == [(Fault.LOOSE_MOUNT, "right")]


@pytest.mark.parametrize(
    ("measured", "fault"),
    [
        (returns(), []),
        (returns(0.03), [(Fault.SCATTER, "")]),
        (returns(hysteresis_deg=0.012), [(Fault.HYSTERESIS, "")]),
        (returns(0.006), []),  # as the published sweep of the real rig
    ],
)
def test_returns_scatter_or_depend_on_their_side(measured: Returns, fault: list[tuple[Fault, str]]) -> None:
    assert faults(check_returns(measured, rest(), rest(at_s=60.0), LIMITS)) == fault


def test_a_steady_turn_is_a_drift_unless_the_mirrors_scatter_as_much() -> None:
    creeping = rest(at_s=60.0, shift_deg=0.02)
    assert faults(check_returns(returns(), rest(), creeping, LIMITS)) == [(Fault.MOUNT_DRIFT, "left")]
    assert (Fault.MOUNT_DRIFT, "left") not in faults(check_returns(returns(0.03), rest(), creeping, LIMITS))


# Timing


def traced(*, scale: float, latency_ms: float, cutoff_hz: int = 120) -> AxisSettle:
    """Return the trace of a step behind a filter, exposed `latency_ms` after triggers believed at 0.15."""
    delays_s = np.linspace(0.0, 0.016, 40)
    times_s, shape = filter_response(cutoff_hz)
    left = 480.0 * (1.0 - np.interp(scale * (delays_s + 1e-3 * latency_ms), times_s, shape))
    believed_us = 1e6 * delays_s + 150.0
    trace = StepTrace(times_us=tuple(believed_us), left_px=tuple(left))
    return AxisSettle(
        role=Role.LEFT,
        axis="x",
        step_v=17.0,
        step_px=480.0,
        noise_px=0.1,
        settle_us=9000.0,
        settle_share_us=6000.0,
        resonance=None,
        ringing="",
        trace=trace,
        open_trace=trace,
    )


@pytest.mark.parametrize("scale", [0.5, 1.0])
@pytest.mark.parametrize("latency_ms", [0.15, 0.9])
def test_a_trace_shows_the_filter_and_the_moment_of_exposure(scale: float, latency_ms: float) -> None:
    found = step_timing(traced(scale=scale, latency_ms=latency_ms), cutoff_hz=120, strobe_ms=0.15)
    assert found.scale == pytest.approx(scale, rel=0.03)
    assert found.latency_ms == pytest.approx(latency_ms, abs=0.12)


# Sensors


def sensor_frames(
    *,
    black: float = 0.0,
    own_noise: float = 0.3,
    hot: int = 0,
    lost_bits: int = 0,
    mosaic: float = 1.0,
) -> SensorFrames:
    """Return pictures of a smooth scene by a sensor that shot noise and `own_noise` disturb."""
    rng = np.random.default_rng(8)
    light = np.tile(np.linspace(10.0, 200.0, 400), (300, 1))
    light[::2, ::2] *= mosaic

    def picture(share: float) -> np.ndarray:
        level = share * light
        noisy = level + rng.standard_normal(level.shape) * np.sqrt(FULL_WELL * level + own_noise**2)
        counts = np.clip(np.rint(noisy + black), 0, 255).astype(np.uint8)
        return (counts >> lost_bits) << lost_bits

    ladder = [picture(share) for share in (0.25, 0.5, 0.5, 1.0)]
    dark = np.full(light.shape, max(black, 0.0), dtype=np.float32)
    dark.ravel()[:hot] = 255.0
    return SensorFrames(
        ladder=tuple(each.astype(np.float32) for each in ladder),
        exposures_ns=(2_000_000, 4_000_000, 4_000_000, 8_000_000),
        dark=dark,
        dark_ns=50_000,
        raw=ladder[-1],
        bits=8,
        black_level=0.0,
    )


def test_a_sound_sensor_names_nothing_and_shows_its_gain() -> None:
    frames = sensor_frames()
    assert faults(judge_sensors({Role.LEFT: frames}, LIMITS)) == []
    levels, variances = photon_transfer(frames)
    assert np.polyfit(levels, variances, 1)[0] == pytest.approx(FULL_WELL, rel=0.05)


@pytest.mark.parametrize(
    ("frames", "fault"),
    [
        (sensor_frames(black=6.0), Fault.BLACK_LEVEL),
        (sensor_frames(black=-6.0), Fault.BLACK_LEVEL),
        (sensor_frames(own_noise=3.0), Fault.NOISE),
        (sensor_frames(hot=100), Fault.HOT_PIXELS),
        (sensor_frames(lost_bits=3), Fault.PIXEL_FORMAT),
        (sensor_frames(mosaic=0.6), Fault.PIXEL_FORMAT),
    ],
)
def test_each_fault_of_a_sensor_is_named_alone(frames: SensorFrames, fault: Fault) -> None:
    assert faults(judge_sensors({Role.RIGHT: frames}, LIMITS)) == [(fault, "right")]


# Geometry


def measured(
    z_m: float, *, stereo: float = 1.0, printed: float = 1.0, moved_px: float = 0.0
) -> StationMeasure:
    """Return a station at `z_m` by tape.

    `stereo`, `printed`: distances against it, by a wrong baseline or print; `moved_px`: of the left eye.
    """
    disparity_px = CALIBRATION.fovea_f_px * CALIBRATION.baseline_m / z_m
    apart_px = disparity_px * (1.0 / stereo - 1.0) / 2.0
    seen_px = disparity_px + 2.0 * apart_px + moved_px
    return StationMeasure(
        name=f"at {z_m:g}",
        taped_m=z_m,
        printed_m=printed * z_m,
        stereo_m=z_m * disparity_px / seen_px,
        stereo_sigma_m=1e-3 * z_m,
        z_m=z_m,
        errors_px=np.array([[apart_px + moved_px, 0.0], [-apart_px, 0.0]]),
    )


@pytest.mark.parametrize(
    ("stations", "fault"),
    [
        ([measured(5.0), measured(2.5)], []),
        ([measured(5.0, stereo=1.01), measured(2.5, stereo=1.01)], [(Fault.BASELINE, "")]),
        ([measured(5.0, printed=1.02), measured(2.5, printed=1.02)], [(Fault.PRINTED_SCALE, "")]),
        ([measured(5.0, stereo=0.982, printed=0.98), measured(2.5)], [(Fault.TAPED_DISTANCE, "at 5")]),
        ([measured(5.0, moved_px=-40.0), measured(2.5, moved_px=-40.0)], [(Fault.MOVED_EYE, "left")]),
        ([measured(5.0, moved_px=40.0)], [(Fault.MOVED_EYE, "left")]),
    ],
)
def test_lengths_that_disagree_name_their_cause(
    stations: list[StationMeasure], fault: list[tuple[Fault, str]]
) -> None:
    assert faults(named(stations, LIMITS, CALIBRATION)) == fault


def test_a_calibration_that_states_large_errors_is_held_to_those() -> None:
    uncertain = replace(
        CALIBRATION,
        left=replace(
            CALIBRATION.left, mirror=replace(CALIBRATION.left.mirror, sigma_rad=(math.radians(0.05),) * 2)
        ),
    )
    station = replace(measured(5.0, moved_px=40.0), stereo_sigma_m=0.11)
    assert named([station], LIMITS, uncertain) == []
    assert named([station], LIMITS, CALIBRATION) != []


def test_only_a_whole_run_whose_checks_all_passed_is_accepted() -> None:
    found = NamedFault(fault=Fault.NOISE, subject="left", detail="the left camera: too noisy")
    passed, failed = judged("one", "One"), judged("two", "Two", findings=[found])
    for checks, complete, accepted in (
        ((passed,), True, True),
        ((passed,), False, False),
        ((passed, failed), True, False),
        ((passed, not_done("three", "Three", "waits for: One")), True, False),
    ):
        run = Acceptance(
            rig_id="sim",
            calibration_id=None,
            begun_utc="2026-01-01T00:00:00+00:00",
            duration_s=1.0,
            complete=complete,
            checks=checks,
        )
        assert run.accepted == accepted
        assert run.findings == ((found,) if failed in checks else ())


def test_every_fault_has_a_remedy() -> None:
    assert set(REMEDIES) == set(Fault)
