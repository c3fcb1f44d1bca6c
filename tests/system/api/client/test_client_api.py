"""The typed client on the simulated rig."""

import asyncio
import inspect
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

import foveacam_client
from foveacam_client import InvalidRequest, LeaseLost, NotFound, Rig, TargetOutOfRange, models
from tests.support.servers.running_server import Running

pytestmark = [pytest.mark.timeout(300), pytest.mark.usefixtures("grey")]

PLAN = models.RasterPlan(
    points=models.GridPoints(columns=2, rows=1, half_width_deg=2.0, half_height_deg=2.0),
    verging=models.Verging(mode="given", distance_m=2.0),
)


@pytest.fixture(scope="module")
def client_rig(api_server: Running) -> Iterator[Rig]:
    with foveacam_client.connect(f"http://127.0.0.1:{api_server.port}") as found:
        yield found


def test_a_frame_is_an_array(client_rig: Rig) -> None:
    assert client_rig.frame("wide").shape[:2] == (540, 720)  # the simulated cameras bin 2 x 2 pixels
    assert client_rig.frame("left", scale="4").shape[:2] == (270, 360)


def test_a_raster_is_captured_listed_and_downloaded(client_rig: Rig, tmp_path: Path) -> None:
    capture = client_rig.capture("client", plan=PLAN)
    (listed,) = client_rig.datasets("client")
    path = client_rig.download_dataset(capture.id, tmp_path / "client.zip")

    assert (capture.state, capture.points.taken, listed.id) == ("complete", 2, capture.id)
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert any(name.endswith("dataset.json") or name.startswith("client/") for name in archive.namelist())


def test_a_recording_ends_by_itself_or_is_stopped_by_what_came_back(client_rig: Rig) -> None:
    by_itself = client_rig.record(seconds=0.5)
    begun = client_rig.record("client recording")
    stopped = client_rig.stop_recording(begun)

    assert (by_itself.name, by_itself.state) == ("recording 0001", "complete")
    assert begun.name == "client recording"
    assert begun.state in ("starting", "recording")
    assert (stopped.id, stopped.state) == (begun.id, "complete")


def test_a_target_is_followed_during_a_block(client_rig: Rig) -> None:
    with client_rig.follow(720, 540, label="cup") as following:
        assert following.read().state in ("finding", "followed", "lost")
        assert [one.id for one in client_rig.api.follows.list()] == [following.id]

    assert client_rig.api.follows.list() == []
    following.stop()  # once more, without an error


def test_looking_around_can_be_interrupted_and_then_cancels(client_rig: Rig) -> None:
    def interrupt(progress: models.JobProgress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        client_rig.look_around(on_progress=interrupt, cancel_on_interrupt=True)

    newest = client_rig.api.jobs.list(limit=1)[0]
    assert newest.state in ("cancelling", "cancelled")


def test_refusals_keep_the_words_of_the_server(client_rig: Rig) -> None:
    with pytest.raises(NotFound) as absent:
        client_rig.api.fixations.get("fix-none")
    with pytest.raises(InvalidRequest) as wrong:
        client_rig.api.fixations.create(models.FixationRequest())
    beyond = models.SteerRequest(direction=models.Direction(ax_deg=80.0, ay_deg=0.0))
    with pytest.raises(TargetOutOfRange) as far:
        client_rig.api.mirrors.steer(beyond)

    assert absent.value.status == 404
    assert "Exactly one" in str(wrong.value) or wrong.value.status == 422
    assert far.value.detail


def test_a_lease_that_is_taken_over_ends_the_block_with_the_sentence_of_the_server(
    client_rig: Rig, api_server: Running
) -> None:
    with foveacam_client.connect(f"http://127.0.0.1:{api_server.port}") as other:
        with pytest.raises(LeaseLost, match="otto holds the control lease"), client_rig.hold_lease("me"):
            taken = other.api.lease.take(models.LeaseRequest(holder="otto", take_over=True))
            client_rig.api.mirrors.park()
        other.use_lease(taken.token)
        other.api.lease.release()


def test_events_come_with_what_is_done(client_rig: Rig) -> None:
    before = client_rig.api.events.recent(limit=1)[-1].id
    stopped = client_rig.stop()
    client_rig.api.stop.release()

    events = client_rig.events(kinds=["stop.engaged", "stop.released"], last_event_id=before)

    assert stopped.parked
    assert [next(events).kind for _ in range(2)] == ["stop.engaged", "stop.released"]
    events.close()


def test_every_plain_read_fits_its_model(client_rig: Rig) -> None:
    groups = [
        found for found in vars(client_rig.api).values() if hasattr(found, "list") or hasattr(found, "get")
    ]
    for group in groups:
        for name in ("list", "get"):
            method = getattr(group, name, None)
            if method is not None and not any(
                found.default is found.empty for found in inspect.signature(method).parameters.values()
            ):
                try:
                    method()
                except foveacam_client.ProblemError as error:
                    assert error.status in (404, 409, 503), (group, name, error)


def test_the_asynchronous_client_has_the_same_frames_and_datasets(api_server: Running) -> None:
    async def look() -> tuple[tuple[int, ...], int]:
        async with foveacam_client.connect_async(f"http://127.0.0.1:{api_server.port}") as rig:
            for _ in range(100):
                shape = (await rig.frame("wide")).shape[:2]
                if shape != (1080, 1440):  # else a capture has just ended, which has all pixels
                    break
                await asyncio.sleep(0.1)
            return shape, len(await rig.datasets("client"))

    assert asyncio.run(look()) == ((540, 720), 1)
