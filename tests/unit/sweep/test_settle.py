import math
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import noise_texture

from foveacam_hardware.contract import (
    Binning,
    CameraSettings,
    Cancelled,
    DeviceFault,
    Frame,
    InvalidInput,
    LookOptions,
    Role,
    Sighting,
    StereoVolts,
    VirtualClock,
)
from foveacam_pipeline.calibrate.settle.settle import characterise_settling
from foveacam_pipeline.calibrate.settle.settle_report import load_settle, save_settle, settle_picture
from foveacam_pipeline.calibrate.settle.settle_resonance import fit_resonance, remaining_step
from foveacam_pipeline.calibrate.settle.settle_shift import SettledPicture
from foveacam_pipeline.calibrate.settle.settle_values import (
    SettleReport,
    SettleSettings,
    StepTrace,
    time_below,
)
from foveacam_pipeline.calibrate.watcher import SilentWatcher

pytestmark = pytest.mark.slow

STEP_PX = 500.0
NORMAL = CameraSettings(exposure_ns=8_000_000, gain_db=3.0)
QUICK = SettleSettings(delays=12, longest_us=20_000, ringing_us=8_000, ringing_delays=24)
FEW = replace(QUICK, delays=4, ringing_delays=4)
"""Where nothing is measured: 19 looks with the rig's filter, then 5 with it wide open, for one axis."""
RATE_PER_S = 400.0
"""The head below comes to rest by e in 2.5 ms."""


def decay(times_ms: NDArray[np.float64], *, noise_px: float = 0.0) -> StepTrace:
    left = STEP_PX * np.exp(-times_ms) + np.random.default_rng(2).normal(0.0, noise_px, len(times_ms))
    return StepTrace(times_us=tuple((1e3 * times_ms).tolist()), left_px=tuple(left.tolist()))


@pytest.mark.parametrize("limit_px", [50.0, 5.0, 1.0])
def test_the_settle_time_lies_where_the_limit_is_crossed(limit_px: float) -> None:
    trace = decay(np.linspace(0.0, 12.0, 25), noise_px=0.01)
    assert time_below(trace, limit_px, floor_px=0.01) == pytest.approx(
        1e3 * math.log(STEP_PX / limit_px), rel=0.01
    )


def test_a_limit_below_the_noise_is_told_by_how_fast_it_fell() -> None:
    trace = decay(np.linspace(0.0, 12.0, 49), noise_px=0.05)
    expected_us = 1e3 * math.log(STEP_PX / 0.02)
    assert time_below(trace, 0.02, floor_px=0.05) == pytest.approx(expected_us, rel=0.1)


def test_a_swing_that_passes_rest_is_not_at_rest() -> None:
    trace = StepTrace(times_us=(0.0, 1000.0, 2000.0, 3000.0), left_px=(100.0, 0.1, -20.0, 0.1))
    assert time_below(trace, 1.0, floor_px=0.01) > 2000.0


def rung(frequency_hz: float, quality: float, *, noise_px: float = 0.1) -> StepTrace:
    """Return what a filter of 1000 Hz and a mode make of a step."""
    from scipy import signal  # slow to import

    _, poles, _ = signal.bessel(5, 2.0 * np.pi * 1000.0, analog=True, output="zpk", norm="mag")
    omega = 2.0 * np.pi * frequency_hz
    swing = omega * np.sqrt(complex(1.0 - 1.0 / (4.0 * quality**2)))
    damping = omega / (2.0 * quality)
    poles = np.append(poles, [-damping + 1j * swing, -damping - 1j * swing])
    times_s = np.linspace(0.0, 1.0, 40) ** 1.6 * 9e-3
    left = STEP_PX * remaining_step(poles, times_s)
    left = left + np.random.default_rng(4).normal(0.0, noise_px, len(left))
    return StepTrace(times_us=tuple((1e6 * times_s).tolist()), left_px=tuple(left.tolist()))


@pytest.mark.parametrize(("frequency_hz", "quality"), [(900.0, 15.0), (2000.0, 2.0), (600.0, 60.0)])
def test_a_resonance_is_found(frequency_hz: float, quality: float) -> None:
    trace = rung(frequency_hz, quality)
    found, _ = fit_resonance(trace, step_px=STEP_PX, cutoff_hz=1000, exposure_us=1.0, noise_px=0.1)
    assert found is not None
    assert found.frequency_hz == pytest.approx(frequency_hz, rel=0.02)
    assert found.quality == pytest.approx(quality, rel=0.1)


def test_pictures_taken_for_another_one_do_not_matter() -> None:
    trace = rung(900.0, 15.0)
    left = [px + (290.0 if k % 5 == 2 else 0.0) for k, px in enumerate(trace.left_px)]
    trace = replace(trace, left_px=tuple(left))
    found, _ = fit_resonance(trace, step_px=STEP_PX, cutoff_hz=1000, exposure_us=1.0, noise_px=0.1)
    assert found is not None
    assert found.frequency_hz == pytest.approx(900.0, rel=0.02)


