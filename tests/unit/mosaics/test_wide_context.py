"""The wide context keeps depths on a grid, fuses them, lets them age and forgets what has changed."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_pipeline.models.intrinsics import Intrinsics
from foveacam_pipeline.verge.surroundings.depth_samples import DepthSamples
from foveacam_pipeline.wide_depth.context_file import ContextIdentity, load_context, save_context
from foveacam_pipeline.wide_depth.values import AgeingModel, DepthSource
from foveacam_pipeline.wide_depth.wide_context import FORGET_AFTER_S, WideContext

WIDE = Intrinsics(width=200, height=161, fx_px=500.0, fy_px=500.0, cx_px=99.5, cy_px=80.0)
CENTRE = np.array([0.0, 0.0])
ROOM = ContextIdentity(rig_id="sim", calibration_id="cal-1", pose="")


class Watch:
    """A wall clock set by hand."""

    now_s = 1_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.fixture
def context(watch: Watch) -> WideContext:
    return WideContext(WIDE, now_s=watch)


def _points(q: list[float], sigma: float, at: tuple[float, float] = (0.0, 0.0)) -> DepthSamples:
    n = len(q)
    return DepthSamples(
        tangents=np.tile(np.array(at), (n, 1)), inverse_z_per_m=np.array(q), sigma_per_m=np.full(n, sigma)
    )


def _everywhere(z_m: float, *, sigma: float = 1e-4) -> DepthSamples:
    x, y = np.meshgrid(np.arange(2.0, 200.0, 4.0), np.arange(2.0, 161.0, 4.0))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    tangents = np.tan(WIDE.angles_rad(pixels))
    return DepthSamples(
        tangents=tangents,
        inverse_z_per_m=np.full(len(tangents), 1.0 / z_m),
        sigma_per_m=np.full(len(tangents), sigma),
    )


def _picture(seed: int, *, gain: float = 1.0) -> NDArray[np.uint8]:
    texture = np.random.default_rng(5).uniform(60.0, 160.0, (21, 25)).repeat(8, axis=0).repeat(8, axis=1)
    light = gain * texture[:161, :200]
    noisy = light + np.random.default_rng(seed).normal(0.0, np.sqrt(0.02 * light))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def test_a_point_is_found_about_its_direction_alone(context: WideContext) -> None:
    context.fuse(_points([0.1], 1e-3), source=DepthSource.FIXATION)
    found = context.around(CENTRE, reach_tan=0.01)
    assert found.inverse_z_per_m.tolist() == pytest.approx([0.1])
    assert found.sigma_per_m.tolist() == pytest.approx([1e-3])
    assert len(context.around(np.array([0.05, 0.0]), reach_tan=0.01)) == 0


def test_points_outside_the_wide_image_are_left_out(context: WideContext) -> None:
    assert context.fuse(_points([0.1], 1e-3, at=(0.3, 0.0)), source=DepthSource.FIXATION) == 0
    assert len(context.samples()) == 0


def test_consistent_depths_are_weighted_by_their_variance(context: WideContext) -> None:
    context.fuse(_points([0.100], 1e-3), source=DepthSource.FIXATION)
    context.fuse(_points([0.101], 2e-3), source=DepthSource.FIXATION)
    found = context.around(CENTRE, reach_tan=0.01)
    assert found.inverse_z_per_m.tolist() == pytest.approx([0.8 * 0.100 + 0.2 * 0.101])
    assert found.sigma_per_m.tolist() == pytest.approx([0.8 * 1e-3 + 0.2 * 2e-3])


def test_a_contradicting_point_keeps_the_older_surface_beside_it(context: WideContext) -> None:
    context.fuse(_points([0.10], 1e-4), source=DepthSource.FIXATION)
    context.fuse(_points([0.20], 1e-4), source=DepthSource.FIXATION)
    assert context.snapshot().inverse_z_per_m[:, 10, 12].tolist() == pytest.approx([0.20, 0.10])
    context.fuse(_points([0.10], 1e-4), source=DepthSource.FIXATION)
    assert context.snapshot().inverse_z_per_m[:, 10, 12].tolist() == pytest.approx([0.10, 0.20])


def test_a_much_weaker_contradiction_does_not_take_over(context: WideContext) -> None:
    context.fuse(_points([0.10], 1e-4), source=DepthSource.FIXATION)
    context.fuse(_points([0.20], 5e-3), source=DepthSource.WIDE_MATCH)
    assert context.snapshot().inverse_z_per_m[:, 10, 12].tolist() == pytest.approx([0.10, 0.20])


def test_dense_depth_replaces_what_it_contradicts(context: WideContext) -> None:
    context.fuse(_points([0.10], 1e-4), source=DepthSource.FIXATION)
    context.fuse(_points([0.20] * 20, 1e-4), source=DepthSource.DENSE_DEPTH)
    assert context.around(CENTRE, reach_tan=0.01).inverse_z_per_m.tolist() == pytest.approx([0.20])


def test_a_cell_on_an_edge_holds_both_surfaces_and_no_mean_of_them(context: WideContext) -> None:
    near, far = [0.20] * 30, [0.10] * 50
    context.fuse(_points([*near, *far], 1e-4), source=DepthSource.DENSE_DEPTH)
    assert context.snapshot().inverse_z_per_m[:, 10, 12].tolist() == pytest.approx([0.10, 0.20])


def test_a_few_mismatches_make_no_surface(context: WideContext) -> None:
    context.fuse(_points([0.30, 0.31] + [0.10] * 50, 1e-4), source=DepthSource.DENSE_DEPTH)
    assert context.around(CENTRE, reach_tan=0.01).inverse_z_per_m.tolist() == pytest.approx([0.10])


def test_the_error_of_a_cell_is_that_of_its_middle_point(context: WideContext) -> None:
    points = DepthSamples(
        tangents=np.zeros((5, 2)),
        inverse_z_per_m=np.full(5, 0.1),
        sigma_per_m=1e-4 * np.array([5, 1, 3, 2, 9]),
    )
    context.fuse(points, source=DepthSource.DENSE_DEPTH)
    assert context.samples().sigma_per_m.tolist() == pytest.approx([3e-4])


def test_the_error_grows_with_age(context: WideContext, watch: Watch) -> None:
    context.fuse(_points([0.10], 1e-4), source=DepthSource.FIXATION)
    watch.now_s += 2 * 3600.0
    ageing = AgeingModel()
    grown = 2.0 * np.hypot(ageing.drift_per_m_per_hour, ageing.relative_per_hour * 0.10)
    expected = np.hypot(1e-4, grown)
    assert context.samples().sigma_per_m.tolist() == pytest.approx([expected])


def test_an_unchanged_scene_keeps_its_depth_through_noise_and_dimming(
    context: WideContext, watch: Watch
) -> None:
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=_picture(1))
    before = len(context.samples())
    for seed in range(2, 12):
        watch.now_s += 1.0
        assert context.detect_changes(_picture(seed, gain=0.9)) == 0
    assert len(context.samples()) == before == 25 * 20


def _fine_texture(*, binning: int) -> NDArray[np.uint8]:
    """Return a picture with stripes finer than a binned px on its right, sampled and not averaged."""
    y, x = np.mgrid[0:161:binning, 0:200:binning]
    stripes = np.where((x + y) % 4 < 2, 60, 160)
    return np.where(x < 130, 100, stripes).astype(np.uint8)[: 161 // binning, : 200 // binning]


@pytest.mark.parametrize("before", [1, 2])
def test_fine_texture_keeps_its_depth_while_pictures_of_another_binning_come(
    context: WideContext, watch: Watch, before: int
) -> None:
    meanwhile = 3 - before
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=_fine_texture(binning=before))
    known = len(context.samples())
    for binning in (meanwhile, meanwhile, before):
        watch.now_s += FORGET_AFTER_S + 0.1
        assert context.detect_changes(_fine_texture(binning=binning)) == 0
        assert len(context.samples()) == known
    changed = _fine_texture(binning=meanwhile)
    part = np.s_[64 // meanwhile : 96 // meanwhile, 144 // meanwhile : 184 // meanwhile]
    changed[part] = 30
    context.detect_changes(changed)
    assert len(context.samples()) < known  # a change is seen at either
    watch.now_s += FORGET_AFTER_S + 0.1
    assert context.detect_changes(changed) > 0


def test_what_changed_is_withheld_at_once_and_forgotten_later(context: WideContext, watch: Watch) -> None:
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=_picture(1))
    changed = _picture(2)
    changed[64:96, 80:120] = 255 - changed[64:96, 80:120]
    assert context.detect_changes(changed) == 0
    assert len(context.around(CENTRE, reach_tan=0.02)) == 0
    assert len(context.around(np.array([-0.15, 0.0]), reach_tan=0.02)) > 0
    watch.now_s += FORGET_AFTER_S + 0.1
    assert context.detect_changes(changed) > 0
    assert context.detect_changes(_picture(3)) == 0
    assert len(context.around(CENTRE, reach_tan=0.02)) == 0


def test_what_somebody_crossed_comes_back(context: WideContext, watch: Watch) -> None:
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=_picture(1))
    crossed = _picture(2)
    crossed[64:96, 80:120] = 10
    context.detect_changes(crossed)
    watch.now_s += 2.0
    context.detect_changes(_picture(3))
    assert len(context.samples()) == 25 * 20


def test_a_scene_that_changed_altogether_is_forgotten_with_its_blank_parts(
    context: WideContext, watch: Watch
) -> None:
    reference, moved = _picture(1), np.roll(_picture(2), 20, axis=1)
    reference[:, 160:] = moved[:, 160:] = 100  # a blank wall looks the same after the move
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=reference)
    context.detect_changes(moved)
    watch.now_s += FORGET_AFTER_S + 0.1
    context.detect_changes(moved)
    assert len(context.samples()) == 0


def test_a_stored_context_comes_back_with_its_age(context: WideContext, watch: Watch, tmp_path: Path) -> None:
    context.fuse(_everywhere(5.0), source=DepthSource.DENSE_DEPTH, gray=_picture(1))
    save_context(context, tmp_path / "context.npz", of=ROOM)
    watch.now_s += 3600.0
    restored = WideContext(WIDE, now_s=watch)
    assert load_context(restored, tmp_path / "context.npz", of=ROOM)
    np.testing.assert_array_equal(restored.samples().sigma_per_m, context.samples().sigma_per_m)
    np.testing.assert_array_equal(restored.samples().tangents, context.samples().tangents)
    (binning, reference), (stored_binning, stored) = restored.reference(), context.reference()
    assert binning == stored_binning
    np.testing.assert_array_equal(reference, stored)


def test_a_stored_context_of_another_calibration_or_grid_is_not_taken(
    context: WideContext, tmp_path: Path
) -> None:
    context.fuse(_points([0.1], 1e-3), source=DepthSource.FIXATION)
    path = tmp_path / "context.npz"
    save_context(context, path, of=ROOM)
    other = ContextIdentity(rig_id="sim", calibration_id="cal-2", pose="")
    assert not load_context(WideContext(WIDE), path, of=other)
    assert not load_context(WideContext(WIDE, cell_px=16), path, of=ROOM)
    context.clear()
    assert load_context(context, path, of=ROOM)
    assert len(context.samples()) == 1


def test_a_file_of_another_kind_is_refused_in_words(context: WideContext, tmp_path: Path) -> None:
    path = tmp_path / "context.npz"
    np.savez(path, something=np.zeros(3))
    with pytest.raises(ValueError, match="version 1 is needed"):
        load_context(context, path, of=ROOM)
