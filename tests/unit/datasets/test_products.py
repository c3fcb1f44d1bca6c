"""Products of many datasets: found again by what made them, refused when a dataset changes, equal bytes."""

import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.scenes.dataset_scenes import written
from tests.support.scenes.learning_pairs import stored, varied_sample
from tests.support.scenes.mosaic_scenes import scan

from foveacam_hardware.contract import Busy, InvalidInput, MonotonicClock, NotCalibrated
from foveacam_pipeline.capture.dataset import Dataset, change_labels
from foveacam_pipeline.capture.dataset.lock import FolderLock
from foveacam_pipeline.products import making
from foveacam_pipeline.products.batch import BatchCounts, datasets_in, plan_batch, run_batch
from foveacam_pipeline.products.making import agreement_sums, make_product
from foveacam_pipeline.products.results import Figures, ProductFolder
from foveacam_pipeline.products.summary import evaluation_figures, write_summary
from foveacam_pipeline.products.task import ProductKind, ProductSettings, plan_products
from foveacam_pipeline.stereo.estimator import BACKENDS
from foveacam_pipeline.stereo.pictures import depth_picture
from foveacam_pipeline.stereo.search import DEFAULT
from foveacam_pipeline.stereo.values import DepthMap
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import HereAndNow, WorkPool
from foveacam_pipeline.workers.processes import local_workers
from foveacam_pipeline.workers.progress import SILENT, SilentProgress
from foveacam_server.resources.capturing.batches.run import BatchOrder, glb_of, make_batch

DEPTH = ProductSettings(kind=ProductKind.DEPTH)
MOSAIC = ProductSettings(kind=ProductKind.MOSAIC)
EVALUATE = ProductSettings(kind=ProductKind.EVALUATE)


@pytest.fixture(scope="module")
def raster(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return scan(tmp_path_factory.mktemp("scans") / "raster", points=2).folder


def made(folder: Path, settings: ProductSettings, out: Path, pool: WorkPool | None = None) -> BatchCounts:
    return run_batch(
        plan_batch([folder], settings),
        pool or HereAndNow(),
        ProductFolder(path=out),
        mesh_file=glb_of,
        watch=SILENT,
        clock=MonotonicClock(),
    )


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_depth_of_every_verged_point_is_made_once_and_found_again(raster: Path, tmp_path: Path) -> None:
    assert made(raster, DEPTH, tmp_path) == BatchCounts(made=2, reused=0, failures=())
    task = plan_products(raster, DEPTH)[0]
    names = {path.name for path in ProductFolder(path=tmp_path).place(task).iterdir()}
    tables = {"depth.tiff", "depth_sigma.tiff", "depth_wrong.tiff"}
    assert names == tables | {"depth.png", "cloud.ply", "mesh.glb", "result.json"}
    assert made(raster, DEPTH, tmp_path) == BatchCounts(made=0, reused=2, failures=())


def test_the_stored_error_of_depth_has_the_calibrations_in_it(raster: Path, tmp_path: Path) -> None:
    made(raster, DEPTH, tmp_path)
    folder = ProductFolder(path=tmp_path).place(plan_products(raster, DEPTH)[0])
    z_m, sigma_m = (
        np.asarray(cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED), dtype=np.float64)
        for name in ("depth.tiff", "depth_sigma.tiff")
    )
    pair = Dataset.open(raster)[0].rectified(scale=0.5)
    calibrated_m = z_m**2 / (pair.f_px * pair.baseline_m) * pair.pose_sigma_px
    known = np.isfinite(z_m)
    assert known.mean() > 0.5
    ratio = (sigma_m / calibrated_m)[known]
    assert ratio.min() >= 1.0
    assert np.median(ratio) < 1.5


def test_each_depth_has_the_chance_that_it_is_wrong(raster: Path, tmp_path: Path) -> None:
    made(raster, DEPTH, tmp_path)
    folder = ProductFolder(path=tmp_path).place(plan_products(raster, DEPTH)[0])
    z_m, wrong = (
        np.asarray(cv2.imread(str(folder / name), cv2.IMREAD_UNCHANGED), dtype=np.float64)
        for name in ("depth.tiff", "depth_wrong.tiff")
    )
    known = np.isfinite(z_m)
    np.testing.assert_array_equal(np.isfinite(wrong), known)
    assert 0.0 < wrong[known].min() < wrong[known].max() <= DEFAULT.max_wrong


def test_a_product_that_lost_a_file_is_made_again(raster: Path, tmp_path: Path) -> None:
    made(raster, DEPTH, tmp_path)
    before = contents(tmp_path)
    (ProductFolder(path=tmp_path).place(plan_products(raster, DEPTH)[1]) / "depth.tiff").unlink()
    assert made(raster, DEPTH, tmp_path) == BatchCounts(made=1, reused=1, failures=())
    assert contents(tmp_path) == before


