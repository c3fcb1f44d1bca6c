"""Rasters, recordings, surveys and followed targets by one call each; the server is a table of answers."""

import asyncio

import pytest
from tests.support.servers.client_stub import CAPTURE, FOLLOWED, JOB, RECORDING, Answer, StubServer, refusal

from foveacam_client import AsyncRig, Following, InvalidRequest, NotFound, RigBusy, models

WIDE_DEPTH = {
    "age_median_s": 1.0,
    "cell_px": 24,
    "columns": 60,
    "rows": 45,
    "farthest_m": 3.0,
    "nearest_m": 1.0,
    "known_cells": 2000,
    "known_fraction": 0.7,
    "oldest_s": 2.0,
    "ply_url": "",
    "png_url": "",
    "relative_sigma_median": 0.01,
    "sources": {},
    "survey_job_id": None,
    "surveyed_fraction": 0.9,
}


def test_a_raster_is_waited_for_and_has_the_time_as_its_name() -> None:
    server = StubServer({"POST /captures": JOB, "GET /result": CAPTURE})
    progress: list[models.JobProgress] = []

    capture = server.rig().raster(columns=3, rows=2, on_progress=progress.append)

    sent = server.bodies["POST /captures"]
    assert (capture.id, progress[0].done) == ("cap-1", 4)
    assert (sent["plan"]["points"]["columns"], sent["plan"]["points"]["rows"]) == (3, 2)
    assert sent["name"].startswith("raster-20")
    assert "verging" not in sent["plan"]


def test_a_raster_at_a_distance_verges_there() -> None:
    server = StubServer({"POST /captures": JOB, "GET /result": CAPTURE})

    server.rig().raster(name="desk", distance_m=2.0)

    sent = server.bodies["POST /captures"]
    assert sent["name"] == "desk"
    assert sent["plan"]["verging"] == {"mode": "given", "distance_m": 2.0, "each_point": False}


@pytest.mark.parametrize("wrong", [{"columns": 0}, {"rows": 102}, {"distance_m": 0.0}, {"distance_m": -1.0}])
def test_a_raster_that_cannot_be_is_refused_before_it_is_sent(wrong: dict[str, int]) -> None:
    server = StubServer({})

    with pytest.raises(ValueError, match=next(iter(wrong))):
        server.rig().raster(**wrong)  # type: ignore[arg-type]  # as the test names them

    assert server.asked == []


def test_a_recording_of_some_seconds_is_waited_for() -> None:
    ended = {**RECORDING, "state": "complete", "job_id": None}
    server = StubServer({"POST /recordings": JOB, "GET /result": ended})

    recording = server.rig().record(seconds=5)

    assert recording.state == "complete"
    sent = server.bodies["POST /recordings"]
    assert (sent["name"], sent["numbered"], sent["duration_s"]) == ("recording", True, 5.0)


def test_a_recording_without_seconds_goes_on_until_it_is_stopped_by_what_came_back() -> None:
    other = {**RECORDING, "id": "rec-0", "job_id": None, "state": "complete"}
    stopped = {**RECORDING, "state": "complete"}
    answers: dict[str, Answer] = {
        "POST /recordings": JOB,
        "GET /recordings": [other, RECORDING],
        "POST /recordings/rec-1/stop": stopped,
    }
    server = StubServer(answers)
    rig = server.rig()

    recording = rig.record("desk")

    assert (recording.id, recording.state) == ("rec-1", "recording")
    assert server.bodies["POST /recordings"]["numbered"] is False
    assert rig.stop_recording(recording).state == "complete"
    assert rig.stop_recording("rec-1").state == "complete"