@pytest.mark.parametrize(
    ("frequency_hz", "quality", "cause"),
    [(30_000.0, 2.0, "the drive filter alone"), (900.0, 0.6, "does not ring")],
    ids=["stiff", "damped"],
)
def test_a_mirror_that_does_not_ring_is_said_not_to_be_resolvable(
    frequency_hz: float, quality: float, cause: str
) -> None:
    trace = rung(frequency_hz, quality)
    found, why = fit_resonance(trace, step_px=STEP_PX, cutoff_hz=1000, exposure_us=1.0, noise_px=0.1)
    assert found is None
    assert why.startswith("not resolvable")
    assert cause in why


GRAIN_PX = 512


@cache
def grain() -> NDArray[np.float32]:
    """Return the noise of a sensor; every picture takes it from another place."""
    size = (1080 + GRAIN_PX, 1440 + GRAIN_PX)
    return np.float32(2.0) * np.random.default_rng(10).standard_normal(size, dtype=np.float32)


@dataclass
class SpringHead:
    """Looks at a painted wall through mirrors that come to rest exponentially, 30 px a volt."""

    clock: VirtualClock = field(default_factory=VirtualClock)
    contrast: float = 1.0
    dead: frozenset[tuple[Role, str]] = frozenset()
    fails_after: int = 10_000
    exposures: list[tuple[int, float]] = field(default_factory=list)
    cutoffs_hz: list[int] = field(default_factory=lambda: [120])
    looks: int = 0

    def __post_init__(self) -> None:
        wall = (128.0 + self.contrast * (noise_texture() - 128.0)).astype(np.float32)
        self._wall = np.pad(wall, ((0, 512), (0, 1024)), mode="wrap")  # as far as it is seen
        self._at = np.zeros(4)
        self._rng = np.random.default_rng(9)

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        self.looks += 1
        if self.looks > self.fails_after:
            raise DeviceFault("cable pulled")
        target = np.array([volts.left.x_v, volts.left.y_v, volts.right.x_v, volts.right.y_v])
        changed = bool(np.any(target != self._at))
        settle_us = 14_000 if options.settle_us is None else options.settle_us
        delay_s = settle_us * 1e-6 if changed else 1.0
        seen = target + (self._at - target) * math.exp(-RATE_PER_S * (delay_s + 25e-6))
        self._at = target
        self.clock.sleep_until_ns(self.clock.now_ns() + round(1e9 * delay_s) + 5_000_000)
        left, right = (self._fovea(role, seen[k : k + 2]) for role, k in ((Role.LEFT, 0), (Role.RIGHT, 2)))
        return Sighting(left=left, right=right, wide=left, volts=volts)

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        raise NotImplementedError("nobody asks for it")

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        self.exposures.append((exposure_ns, gain_db))

    def set_low_pass(self, cutoff_hz: int) -> int:
        self.cutoffs_hz.append(cutoff_hz)
        return self.cutoffs_hz[-2]

    def _fovea(self, role: Role, volts_v: NDArray[np.float64]) -> Frame:
        x, y = (0.0 if (role, axis) in self.dead else float(v) for axis, v in zip("xy", volts_v, strict=True))
        matrix = np.array([[1.0, 0.0, 900.0 + 30.0 * x], [0.0, 1.0, 900.0 + 30.0 * y]])
        size = (1440, 1080)
        flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        wall = cv2.warpAffine(self._wall, matrix, size, flags=flags, borderMode=cv2.BORDER_WRAP)
        x0, y0 = self._rng.integers(0, GRAIN_PX, 2)
        noise = grain()[y0 : y0 + wall.shape[0], x0 : x0 + wall.shape[1]]
        exposure_ns = self.exposures[-1][0] if self.exposures else NORMAL.exposure_ns
        return Frame(
            image=np.asarray(cv2.add(wall, noise, dtype=cv2.CV_8U), dtype=np.uint8),
            role=role,
            seq=self.looks,
            t_ns=self.clock.now_ns(),
            exposure_ns=exposure_ns,
        )


def measure(head: SpringHead, settings: SettleSettings = QUICK) -> SettleReport:
    return characterise_settling(
        head,
        clock=head.clock,
        rig_id="spring",
        created_utc="2026-02-01T00:00:00+00:00",
        settings=settings,
        before=NORMAL,
    )


@pytest.fixture(scope="module")
def head() -> SpringHead:
    return SpringHead()


@pytest.fixture(scope="module")
def report(head: SpringHead) -> SettleReport:
    return measure(head)


def test_every_axis_settles_when_its_mirror_does(report: SettleReport) -> None:
    assert len(report.axes) == 4
    for found in report.axes:
        assert found.step_px == pytest.approx(17.0 * 30.0, rel=0.002)
        assert found.settle_us == pytest.approx(1e6 / RATE_PER_S * math.log(found.step_px), abs=150.0)
        assert found.settle_share_us == pytest.approx(1e6 / RATE_PER_S * math.log(100.0), abs=150.0)


