"""What learning gives to a cluster: pairs are rendered and a network is judged there as here."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import torch
from tests.support.scenes.learning_pairs import scene
from typer.testing import CliRunner

from foveacam_pipeline.learn.evaluation import evaluate
from foveacam_pipeline.learn.network.config import SIZES
from foveacam_pipeline.learn.network.network import FoveatedStereo
from foveacam_pipeline.learn.pair_folder import Split, StoredPairs
from foveacam_pipeline.workers.cluster import cluster_workers
from foveacam_pipeline.workers.pool import HereAndNow
from foveacam_server.cli import app
from foveacam_server.resources.studying.learning.rendered_pairs import PairOrder, make_pairs

pytestmark = pytest.mark.slow

SEED = 1


@contextmanager
def cluster_of_one(*, processes: bool) -> Iterator[str]:
    """Run a cluster of one worker, a process of its own or threads of this one; yield its address."""
    from distributed import LocalCluster  # an extra, and slow to import

    with LocalCluster(  # type: ignore[no-untyped-call]  # Dask ships no types
        n_workers=1, threads_per_worker=2, processes=processes, dashboard_address=":0", protocol="tcp"
    ) as local:
        yield local.scheduler_address


def test_a_cluster_makes_the_same_pairs(tmp_path: Path) -> None:
    order = PairOrder(folder=tmp_path / "here", count=2, seed=SEED, split=Split.TRAIN, size=(360, 270))
    made = make_pairs(order, HereAndNow(), on_pair=lambda _done, _total, _rate: None, stopped=lambda: False)
    out = tmp_path / "cluster"
    with cluster_of_one(processes=True) as address:
        arguments = ["--out", str(out), "--count", "2", "--seed", str(SEED), "--cluster", address]
        result = CliRunner().invoke(app, ["learn", "pairs", *arguments])
    assert "2 of 2 pairs" in result.output
    assert StoredPairs(out).document.pairs == made.document.pairs


def test_a_cluster_judges_as_this_process_does() -> None:
    torch.set_num_threads(1)
    torch.manual_seed(3)
    network = FoveatedStereo(SIZES["nano"]).eval()
    dataset = scene("held out", seed=100, pairs=3, labelled=True)
    counts: list[int] = []
    with (
        cluster_of_one(processes=False) as address,
        cluster_workers(address, modules=("torch",)) as pool,
    ):
        there = evaluate(
            network,
            dataset,
            on_pair=lambda done, _total: counts.append(done),
            stopped=lambda: False,
            pool=pool,
        )
    torch.set_num_threads(2)
    try:
        here = evaluate(network, dataset, on_pair=lambda _done, _total: None, stopped=lambda: False)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(1)
    assert counts == [1, 2, 3]
    assert there == here
