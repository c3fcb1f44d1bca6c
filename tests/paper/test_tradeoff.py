"""Sec. 4.2: scenes whose truth holds, scores by depth, the ratio T in both readings, and the study of it."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from foveacam_hardware.contract import Cancelled, InvalidInput
from foveacam_pipeline.stereo.values import RectifiedPair
from foveacam_pipeline.study.report.findings import StudyResult
from foveacam_pipeline.study.tradeoff import study as tradeoff_study_module
from foveacam_pipeline.study.tradeoff.depth_metrics import (
    BinScores,
    DepthMetric,
    bin_scores,
    depth_bins,
    gains,
    tradeoff,
)
from foveacam_pipeline.study.tradeoff.outcomes import SceneOutcome, SemiGlobal, StereoView, scene_outcomes
from foveacam_pipeline.study.tradeoff.patches import PatchChoice, PictureSize, budget
from foveacam_pipeline.study.tradeoff.ray_caster import LATTICE, PinholeCamera, RectangleFace, render_view
from foveacam_pipeline.study.tradeoff.rig_pairs import RigPairScene, rig_outcome
from foveacam_pipeline.study.tradeoff.streets import CAMERA, FARTHEST_M, StereoScene, street
from foveacam_pipeline.study.tradeoff.study import tradeoff_study
from foveacam_pipeline.study.tradeoff.sweep import BudgetPoint, crossings

NATIVE = PictureSize(width=CAMERA.width, height=CAMERA.height)


@pytest.fixture(scope="module")
def scene() -> StereoScene:
    return street(0)


def test_a_street_is_the_same_whenever_it_is_asked_for() -> None:
    small = replace(CAMERA, f_px=145.0, cx_px=124.0, cy_px=37.0, width=248, height=75)
    first, again, other = (street(seed, camera=small) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first.left, again.left)
    np.testing.assert_array_equal(first.truth_z_m, again.truth_z_m)
    assert (first.left != other.left).mean() > 0.5


def test_the_truth_of_a_street_moves_the_right_image_onto_the_left(scene: StereoScene) -> None:
    known = np.isfinite(scene.truth_z_m) & scene.seen
    disparity = scene.f_px * scene.baseline_m / scene.truth_z_m
    columns = np.arange(disparity.shape[1])[None, :]
    at = np.where(known, columns - disparity, 0.0).astype(np.float32)
    rows = np.repeat(np.arange(len(at), dtype=np.float32)[:, None], at.shape[1], axis=1)
    moved = cv2.remap(scene.right, at, rows, cv2.INTER_LINEAR)
    off = np.abs(moved.astype(float) - scene.left)[known]
    assert np.median(off) <= 3.0  # noise of 1.5 grey levels in each, and interpolation
    unmoved = np.abs(scene.right.astype(float) - scene.left)[known]
    assert np.median(unmoved) > 3.0 * np.median(off)


def test_a_street_has_near_ground_and_far_houses(scene: StereoScene) -> None:
    known_m = scene.truth_z_m[np.isfinite(scene.truth_z_m)]
    assert known_m.min() < 9.0
    assert 80.0 < known_m.max() <= FARTHEST_M
    assert 0.7 < (np.isfinite(scene.truth_z_m) & scene.seen).mean() < 0.95


def test_the_depth_of_a_face_is_its_own() -> None:
    camera = PinholeCamera(f_px=100.0, cx_px=50.0, cy_px=20.0, width=100, height=40)
    wall = RectangleFace(axis=2, low_m=(-1.0, -1.0, 10.0), high_m=(1.0, 1.0, 10.0))
    ground = RectangleFace(axis=1, low_m=(-9.0, 1.5, 1.0), high_m=(9.0, 1.5, 300.0))
    side = RectangleFace(axis=0, low_m=(3.0, -5.0, 2.0), high_m=(3.0, 5.0, 200.0))
    z_m = render_view([wall, ground, side], camera, eye_x_m=0.5, lattice=np.zeros((LATTICE, LATTICE))).z_m
    assert z_m[20, 50] == 10.0
    assert z_m[35, 50] == pytest.approx(1.5 * 100.0 / 15.0)
    assert z_m[18, 90] == pytest.approx(2.5 * 100.0 / 40.0)  # 3 m aside of an eye that stands 0.5 m aside
    assert np.isinf(z_m[2, 40])


def test_a_scene_of_two_sizes_is_refused(scene: StereoScene) -> None:
    with pytest.raises(InvalidInput, match="street 0: its right image is uint8 of shape"):
        replace(scene, right=scene.right[:, :-1])
    with pytest.raises(InvalidInput, match="its mask is of shape"):
        replace(scene, seen=scene.seen[:-1])


def test_bins_hold_equally_many_pixels_from_near_to_far() -> None:
    truth_m = np.random.default_rng(2).uniform(5.0, 80.0, 5000)
    bin_of = depth_bins(truth_m)
    np.testing.assert_array_equal(np.bincount(bin_of), 500)
    assert truth_m[bin_of == 9].min() > truth_m[bin_of == 8].max()
    with pytest.raises(InvalidInput, match="9 pixels with true depth were found"):
        depth_bins(np.ones(9))


def test_scores_are_what_they_are_called() -> None:
    truth_m = np.array([10.0, 10.0, 40.0, 40.0])
    depth_m = np.array([11.0, 9.0, 52.0, 40.0])
    found = bin_scores(depth_m, truth_m, np.array([0, 0, 1, 1]), bins=3)
    np.testing.assert_allclose(found.absrel, [0.1, 0.15, np.nan])
    np.testing.assert_allclose(found.rmse, [1.0, math.sqrt(72.0), np.nan])
    np.testing.assert_allclose(found.delta1, [1.0, 0.5, np.nan])


def test_gains_are_positive_where_the_foveated_map_is_better() -> None:
    worse = BinScores(absrel=np.array([0.2]), rmse=np.array([2.0]), delta1=np.array([0.8]))
    better = BinScores(absrel=np.array([0.1]), rmse=np.array([1.5]), delta1=np.array([0.9]))
    assert [gains(better, worse, metric)[0] for metric in DepthMetric] == pytest.approx([0.1, 0.5, 0.1])


def test_the_ratio_has_two_readings() -> None:
    found = tradeoff(np.array([-0.01, -0.03, 0.0, np.nan, 0.05, 0.05, 0.05]))
    assert found.mean == pytest.approx(0.05 / 0.02)
    assert found.total == pytest.approx(0.15 / 0.04)
    assert tradeoff(np.array([0.1, 0.2])).mean == math.inf
    assert tradeoff(np.array([-0.1, 0.0])).total == 0.0


def test_crossings_are_found_between_budgets_even_from_an_infinite_ratio() -> None:
    assert crossings([0.1, 0.2, 0.4], [1.0, 3.0, 3.5], 2.0) == pytest.approx((0.1 * 2 ** (2 / 3),))
    (once,) = crossings([0.1, 0.2], [math.inf, 1.0], 3.0)
    assert once == pytest.approx(0.1 * 2**0.5)  # gains' parts: 1, then 1/2; 3/4 is half way
    assert crossings([0.1, 0.2], [0.5, 1.0], 2.0) == ()
    assert len(crossings([0.1, 0.2, 0.4], [1.0, 3.0, 0.5], 2.0)) == 2


def test_native_patches_mend_what_is_far(scene: StereoScene) -> None:
    found = scene_outcomes(scene, budget(NATIVE, 0.25, patches=4), SemiGlobal())
    for choice in PatchChoice:
        each = found[choice]
        assert each.coverage[-1] > 0.25
        assert each.coverage[:5].max() < 0.02
        assert gains(each.fov, each.mr, DepthMetric.ABSREL)[-1] > 0.0
        assert np.all(np.diff(each.bin_depth_m) > 0.0)
    assert found[PatchChoice.TRUTH].coverage[-1] >= found[PatchChoice.ESTIMATE].coverage[-1]


def test_a_scene_without_truth_is_refused(scene: StereoScene) -> None:
    blank = replace(scene, seen=np.zeros_like(scene.seen))
    with pytest.raises(InvalidInput, match="street 0 has no pixel with a true depth"):
        scene_outcomes(blank, budget(NATIVE, 0.25, patches=4), SemiGlobal())


def rig_scene() -> RigPairScene:
    """A wall behind a box, by a wide pair and one verged fovea pair: the rig at a quarter of its size."""
    wide = PinholeCamera(f_px=788.0, cx_px=179.5, cy_px=134.5, width=360, height=270)
    zoom, baseline_m = 9.125, 0.2
    faces = [
        RectangleFace(axis=2, low_m=(-9.0, -9.0, 14.0), high_m=(9.0, 9.0, 14.0)),
        RectangleFace(axis=2, low_m=(-0.2, -0.2, 11.5), high_m=(0.6, 0.3, 11.5), level=90.0),
    ]
    lattice = np.random.default_rng(3).uniform(-1.0, 1.0, (LATTICE, LATTICE))
    pair = [render_view(faces, wide, eye_x_m=x_m, lattice=lattice) for x_m in (0.0, baseline_m)]
    f_px = zoom * wide.f_px
    offset_px = f_px * baseline_m / 12.0  # verged at 12 m
    u0_px, v0_px = -100.0 + offset_px / 2.0, -120.0
    windows = [
        render_view(
            faces,
            PinholeCamera(f_px=f_px, cx_px=-u0, cy_px=-v0_px, width=360, height=270),
            eye_x_m=x_m,
            lattice=lattice,
        ).image.astype(np.uint8)
        for x_m, u0 in ((0.0, u0_px), (baseline_m, u0_px - offset_px))
    ]
    everywhere = np.ones((270, 360), dtype=np.bool_)
    fovea = RectifiedPair(
        left=windows[0],
        right=windows[1],
        valid_left=everywhere,
        valid_right=everywhere,
        f_px=f_px,
        baseline_m=baseline_m,
        u0_left_px=u0_px,
        u0_right_px=u0_px - offset_px,
        v0_px=v0_px,
        pose_sigma_px=0.0,
        t_ns=0,
    )
    return RigPairScene(
        wide=StereoScene(
            name="bench",
            left=pair[0].image.astype(np.uint8),
            right=pair[1].image.astype(np.uint8),
            f_px=wide.f_px,
            baseline_m=baseline_m,
            truth_z_m=pair[0].z_m.astype(np.float32),
            seen=everywhere,
        ),
        centre_px=(wide.cx_px, wide.cy_px),
        foveae=(fovea,),
    )


def test_foveae_of_the_rig_are_nearer_to_the_truth_than_the_wide_pair_they_replace() -> None:
    found = rig_outcome(rig_scene(), SemiGlobal())
    assert found.pixels[1] == pytest.approx(found.pixels[0], rel=0.005)
    assert 0.01 < found.inside_share < 0.02  # one part in the zoom's square
    assert found.inside_fov_absrel < found.inside_mr_absrel / 3.0


def test_foveae_of_another_baseline_and_none_at_all_are_refused() -> None:
    given = rig_scene()
    with pytest.raises(InvalidInput, match="bench has no foveae"):
        replace(given, foveae=())
    with pytest.raises(InvalidInput, match=r"a fovea pair has a baseline of 0\.3 m"):
        replace(given, foveae=(replace(given.foveae[0], baseline_m=0.3),))
    with pytest.raises(InvalidInput, match="a share of 0 of the wide pixels"):
        rig_outcome(given, SemiGlobal(), share=0)


def test_gains_are_told_with_their_errors_over_scenes() -> None:
    same = np.full(2, 0.5)
    found = [
        SceneOutcome(
            mr=BinScores(absrel=np.array([0.2, 0.4]), rmse=same, delta1=same),
            fov=BinScores(absrel=np.array([0.21, 0.4 - gain]), rmse=same, delta1=same),
            coverage=same,
            places=(),
            bin_depth_m=same,
        )
        for gain in (0.02, 0.04, 0.06)
    ]
    point = BudgetPoint(share=0.25, sizes=budget(NATIVE, 0.25, patches=4), outcomes=tuple(found))
    np.testing.assert_allclose(point.gains(DepthMetric.ABSREL), [-0.01, 0.04])
    np.testing.assert_allclose(point.gain_errors(DepthMetric.ABSREL), [0.0, 0.02 / 3**0.5], atol=1e-12)
    low, high = point.interval(DepthMetric.ABSREL, seed=1)
    assert 1.9 < low.mean < point.ratio(DepthMetric.ABSREL).mean < high.mean < 6.1


class Watching:
    """Counts the steps, and ends the work when it is told to."""

    def __init__(self, *, patience: int = 10_000) -> None:
        self.steps: list[tuple[int, int]] = []
        self.patience = patience

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        assert note
        self.steps.append((done, total))

    def cancelled(self) -> bool:
        return len(self.steps) >= self.patience


def test_the_study_tells_ratios_crossings_and_coverage_beside_the_paper(
    scene: StereoScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tradeoff_study_module, "street", lambda _: scene)  # drawn once is enough
    watch = Watching()
    study = tradeoff_study(scenes=1, quick=True, rig_pairs=(rig_scene(),), watch=watch)
    assert watch.steps[-1] == (4, 4)
    for metric in DepthMetric:
        for reading in ("mean", "sum"):
            for end in ("", "_from_estimate"):
                assert f"t_{metric}_{reading}{end}" in study.values
                assert isinstance(study.values[f"crossing_q_{metric}_{reading}{end}"], list)
    imbalance = study.values["pixel_imbalance_max"]
    assert isinstance(imbalance, float)
    assert imbalance < 0.005
    assert {row.paper for row in study.rows} >= {"2.02", "7.41", "3.28"}
    assert [picture.name for picture in study.pictures] == [
        "tradeoff-bins",
        "tradeoff-ratio",
        "tradeoff-places",
    ]
    assert study.values["rig_pairs"] == 1
    assert any("Virtual KITTI 2 was not given" in said for said in study.deviations)
    assert StudyResult.from_document(study.document()) == study


class Cropping:
    """Loses the last column."""

    name = "cropping"

    def disparity_px(self, view: StereoView) -> NDArray[np.float32]:
        return np.ones(view.left.shape[:2], dtype=np.float32)[:, :-1]


def test_an_estimator_that_does_not_keep_the_size_is_named(scene: StereoScene) -> None:
    with pytest.raises(InvalidInput, match="the estimator 'cropping' gave disparities of shape"):
        scene_outcomes(scene, budget(NATIVE, 0.25, patches=4), Cropping())


def test_the_study_ends_when_it_is_cancelled(scene: StereoScene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tradeoff_study_module, "street", lambda _: scene)  # drawn once is enough
    with pytest.raises(Cancelled, match="the trade-off study was cancelled"):
        tradeoff_study(scenes=2, quick=True, watch=Watching(patience=1))
    with pytest.raises(InvalidInput, match="0 scenes were asked for"):
        tradeoff_study(scenes=0)
    with pytest.raises(InvalidInput, match="a seed of -1 was given"):
        tradeoff_study(seed=-1)