def test_a_larger_step_takes_as_much_longer_as_it_should(report: SettleReport) -> None:
    ten_times = max(found.settle_for_us(10.0 * 510.0, within_px=1.0) for found in report.axes)
    assert ten_times == pytest.approx(1e6 / RATE_PER_S * math.log(5100.0), rel=0.05)


def test_a_mirror_without_a_swing_of_its_own_has_no_resonance(report: SettleReport) -> None:
    assert all(found.resonance is None for found in report.axes)
    assert all("does not ring" in found.ringing for found in report.axes)


def test_a_report_survives_its_file(report: SettleReport, tmp_path: Path) -> None:
    save_settle(report, tmp_path / "settle.json")
    assert load_settle(tmp_path / "settle.json") == report


def test_a_file_that_was_cut_off_is_refused(report: SettleReport, tmp_path: Path) -> None:
    path = tmp_path / "settle.json"
    save_settle(report, path)
    path.write_text(path.read_text()[:-40])
    with pytest.raises(InvalidInput, match="measure how the mirrors settle again"):
        load_settle(path)


def test_the_report_is_drawn(report: SettleReport) -> None:
    assert settle_picture(report).startswith(b"\x89PNG")


@pytest.mark.usefixtures("report")
def test_exposure_and_filter_are_put_back(head: SpringHead) -> None:
    assert head.exposures == [(QUICK.exposure_ns, QUICK.gain_db), (NORMAL.exposure_ns, NORMAL.gain_db)]
    assert head.cutoffs_hz == [120, 1000, 120]


@pytest.mark.parametrize(("fails_after", "cutoffs_hz"), [(12, [120]), (22, [120, 1000, 120])])
def test_exposure_and_filter_are_put_back_after_a_failure(fails_after: int, cutoffs_hz: list[int]) -> None:
    head = SpringHead(fails_after=fails_after)
    with pytest.raises(DeviceFault, match="cable pulled"):
        measure(head, replace(FEW, axes=("x",)))
    assert head.exposures[-1] == (NORMAL.exposure_ns, NORMAL.gain_db)
    assert head.cutoffs_hz == cutoffs_hz


def test_a_dead_axis_is_named() -> None:
    with pytest.raises(DeviceFault, match="right eye, y axis"):
        measure(SpringHead(dead=frozenset({(Role.RIGHT, "y")})), FEW)


def test_a_bare_wall_is_refused() -> None:
    with pytest.raises(DeviceFault, match="textured"):
        measure(SpringHead(contrast=0.0), FEW)


def test_it_can_be_cancelled() -> None:
    class Impatient(SilentWatcher):
        def cancelled(self) -> bool:
            return True

    head = SpringHead()
    with pytest.raises(Cancelled):
        characterise_settling(
            head, clock=head.clock, rig_id="spring", created_utc="", watch=Impatient(), before=NORMAL
        )
    assert head.exposures[-1] == (NORMAL.exposure_ns, NORMAL.gain_db)


@pytest.mark.parametrize("binning", [1, 2])
@pytest.mark.parametrize("shift_px", [(0.0, 0.0), (0.37, -0.62), (7.3, 2.1), (-180.4, 3.3), (240.2, -20.9)])
def test_a_shift_is_found_to_a_fraction_of_a_pixel(shift_px: tuple[float, float], binning: Binning) -> None:
    rng = np.random.default_rng(6)
    wall = cv2.GaussianBlur(noise_texture(), (0, 0), 1.4)  # a fovea's diffraction

    def picture(x_px: float, y_px: float) -> NDArray[np.uint8]:
        matrix = np.array([[1.0, 0.0, 300.0 - x_px], [0.0, 1.0, 300.0 - y_px]])
        flags = cv2.INTER_LANCZOS4 | cv2.WARP_INVERSE_MAP
        view = cv2.warpAffine(wall, matrix, (1440, 1080), flags=flags, borderMode=cv2.BORDER_WRAP)
        noisy = np.clip(view + rng.normal(0.0, 6.0, view.shape), 0, 255)
        size = (1440 // binning, 1080 // binning)
        return np.asarray(cv2.resize(noisy, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)

    reference = SettledPicture(picture(0.0, 0.0), towards_px=np.array([260.0, 0.0]), binning=binning)
    found = reference.shift(picture(*shift_px))
    assert found.seen
    assert (found.x_px, found.y_px) == pytest.approx(shift_px, abs=0.05)


def test_half_of_a_step_is_done_when_the_mirror_has_gone_half_the_way(report: SettleReport) -> None:
    assert len(report.axes) == 4
    for found in report.axes:
        assert found.response_us == pytest.approx(1e6 / RATE_PER_S * math.log(2.0), abs=150.0)
        assert 0.0 < found.response_open_us <= found.response_us + 150.0