def test_a_recording_that_has_failed_already_raises_its_problem() -> None:
    problem = {"type": "/problems/busy", "title": "Busy", "status": 409, "detail": "no frames"}
    failed = {**JOB, "state": "failed", "problem": problem}
    server = StubServer({"POST /recordings": JOB, "GET /recordings": [], "GET /jobs/job-1": failed})

    with pytest.raises(RigBusy, match="no frames"):
        server.rig().record()


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), 1e9])
def test_a_recording_of_no_length_is_refused_before_it_is_sent(seconds: float) -> None:
    server = StubServer({})

    with pytest.raises(ValueError, match="duration_s"):
        server.rig().record(seconds=seconds)

    assert server.asked == []


def test_a_recording_that_is_not_there_cannot_be_stopped() -> None:
    with pytest.raises(NotFound):
        StubServer({}).rig().stop_recording("rec-9")


def test_the_rig_looks_around_and_answers_with_the_wide_depth() -> None:
    server = StubServer({"POST /wide_depth/surveys": JOB, "GET /result": WIDE_DEPTH})

    assert server.rig().look_around().known_fraction == 0.7


def test_a_target_is_followed_during_a_block() -> None:
    near = {**FOLLOWED, "state": "followed", "distance_m": 2.0, "distance_sigma_m": 0.01}
    answers = {"POST /follows": FOLLOWED, "GET /follows/fol-1": near, "DELETE /follows/fol-1": None}
    server = StubServer({**answers, "GET /follows/fol-1/trail": []})

    with server.rig().follow(700, 500, label="cup", priority=2.0) as following:
        assert repr(following) == "Following(id='fol-1', 'cup', finding, unknown distance)"
        assert following.read().distance_m == 2.0
        assert repr(following) == "Following(id='fol-1', 'cup', followed, 2.000 ± 0.010 m)"
        assert following.trail() == []

    assert server.asked[-1] == "DELETE /follows/fol-1"
    sent = server.bodies["POST /follows"]
    assert (sent["pixel"], sent["label"], sent["priority"]) == ({"x_px": 700.0, "y_px": 500.0}, "cup", 2.0)


def test_a_block_that_fails_stops_following_and_keeps_its_error() -> None:
    server = StubServer({"POST /follows": FOLLOWED, "DELETE /follows/fol-1": None})

    with pytest.raises(ZeroDivisionError), server.rig().follow(700, 500):
        raise ZeroDivisionError

    assert server.asked[-1] == "DELETE /follows/fol-1"


def test_a_target_that_is_no_longer_followed_is_stopped_without_an_error() -> None:
    following = StubServer({"POST /follows": FOLLOWED}).rig().follow(700, 500)

    assert isinstance(following, Following)
    following.stop()


def test_a_target_outside_the_view_is_refused_in_the_words_of_the_server() -> None:
    server = StubServer({"POST /follows": refusal(422, "invalid", "x_px is outside the view")})

    with pytest.raises(InvalidRequest, match="outside the view"):
        server.rig().follow(-5, 500)
    with pytest.raises(ValueError, match="priority"):
        server.rig().follow(700, 500, priority=0.0)


def test_the_asynchronous_client_has_the_same_calls() -> None:
    ended = {**RECORDING, "state": "complete"}
    answers: dict[str, Answer] = {
        "POST /captures": JOB,
        "POST /recordings": JOB,
        "GET /recordings": [RECORDING],
        "POST /recordings/rec-1/stop": ended,
        "POST /wide_depth/surveys": JOB,
        "POST /follows": FOLLOWED,
        "DELETE /follows/fol-1": None,
    }
    server = StubServer(answers)

    async def ask(rig: AsyncRig) -> list[str]:
        async with rig:
            server.answers["GET /result"] = CAPTURE
            capture = await rig.raster(columns=2, rows=1)
            server.answers["GET /result"] = WIDE_DEPTH
            depth = await rig.look_around()
            recording = await rig.stop_recording(await rig.record())
            async with await rig.follow(700, 500) as following:
                return [capture.id, str(depth.columns), recording.state, following.id]

    assert asyncio.run(ask(server.async_rig())) == ["cap-1", "60", "complete", "fol-1"]
    assert server.asked[-1] == "DELETE /follows/fol-1"
