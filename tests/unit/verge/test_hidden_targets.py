"""Targets that an eye cannot see or that something covers, and depths that are known before."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.plane_head import CALIBRATION, TEXEL_M, TILE, PlaneHead, Texture, noise_texture

from foveacam_hardware.contract import Frame, LookOptions, Role, Sighting, StereoVolts, VirtualClock
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge import closed_loop, fallback
from foveacam_pipeline.verge.fixate import PriorKnowledge, fixate
from foveacam_pipeline.verge.looking.fixation_head import Observation
from foveacam_pipeline.verge.matching.centre_match import CentreMatch
from foveacam_pipeline.verge.matching.fine import FineMatch
from foveacam_pipeline.verge.matching.support import MatchSupport, SupportReport
from foveacam_pipeline.verge.matching.wide_patch import WidePatch
from foveacam_pipeline.verge.measure import Measurement, measure
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.single_eye.search import OwnSide, SingleEyeSearch
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.verge.surroundings.estimator import SurroundingsEstimator
from foveacam_pipeline.verge.surroundings.infer import InferredDepth
from foveacam_pipeline.verge.values import Basis, Fixation, FixationState, PixelTarget, VergePhase

pytestmark = pytest.mark.slow

Z_M = 6.0
CLICK = PixelTarget(x_px=850.3, y_px=420.7)


def fix(*blind: Role, known: PriorKnowledge) -> Fixation:
    head = PlaneHead(z_m=Z_M, texture=noise_texture(), blind=frozenset(blind))
    return fixate(head, head.calibration, CLICK, clock=head.clock, known=known)


@dataclass(frozen=True)
class TwoSurfaces:
    """A context in which one surface ends and another begins at every direction that is asked for."""

    left_per_m: float
    right_per_m: float

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        beside = np.array([(x, y) for x in (-0.004, -0.002, 0.002, 0.004) for y in (-0.003, 0.0, 0.003)])
        within = beside[np.hypot(*beside.T) <= reach_tan]
        return DepthSamples(
            tangents=target + within,
            inverse_z_per_m=np.where(within[:, 0] < 0.0, self.left_per_m, self.right_per_m),
            sigma_per_m=np.full(len(within), 1e-3),
        )


def test_a_target_that_neither_eye_shows_may_have_none_of_the_depths_listed() -> None:
    found = fix(Role.LEFT, Role.RIGHT, known=PriorKnowledge(context=TwoSurfaces(1.0 / Z_M, 0.3)))
    assert found.basis is Basis.SURROUNDINGS, found.reason
    assert len(found.alternatives) == 2
    chance = sum(one.probability for one in found.alternatives)
    assert chance == pytest.approx(154 / 207, abs=0.02)  # as often was one of them right


def test_a_depth_by_one_eye_that_nothing_confirms_is_listed_with_the_surfaces_about_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    behind, before = (
        InferredDepth(
            inverse_z_per_m=q, sigma_per_m=1e-3, probability=0.5, samples=3, owned=False, held=False
        )
        for q in (1.0 / Z_M, 0.3)
    )
    monkeypatch.setattr(SurroundingsEstimator, "peek", lambda *_given: (behind, before))
    found = fix(Role.LEFT, known=PriorKnowledge())
    assert found.basis is Basis.FOVEA_AND_WIDE, found.reason
    own, other = found.alternatives
    assert (own.basis, other.basis) == (Basis.FOVEA_AND_WIDE, Basis.SURROUNDINGS)
    assert own.distance_m == pytest.approx(found.distance_m)
    assert other.distance_m == pytest.approx(own.distance_m / (0.3 * Z_M), rel=0.01)
    assert own.probability == pytest.approx(68 / 87, abs=0.03)  # as often was it right
    assert own.probability + other.probability == pytest.approx(1.0)


@dataclass(frozen=True)
class Beside:
    """A context that knows one depth next to a direction, and another one farther from it."""

    next_per_m: float
    far_per_m: float

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        return DepthSamples(
            tangents=target + reach_tan * np.array([[0.9, 0.0], [0.1, 0.0], [0.0, -0.8]]),
            inverse_z_per_m=np.array([self.far_per_m, self.next_per_m, self.far_per_m]),
            sigma_per_m=np.full(3, 1e-3),
        )


@pytest.mark.parametrize(("sides_m", "sure"), [(Z_M, True), (None, False)])
def test_a_depth_by_one_eye_is_sure_where_the_own_side_of_an_edge_is_as_deep(
    monkeypatch: pytest.MonkeyPatch, sides_m: float | None, sure: bool
) -> None:
    """What lies beyond an edge cannot have been taken for the target then."""
    roles = frozenset({Role.RIGHT})
    own = None if sides_m is None else OwnSide(roles=roles, inverse_z_per_m=1.0 / sides_m, sigma_per_m=1e-3)
    monkeypatch.setattr(SingleEyeSearch, "on_own_side", lambda *_given, **_named: own)
    monkeypatch.setattr(SurroundingsEstimator, "peek", lambda *_given: ())
    monkeypatch.setattr(fallback, "confirmed", lambda *_given, **_named: False)
    found = fix(Role.LEFT, known=PriorKnowledge())
    assert found.basis is Basis.FOVEA_AND_WIDE, found.reason
    assert found.distance_m is not None and found.distance_sigma_m is not None
    assert (found.distance_sigma_m < 0.02 * found.distance_m) is sure


def test_the_first_look_is_at_the_depth_of_the_nearest_known_point() -> None:
    expected = fix(known=PriorKnowledge(context=Beside(1.0 / Z_M, 0.5)))
    assert expected.state is FixationState.VERGED, expected.reason
    first = expected.steps[0]
    assert first.residual_x_px is not None and abs(first.residual_x_px) < 20.0
    assert first.left_ax_rad - first.right_ax_rad == pytest.approx(0.2 / Z_M, rel=0.02)


GONE_NS = 350_000_000
"""When the cover is gone: both eyes have verged on it by then."""


@dataclass
class CoveredHead:
    """A head before one plane, until some time before a nearer one."""

    far: PlaneHead
    near: PlaneHead

    def _shown(self) -> PlaneHead:
        return self.near if self.far.clock.now_ns() < GONE_NS else self.far

    def wide(self, *, max_age_ms: float = 200.0) -> Frame:
        return self._shown().wide()

    def look(self, volts: StereoVolts, *, options: LookOptions = LookOptions()) -> Sighting:
        return self._shown().look(volts)

    def expose_foveae(self, *, exposure_ns: int, gain_db: float) -> None:
        raise NotImplementedError("a painted head has no exposure")

    def set_low_pass(self, cutoff_hz: int) -> int:
        raise NotImplementedError("a painted head has no filter")


def _alike(texture: Texture) -> Texture:
    """Return a texture that at half the distance correlates by 0.6 with the given one."""
    same = np.tile(texture[::2, ::2], (2, 2)) - 128.0
    return np.asarray(128.0 + 0.6 * same + 0.8 * (noise_texture(8) - 128.0), dtype=np.float32)


def test_what_covers_a_target_for_a_moment_is_not_measured_in_its_place() -> None:
    clock, texture = VirtualClock(), noise_texture()
    head = CoveredHead(
        far=PlaneHead(z_m=Z_M, texture=texture, clock=clock),
        near=PlaneHead(z_m=Z_M / 2.0, texture=_alike(texture), clock=clock),
    )
    clicked = head.far.wide()
    clock.sleep_until_ns(100_000_000)
    found = fixate(head, head.far.calibration, CLICK, clock=clock, clicked=clicked)
    assert found.state is FixationState.VERGED, found.reason
    assert found.point_rig_m is not None
    assert found.point_rig_m[2] == pytest.approx(Z_M, rel=0.005)


def _found_with(monkeypatch: pytest.MonkeyPatch, change: Callable[[FineMatch], FineMatch]) -> Fixation:
    """Fixate with every left-right match changed."""

    def changed(
        observation: Observation,
        templates: tuple[WidePatch, ...],
        target: NDArray[np.float64],
        *,
        calibration: Calibration,
        limits: VergeSettings,
    ) -> Measurement:
        found = measure(observation, templates, target, calibration=calibration, limits=limits)
        return replace(found, fine=change(found.fine))

    monkeypatch.setattr(closed_loop, "measure", changed)
    return fix(known=PriorKnowledge())


def test_a_match_that_lies_higher_in_one_eye_is_not_of_one_point(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _found_with(monkeypatch, lambda fine: replace(fine, residual_y_px=1.5, sigma_y_px=1.0))
    assert found.state is FixationState.LOST
    assert found.basis is not Basis.BOTH_FOVEAE


@pytest.mark.parametrize(("sigma_px", "settles"), [(0.7, True), (0.3, False)])
def test_a_residual_within_the_error_of_its_match_is_not_looked_at_again(
    monkeypatch: pytest.MonkeyPatch, sigma_px: float, settles: bool
) -> None:
    found = _found_with(
        monkeypatch, lambda fine: replace(fine, score=0.95, residual_x_px=1.2, sigma_x_px=sigma_px)
    )
    assert (found.basis is Basis.BOTH_FOVEAE and len(found.steps) <= 3) is settles, found.reason


@pytest.mark.parametrize(
    ("leads", "sectors", "alike"),
    [
        ((0.05, 0.0), 7, False),
        ((0.0, 0.15), 7, True),
        ((0.0, 0.15), 8, False),
        ((0.007, 0.008), 7, False),
        ((0.03, 0.03), 7, True),
        ((0.03, 0.03), 8, True),
    ],
)
def test_a_look_alike_leads_far_in_one_eye_or_a_little_in_both(
    monkeypatch: pytest.MonkeyPatch, leads: tuple[float, float], sectors: int, alike: bool
) -> None:
    """In one eye alone it does not count where the foveae show the same all around the point."""
    matches = tuple(CentreMatch(here=0.8, best=0.8 + lead, aside_wide_px=20.0) for lead in leads)
    monkeypatch.setattr(closed_loop, "match_centres", lambda *_given, **_named: matches)
    report = SupportReport(support=MatchSupport.MATCHED, sectors=sectors, alike_offset_px=(0.0, 0.0))
    monkeypatch.setattr(closed_loop, "support_of", lambda *_given, **_named: report)
    found = fix(known=PriorKnowledge())
    assert (found.state is FixationState.VERGED) is not alike, found.reason


def _blank_about_click(half_m: float, *, z_m: float) -> Texture:
    """Return texture with a blank square about the clicked place of a plane."""
    middle = np.tan(CALIBRATION.wide.angles_rad([[CLICK.x_px, CLICK.y_px]])[0]) * z_m / TEXEL_M
    across, down = (np.mod(np.arange(TILE) - at + TILE / 2, TILE) - TILE / 2 for at in middle)
    blank = (np.abs(across)[None, :] < half_m / TEXEL_M) & (np.abs(down)[:, None] < half_m / TEXEL_M)
    return np.where(blank, np.float32(170.0), noise_texture())


@dataclass(frozen=True)
class LeftOfTarget:
    """A context that knows four points of a surface, all to the left of every direction."""

    per_m: float

    def around(self, target: NDArray[np.float64], *, reach_tan: float) -> DepthSamples:
        beside = np.array([[-0.002, 0.0], [-0.003, 0.002], [-0.003, -0.002], [-0.004, 0.001]])
        return DepthSamples(
            tangents=target + beside, inverse_z_per_m=np.full(4, self.per_m), sigma_per_m=np.full(4, 2e-4)
        )


def test_a_blank_surface_is_looked_at_on_the_side_where_nothing_of_it_is_known() -> None:
    z_m = 4.0
    head = PlaneHead(z_m=z_m, texture=_blank_about_click(0.168, z_m=z_m))
    known = PriorKnowledge(context=LeftOfTarget(1.0 / z_m))
    found = fixate(head, head.calibration, CLICK, clock=head.clock, known=known)
    assert found.basis is Basis.SURROUNDINGS, found.reason
    assert found.distance_m == pytest.approx(z_m, rel=0.01)
    aside_rad = [
        (step.left_ax_rad + step.right_ax_rad) / 2.0 - found.target_ax_rad
        for step in found.steps
        if step.phase is VergePhase.SURROUNDINGS
    ]
    assert aside_rad and max(aside_rad) > 0.03  # the surface ends 0.042 to the right
