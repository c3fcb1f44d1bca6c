"""The mirrors' chain: filter, resonance and static law, against the figures of the real rig."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from tests.support.scenes.simulated_gaze import gaze

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_hardware.sim.low_pass import DriveHistory, ResonantMode, bessel_polynomial
from foveacam_hardware.sim.mirror import FULL_SCALE_CODE, FULL_SCALE_V, MirrorPair, built_law
from foveacam_hardware.sim.optics import FoldedEye, built_assembly
from foveacam_hardware.sim.presets import PAPER, PRESETS, RIG120, RigPreset, find_preset

STIFF = ResonantMode(frequency_hz=50_000.0, quality=0.7)
"""A mirror without a resonance to speak of."""
PX_PER_DEG = 502.0
FULL_STROKE_DEG = 20.0
RASTER_STEP_DEG = 2.23  # the published sweep's step in x


def settle_ms(preset_mode: ResonantMode, cutoff_hz: int, *, share: float) -> float:
    """Time after a step from which on the deviation stays below a share of it."""
    history = DriveHistory(axes=1, mode=preset_mode, cutoff_hz=cutoff_hz, t_ns=0)
    history.set_inputs(0, np.array([1.0]))
    times_ns = np.arange(0, 60_000_000, 20_000)
    left = np.abs([history.output_v(int(t_ns))[0] - 1.0 for t_ns in times_ns])
    return float(times_ns[np.nonzero(left > share)[0][-1] + 1] / 1e6)


def codes(volts: MirrorVolts, *, bias_v: float = 90.0) -> tuple[int, ...]:
    """DAC codes of both mirrors at the same volts."""
    pair = []
    for v in (volts.x_v, volts.y_v):
        pair += [round((bias_v + s * v / 2) * FULL_SCALE_CODE / FULL_SCALE_V) for s in (1.0, -1.0)]
    return tuple(pair * 2)


def pair_at_rest() -> MirrorPair:
    pair = MirrorPair(mode=RIG120.mode, cutoff_hz=120, t_ns=0, seed=0)
    pair.set_rail(0, on=True)
    return pair


@pytest.mark.parametrize("order", [1, 2, 5, 8])
def test_filter_is_the_bessel_filter_of_a_library(order: int) -> None:
    from scipy import signal  # slow to import

    _, denominator = signal.bessel(order, 1.0, analog=True, output="ba", norm="mag")
    assert bessel_polynomial(order) == pytest.approx(denominator[::-1], rel=1e-12)


@pytest.mark.parametrize(
    ("share", "expected_ms"),
    [
        (0.01, 5.7),
        (1.0 / (RASTER_STEP_DEG * PX_PER_DEG), 9.9),
        (1.0 / (FULL_STROKE_DEG * PX_PER_DEG), 12.9),
    ],
)
def test_the_120_hz_filter_settles_as_measured_on_the_rig(share: float, expected_ms: float) -> None:
    assert settle_ms(STIFF, 120, share=share) == pytest.approx(expected_ms, abs=0.1)


def test_the_filter_delays_by_its_group_delay() -> None:
    history = DriveHistory(axes=1, mode=STIFF, cutoff_hz=120, t_ns=0)
    history.set_inputs(0, np.array([1.0]))
    times_ns = np.arange(0, 12_000_000, 10_000)
    half_ms = times_ns[np.searchsorted([history.output_v(int(t))[0] for t in times_ns], 0.5)] / 1e6

    assert half_ms == pytest.approx(386.0 / 120.0, rel=0.05)


def test_paper_is_within_one_percent_in_under_two_milliseconds_and_rig120_is_not() -> None:
    assert settle_ms(PAPER.mode, PAPER.low_pass_hz, share=0.01) < 2.0
    assert settle_ms(RIG120.mode, RIG120.low_pass_hz, share=0.01) == pytest.approx(5.7, abs=0.2)


@pytest.mark.parametrize("preset", PRESETS.values(), ids=str)
def test_after_the_settle_time_of_a_preset_the_largest_move_is_within_a_pixel(preset: RigPreset) -> None:
    share = 1.0 / (FULL_STROKE_DEG * PX_PER_DEG)
    needed_ms = settle_ms(preset.mode, preset.low_pass_hz, share=share)

    assert needed_ms <= preset.settle_us / 1000.0 < 1.3 * needed_ms


def test_a_move_after_a_change_of_the_filter_has_the_new_cut_off() -> None:
    changed, fresh = (
        DriveHistory(axes=1, mode=STIFF, cutoff_hz=cutoff_hz, t_ns=0) for cutoff_hz in (120, 480)
    )
    changed.set_low_pass(0, 480)
    for history in (changed, fresh):
        history.set_inputs(1_000_000, np.array([1.0]))

    assert changed.output_v(2_000_000)[0] == pytest.approx(fresh.output_v(2_000_000)[0], rel=1e-9)


def test_the_resonance_rings_at_its_frequency() -> None:
    mode = ResonantMode(frequency_hz=400.0, quality=40.0)
    history = DriveHistory(axes=1, mode=mode, cutoff_hz=800, t_ns=0)
    history.set_inputs(0, np.array([1.0]))
    times_ns = np.arange(10_000_000, 40_000_000, 20_000)
    ring = np.array([history.output_v(int(t))[0] - 1.0 for t in times_ns])
    crossings = np.nonzero(np.diff(np.sign(ring)))[0]

    period_ms = 2.0 * float(np.mean(np.diff(times_ns[crossings]))) / 1e6
    assert period_ms == pytest.approx(2.5, rel=0.01)
    fading_ms = 40.0 / (np.pi * 400.0) * 1e3  # Q / (pi f); the windows below lie 26 ms apart
    kept = np.abs(ring[-200:]).max() / np.abs(ring[:200]).max()
    assert kept == pytest.approx(np.exp(-26.0 / fading_ms), rel=0.03)


def test_many_small_steps_agree_with_the_matrix_exponential() -> None:
    """The same system integrated by another method: expm of the augmented matrix, step by step."""
    rng = np.random.default_rng(1)
    mode, cutoff_hz = ResonantMode(frequency_hz=900.0, quality=15.0), 120
    history = DriveHistory(axes=1, mode=mode, cutoff_hz=cutoff_hz, t_ns=0)
    system = history._segments[0].system
    a = (system.vectors @ np.diag(system.rates) @ system.inverse).real
    b = -a @ system.rest
    state, t_ns = np.zeros(7), 0
    for volts, step_ns in zip(rng.uniform(-170, 170, 40), rng.integers(50_000, 3_000_000, 40), strict=True):
        history.set_inputs(t_ns, np.array([volts]))
        augmented = np.zeros((8, 8))
        augmented[:7, :7], augmented[:7, 7] = a, b * volts
        state = (expm(augmented * step_ns * 1e-9) @ np.append(state, 1.0))[:7]
        t_ns += int(step_ns)
        assert history.output_v(t_ns)[0] == pytest.approx(state[5], abs=1e-7)


def test_changing_the_filter_at_rest_moves_nothing() -> None:
    history = DriveHistory(axes=1, mode=STIFF, cutoff_hz=120, t_ns=0)
    history.set_inputs(0, np.array([100.0]))
    history.set_low_pass(1_000_000_000, 700)

    for later_ns in (0, 100_000, 1_000_000, 5_000_000):
        assert history.output_v(1_000_000_000 + later_ns)[0] == pytest.approx(100.0, abs=1e-6)


def test_the_past_can_be_asked_for_after_a_thousand_later_writes() -> None:
    history = DriveHistory(axes=1, mode=STIFF, cutoff_hz=120, t_ns=0)
    history.set_inputs(0, np.array([50.0]))
    before = history.output_v(4_000_000)
    for k in range(1000):
        history.set_inputs(5_000_000 + k * 1_000_000, np.array([float(k % 7)]))

    assert history.output_v(4_000_000) == pytest.approx(before, abs=1e-12)


def test_history_is_bounded() -> None:
    history = DriveHistory(axes=1, mode=STIFF, cutoff_hz=120, t_ns=0)
    for k in range(30_000):
        history.set_inputs(k * 1_000_000, np.array([0.0]))

    assert len(history._segments) < 11_000


def test_a_mirror_arrives_where_the_static_law_says() -> None:
    volts = MirrorVolts(x_v=100.0, y_v=-60.0)
    pair = pair_at_rest()
    pair.set_codes(0, codes(volts))

    for role in (Role.LEFT, Role.RIGHT):
        assert pair.tilt_rad(role, 200_000_000) == pytest.approx(pair.rest_tilt_rad(role, volts), abs=2e-6)


def test_without_the_rail_the_springs_bring_the_mirrors_to_rest() -> None:
    pair = pair_at_rest()
    pair.set_codes(0, codes(MirrorVolts(x_v=120.0, y_v=80.0)))
    pair.set_rail(500_000_000, on=False)
    at_rest = pair.rest_tilt_rad(Role.LEFT, MirrorVolts(x_v=0.0, y_v=0.0))

    assert pair.tilt_rad(Role.LEFT, 499_000_000)[0] - at_rest[0] > np.deg2rad(3.0)
    assert pair.tilt_rad(Role.LEFT, 700_000_000) == pytest.approx(at_rest, abs=1e-6)


def test_half_the_bias_makes_half_the_angle() -> None:
    """Electrodes pull with the square of their volts: the differential acts in proportion to the bias."""
    pair = pair_at_rest()
    rest = pair.rest_tilt_rad(Role.LEFT, MirrorVolts(x_v=0.0, y_v=0.0))
    pair.set_codes(0, codes(MirrorVolts(x_v=20.0, y_v=0.0), bias_v=45.0))

    half = pair.tilt_rad(Role.LEFT, 300_000_000)
    expected = pair.rest_tilt_rad(Role.LEFT, MirrorVolts(x_v=10.0, y_v=0.0))
    assert half == pytest.approx(expected, abs=1e-5)
    assert half[0] > rest[0]


def test_a_stuck_mirror_stays_and_the_other_goes_on() -> None:
    pair = pair_at_rest()
    stuck_at, free_at = pair.tilt_rad(Role.LEFT, 0), pair.tilt_rad(Role.RIGHT, 0)
    pair.dead_axes = {"left x", "left y"}
    pair.tilt_rad(Role.LEFT, 0)
    pair.set_codes(0, codes(MirrorVolts(x_v=100.0, y_v=0.0)))

    assert pair.tilt_rad(Role.LEFT, 200_000_000) == pytest.approx(stuck_at)
    assert pair.tilt_rad(Role.RIGHT, 200_000_000)[0] > free_at[0] + np.deg2rad(2.0)


def swept(role: Role, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A 9 x 9 sweep of one simulated eye: volts (81, 2) and axis-wise gaze angles (81, 2), degrees."""
    grid = np.linspace(-165.0, 165.0, 9)
    volts = np.array([(x, y) for y in grid for x in grid])
    eye = FoldedEye(built_assembly(role, seed=seed))
    rays = np.array([gaze(eye.view(*tilt)) for tilt in built_law(role, seed=seed).tilt_rad(volts)])
    return volts, np.rad2deg(np.arctan(rays[:, :2] / rays[:, 2:]))