def test_other_settings_other_code_and_another_name_have_keys_as_they_must(
    raster: Path, tmp_path: Path
) -> None:
    task = plan_products(raster, DEPTH)[0]
    assert plan_products(raster, replace(DEPTH, backend="live"))[0].key != task.key
    assert plan_products(raster, EVALUATE)[0].key != task.key
    assert replace(task, code="another").key != task.key
    moved = tmp_path / "moved"
    moved.symlink_to(raster)
    assert plan_products(moved, DEPTH)[0].key == task.key


def test_a_label_matters_to_an_export_alone(tmp_path: Path) -> None:
    folder = scan(tmp_path / "raster", points=1).folder
    export = ProductSettings(kind=ProductKind.EXPORT, to="nerfstudio")
    before = [plan_products(folder, settings)[0].key for settings in (DEPTH, export)]
    change_labels(folder, label="another")
    after = [plan_products(folder, settings)[0].key for settings in (DEPTH, export)]
    assert [a == b for a, b in zip(before, after, strict=True)] == [True, False]


def test_a_frame_that_changes_before_or_while_it_is_worked_on_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = scan(tmp_path / "raster", points=1).folder
    frame = folder / "images" / "00000-left-b0-s0.tiff"
    whole = frame.read_bytes()

    def changing(depth: DepthMap) -> NDArray[np.uint8]:
        frame.write_bytes(whole[:-1] + b"x")
        return depth_picture(depth)

    with monkeypatch.context() as patch:
        patch.setattr(making, "depth_picture", changing)
        during = made(folder, DEPTH, tmp_path / "out")
    before = made(folder, DEPTH, tmp_path / "out")
    for counts in (during, before):
        (failure,) = counts.failures
        assert (failure.dataset, failure.unit) == ("raster", 0)
        assert "00000-left-b0-s0.tiff: its content is not what was written" in failure.reason
    assert [path.name for path in (tmp_path / "out").rglob("*") if path.is_file()] == []
    frame.write_bytes(whole)
    assert made(folder, DEPTH, tmp_path / "out").made == 1


def test_a_dataset_that_is_not_what_was_planned_is_refused(raster: Path, tmp_path: Path) -> None:
    task = replace(plan_products(raster, DEPTH)[0], inputs_sha256="0" * 64)
    outcome = make_product(task, into=ProductFolder(path=tmp_path / "out"), mesh_file=glb_of)
    assert "changed while it was worked on; start the same command again" in outcome.failed


def test_a_worker_with_another_program_is_refused(raster: Path, tmp_path: Path) -> None:
    task = replace(plan_products(raster, DEPTH)[0], code="foveacam-duo 0.0.1")
    with pytest.raises(InvalidInput, match=r"another program .* instead of foveacam-duo 0\.0\.1; install"):
        make_product(task, into=ProductFolder(path=tmp_path), mesh_file=glb_of)


def test_what_has_no_products_is_refused_and_the_others_go_on(raster: Path, tmp_path: Path) -> None:
    noise = written(tmp_path / "noise", 1).folder
    with pytest.raises(NotCalibrated, match="has no calibration: it has no depth; capture it again"):
        plan_batch([noise], DEPTH)
    plan = plan_batch([noise, raster], DEPTH)
    assert [(one.dataset, one.unit) for one in plan.refused] == [("noise", None)]
    assert len(plan.tasks) == 2
    with pytest.raises(InvalidInput, match="is given twice; give each dataset once"):
        plan_batch([raster, raster], DEPTH)
    with pytest.raises(InvalidInput, match="holds no dataset, nor does a folder in it"):
        datasets_in(noise / "images")
    assert datasets_in(tmp_path) == (noise,)


def test_the_agreement_of_an_evaluation_is_a_share_of_what_both_eyes_answered() -> None:
    sums: Figures = {
        "shown": 200,
        "answered": 100,
        "compared": 90,
        "photometric": 9.0,
        "judged": 50,
        "agreed": 45,
    }
    found = evaluation_figures([sums, sums])
    assert found == {"answered": 0.5, "photometric": 0.1, "left_right_agreed": 0.9}


