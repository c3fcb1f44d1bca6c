"""The typed client on the simulated rig."""

import asyncio
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import foveacam_client
from foveacam_client import InvalidRequest, NotFound, Rig, TargetOutOfRange, models
from tests.system.conftest import Running

pytestmark = pytest.mark.timeout(300)

PLAN = models.RasterPlan(
    points=models.GridPoints(columns=2, rows=1, half_width_deg=2.0, half_height_deg=2.0),
    verging=models.Verging(mode="given", distance_m=2.0),
)


@pytest.fixture(scope="module")
def rig(server: Running) -> Iterator[Rig]:
    with foveacam_client.connect(f"http://127.0.0.1:{server.port}") as found:
        yield found


def test_a_pixel_is_fixated_and_its_cloud_lies_at_its_distance(rig: Rig) -> None:
    told: list[models.JobProgress] = []

    fixation = rig.fixate(720, 540, label="middle", timeout_s=100.0, on_progress=told.append)
    cloud = rig.cloud(fixation)

    assert fixation.distance_m is not None
    assert fixation.distance_sigma_m is not None
    assert 0.0 < fixation.distance_sigma_m < 0.1 * fixation.distance_m
    assert told
    assert cloud.points_rig_m.shape == cloud.colors.shape
    assert cloud.colors.dtype == np.uint8
    assert abs(np.median(cloud.points_rig_m[:, 2]) / fixation.distance_m - 1.0) < 0.1
    assert np.median(cloud.sigma_m) > 0.0


def test_a_frame_is_an_array(rig: Rig) -> None:
    assert rig.frame("wide").shape[:2] == (1080, 1440)
    assert rig.frame("left", scale="2").shape[:2] == (540, 720)


def test_a_raster_is_captured_listed_and_downloaded(rig: Rig, tmp_path: Path) -> None:
    capture = rig.capture("client", plan=PLAN)
    (listed,) = rig.datasets("client")
    path = rig.download_dataset(capture.id, tmp_path / "client.zip")

    assert (capture.state, capture.points.taken, listed.id) == ("complete", 2, capture.id)
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert any(name.endswith("dataset.json") or name.startswith("client/") for name in archive.namelist())


def test_refusals_keep_the_words_of_the_server(rig: Rig) -> None:
    with pytest.raises(NotFound) as absent:
        rig.api.fixations.get("fix-none")
    with pytest.raises(InvalidRequest) as wrong:
        rig.api.fixations.create(models.FixationRequest())
    beyond = models.SteerRequest(direction=models.Direction(ax_deg=80.0, ay_deg=0.0))
    with pytest.raises(TargetOutOfRange) as far:
        rig.api.mirrors.steer(beyond)

    assert absent.value.status == 404
    assert "Exactly one" in str(wrong.value) or wrong.value.status == 422
    assert far.value.detail


def test_events_come_with_what_is_done(rig: Rig) -> None:
    before = rig.api.events.recent(limit=1)[-1].id
    rig.api.stop.engage()
    rig.api.stop.release()

    events = rig.events(kinds=["stop.engaged", "stop.released"], last_event_id=before)

    assert [next(events).kind for _ in range(2)] == ["stop.engaged", "stop.released"]
    events.close()


def test_every_plain_read_fits_its_model(rig: Rig) -> None:
    groups = [found for found in vars(rig.api).values() if hasattr(found, "list") or hasattr(found, "get")]
    for group in groups:
        for name in ("list", "get"):
            method = getattr(group, name, None)
            if method is not None and not _needed(method):
                try:
                    method()
                except foveacam_client.ProblemError as error:
                    assert error.status in (404, 409, 503), (group, name, error)


def _needed(method: object) -> bool:
    import inspect

    found = inspect.signature(method).parameters.values()  # type: ignore[arg-type]  # a bound method
    return any(one.default is inspect.Parameter.empty for one in found)


def test_the_asynchronous_client_fixates_as_well(server: Running) -> None:
    async def fixate() -> models.FixationDocument:
        async with foveacam_client.connect_async(f"http://127.0.0.1:{server.port}") as rig:
            frame = await rig.frame("wide")
            assert frame.shape[:2] == (1080, 1440)
            return await rig.fixate(720, 540)

    assert asyncio.run(fixate()).basis is not None