def cubic(
    volts: NDArray[np.float64], angles_deg: NDArray[np.float64]
) -> tuple[dict[tuple[int, int], NDArray[np.float64]], NDArray[np.float64]]:
    """Coefficients of a cubic in volts / 170 V, and the RMS that it leaves, degrees."""
    x, y = volts[:, 0] / 170.0, volts[:, 1] / 170.0
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    basis = np.stack([x**i * y**j for i, j in powers], axis=1)
    coefficients = np.linalg.lstsq(basis, angles_deg, rcond=None)[0]
    left = np.sqrt(np.mean((basis @ coefficients - angles_deg) ** 2, axis=0))
    return dict(zip(powers, coefficients, strict=True)), left


@pytest.mark.parametrize(("role", "side"), [(Role.LEFT, -1.0), (Role.RIGHT, 1.0)])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_mirror_and_optics_together_bend_like_the_published_sweep(role: Role, side: float, seed: int) -> None:
    """Gains, 11 % saturation, cross terms mirrored between the eyes, offsets of a tenth of a degree."""
    terms, left_deg = cubic(*swept(role, seed))

    assert terms[1, 0][0] / 170.0 == pytest.approx(0.060, rel=0.04)  # degrees a volt at rest
    assert terms[0, 1][1] / 170.0 == pytest.approx(0.052, rel=0.04)
    assert -terms[3, 0][0] / terms[1, 0][0] == pytest.approx(0.11, abs=0.03)
    assert -terms[0, 3][1] / terms[0, 1][1] == pytest.approx(0.11, abs=0.03)
    assert terms[0, 2][0] == pytest.approx(side * 0.34, abs=0.06)
    assert terms[1, 1][1] == pytest.approx(-side * 0.42, abs=0.06)
    assert np.all(np.abs(terms[0, 0]) < 0.4)
    # No polynomial, and as far from a cubic as the real mirrors (0.03 to 0.05 degrees, their noise included).
    assert np.all((left_deg > 0.008) & (left_deg < 0.05))


def test_presets_are_found_by_name_and_unknown_ones_are_named() -> None:
    assert find_preset("paper") is PAPER
    assert RIG120.rig_id(0) == "sim-rig120"
    assert RIG120.rig_id(7) == "sim-rig120-7"
    with pytest.raises(Exception, match=r"'rig121'.*paper, rig120"):
        find_preset("rig121")