def test_an_evaluation_judges_pairs_with_truth_by_it(tmp_path: Path) -> None:
    pairs = stored(tmp_path / "pairs", [varied_sample(1), varied_sample(2)])
    plan = plan_batch([pairs], EVALUATE)
    assert made(pairs, EVALUATE, tmp_path / "out").made == 2
    summary = write_summary(plan, ProductFolder(path=tmp_path / "out"), ())
    figures = summary.datasets[0].figures
    assert figures["truth_epe_px"] is not None
    assert figures["truth_epe_px"] < 1.0
    assert figures["left_right_agreed"] is not None
    assert figures["left_right_agreed"] > 0.8
    assert (tmp_path / "out" / "evaluate.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InvalidInput, match="holds pairs with truth, which have no depth; give it to"):
        plan_batch([pairs], DEPTH)


def test_a_mirrored_pair_has_the_same_offset_and_mirrored_disparities() -> None:
    pair = varied_sample(3).pair
    turned = pair.mirrored()
    assert turned.offset_px == pytest.approx(pair.offset_px)
    again = turned.mirrored()
    np.testing.assert_array_equal(again.left, pair.left)
    estimator = BACKENDS["sgbm"]
    found = estimator.estimate(pair)
    sums = agreement_sums(pair, found, estimator)
    shifted = agreement_sums(pair, replace(found, residual_px=found.residual_px + np.float32(3)), estimator)
    assert sums.agreed > 0.9 * sums.judged > 0
    assert shifted.agreed < 0.1 * shifted.judged
    assert shifted.photometric / shifted.compared > 1.5 * sums.photometric / sums.compared


def test_one_run_at_a_time_writes_into_a_folder(raster: Path, tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    order = BatchOrder(datasets=(raster,), settings=DEPTH, out=tmp_path)
    with pytest.raises(Busy, match=r"the batch folder .* is being written already"):
        make_batch(order, watch=SILENT)
    lock.release()
    result = make_batch(order, watch=SILENT)
    assert result.summary.complete
    table = (tmp_path / "depth.csv").read_text().splitlines()
    assert table[0] == "dataset,unit,folder,known,median_z_m,points"
    assert len(table) == 3
    assert json.loads((tmp_path / "depth.json").read_text())["done"] == 2


def test_a_batch_that_is_cancelled_leaves_what_is_done_and_goes_on(raster: Path, tmp_path: Path) -> None:
    class AfterOne(SilentProgress):
        done = 0

        def progress(self, done: int, *, total: int, note: str = "") -> None:
            self.done = done

        def cancelled(self) -> bool:
            return self.done == 1

    order = BatchOrder(datasets=(raster,), settings=DEPTH, out=tmp_path)
    ended = make_batch(order, watch=AfterOne())
    assert (ended.counts.made, ended.summary.done, ended.summary.complete) == (1, 1, False)
    result = make_batch(order, watch=SILENT)
    assert (result.counts.made, result.counts.reused, result.summary.complete) == (1, 1, True)


def test_two_that_make_the_same_leave_one_result(raster: Path, tmp_path: Path) -> None:
    task, into = plan_products(raster, DEPTH)[0], ProductFolder(path=tmp_path)
    inside = threading.Barrier(2, timeout=20.0)

    def make(folder: Path) -> dict[str, float | int | None]:
        (folder / "a").write_text("a")
        inside.wait()
        return {}

    def store() -> None:
        into.store(task, make, check=lambda: None)

    threads = [threading.Thread(target=store) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [path.name for path in (tmp_path / "depth").iterdir()] == [task.key]
    assert into.find(task) is not None


@pytest.fixture(scope="module")
def pools() -> Iterator[dict[str, WorkPool]]:
    """Two processes of this machine, and a cluster whose worker is in this one; `test_batches` has others."""
    from distributed import LocalCluster  # an extra, and slow to import

    with (
        LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0", protocol="tcp"
        ) as local,
        local_workers(2) as processes,
        cluster_workers(local.scheduler_address) as cluster,
    ):
        yield {"processes": processes, "cluster": cluster}


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        DEPTH,
        MOSAIC,
        EVALUATE,
        *(ProductSettings(kind=ProductKind.EXPORT, to=to, scale=0.5) for to in ("colmap", "nerfstudio")),
        *(ProductSettings(kind=ProductKind.EXPORT, to=to) for to in ("authors", "hugging-face", "ome-zarr")),
    ],
    ids=lambda settings: f"{settings.kind.value}-{settings.to}",
)
def test_processes_and_a_cluster_write_the_same_bytes(
    settings: ProductSettings, raster: Path, tmp_path: Path, pools: dict[str, WorkPool]
) -> None:
    for name, pool in pools.items():
        assert made(raster, settings, tmp_path / name, pool).failures == ()
    assert made(raster, settings, tmp_path / "here").failures == ()
    here = contents(tmp_path / "here")
    assert contents(tmp_path / "processes") == here == contents(tmp_path / "cluster")
    assert here
