"""Datasets read point by point from the server, and as a dataset of PyTorch."""

import asyncio
import math
import pickle
import sys

import numpy as np
import pytest
from tests.support.servers.client_stub import CAPTURE, Document, StubServer, png, refusal

from foveacam_client import AsyncRig, ClientError, NotFound, Rig, models


def place(index: int, **more: object) -> Document:
    found: Document = {
        "index": index,
        "scan": 0,
        "sheet_row": 0,
        "sheet_column": index,
        "aim_ax_deg": 1.5,
        "aim_ay_deg": -0.5,
        "distance_m": 2.0,
        "rail_mm": None,
        "cameras": ["left", "right", "wide"],
        "brackets": 1,
    }
    return {**found, **more}


def points(*places: Document) -> Document:
    return {"columns": 2, "rows": 1, "points": list(places), "skipped": [{"index": 1, "why": "out of reach"}]}


@pytest.fixture
def server() -> StubServer:
    """A dataset of the points 0 and 2 of a plan; the second has no wide picture and no distance."""
    second = place(2, cameras=["left", "right"], distance_m=None, aim_ax_deg=None, brackets=2)
    answers = {"GET /captures/cap-1": CAPTURE, "GET /captures/cap-1/points": points(place(0), second)}
    pictures = {
        f"GET /captures/cap-1/points/{index}/{role}.png": png(red=100 + index)
        for index in (0, 2)
        for role in ("left", "right", "wide")
    }
    return StubServer({**answers, **pictures})


def test_a_dataset_is_a_sequence_of_points_with_pictures(server: StubServer) -> None:
    dataset = server.rig().dataset("cap-1")

    assert len(dataset) == 2
    first, last = dataset[0], dataset[-1]
    assert (first.index, last.index, dataset[np.int64(1)].index) == (0, 2, 2)
    assert first.wide is not None
    assert last.wide is None
    assert last.left is not None
    assert last.left.shape == (3, 4, 3)
    assert last.left[0, 0].tolist() == [102, 0, 0]
    assert [point.index for point in dataset] == [0, 2]
    assert [skipped.why for skipped in dataset.skipped] == ["out of reach"]


def test_pictures_are_read_when_a_point_is_asked_for_and_only_of_the_chosen_cameras(
    server: StubServer,
) -> None:
    capture = models.CaptureDocument.model_validate(CAPTURE)

    dataset = server.rig().dataset(capture, cameras=["right"])

    assert len(server.asked) == 2
    point = dataset[0]
    assert server.asked[2:] == ["GET /captures/cap-1/points/0/right.png"]
    assert (point.left, point.wide) == (None, None)
    assert point.right is not None


def test_datasets_and_points_are_described_on_one_line(server: StubServer) -> None:
    dataset = server.rig().dataset("cap-1", cameras=["left"])

    assert repr(dataset) == "RemoteDataset(id='cap-1', 'desk', complete, 2 of 2 points)"
    assert repr(dataset[0]) == "RemotePoint(index=0, aim (1.50°, -0.50°), 2 m, left (3, 4, 3))"
    assert repr(dataset[1]) == "RemotePoint(index=2, unknown aim, unknown distance, left (3, 4, 3))"


@pytest.mark.parametrize("index", [2, -3])
def test_a_point_that_is_not_there_is_an_index_error(server: StubServer, index: int) -> None:
    with pytest.raises(IndexError, match="it has 2, from 0"):
        server.rig().dataset("cap-1")[index]


def test_what_is_no_number_is_no_index(server: StubServer) -> None:
    with pytest.raises(TypeError):
        server.rig().dataset("cap-1")["left"]  # type: ignore[index]  # on purpose


def test_other_exposures_are_read_by_their_number(server: StubServer) -> None:
    dataset = server.rig().dataset("cap-1", cameras=["left"])

    assert dataset.read(1, bracket=1).index == 2
    with pytest.raises(IndexError, match="bracket 1 of point 0"):
        dataset.read(0, bracket=1)


@pytest.mark.parametrize("cameras", [[], ["middle"], "left", ["left", "up"]])
def test_other_cameras_than_the_rigs_are_refused(server: StubServer, cameras: list[str]) -> None:
    with pytest.raises(ClientError, match="one or more of left, right, wide"):
        server.rig().dataset("cap-1", cameras=cameras)


def test_a_dataset_that_is_not_there_or_not_readable_says_so(server: StubServer) -> None:
    with pytest.raises(NotFound):
        server.rig().dataset("cap-9")
    picture = "GET /captures/cap-1/points/0/left.png"
    server.answers[picture] = refusal(404, "not-found", "the archive does not answer")
    with pytest.raises(NotFound, match="the archive does not answer"):
        server.rig().dataset("cap-1")[0]


def test_the_asynchronous_client_reads_the_same(server: StubServer) -> None:
    async def read(rig: AsyncRig) -> list[int]:
        async with rig:
            dataset = await rig.dataset("cap-1", cameras=["left"])
            assert (await dataset[1]).left is not None
            assert len(dataset) == 2
            return [point.index async for point in dataset]

    assert asyncio.run(read(server.async_rig())) == [0, 2]


@pytest.mark.slow
def test_a_dataset_goes_to_pytorch_in_batches(server: StubServer, monkeypatch: pytest.MonkeyPatch) -> None:
    from torch.utils.data import DataLoader, Dataset

    from foveacam_client import torch_points

    def open_rig(_: object) -> Rig:
        return server.rig()

    monkeypatch.setattr(torch_points, "Rig", open_rig)

    dataset = server.rig().dataset("cap-1").torch()
    (batch,) = DataLoader(dataset, batch_size=2)

    assert isinstance(dataset, Dataset)
    assert dataset.cameras == ("left", "right")  # the second point has no wide picture
    assert batch["left"].shape == (2, 3, 3, 4)
    np.testing.assert_allclose(batch["left"][:, 0, 0, 0], [100 / 255, 102 / 255], rtol=1e-6)  # float32
    assert batch["point"].tolist() == [0, 2]
    assert batch["distance_m"][0] == 2.0
    assert math.isnan(batch["distance_m"][1])
    assert len(pickle.loads(pickle.dumps(dataset))) == 2  # noqa: S301 - as for a worker
    with pytest.raises(IndexError):
        dataset[2]


def test_without_pytorch_its_name_is_said(server: StubServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "foveacam_client.torch_points", None)

    with pytest.raises(ClientError, match="pip install torch"):
        server.rig().dataset("cap-1").torch()
