"""The load of the server's parts by REST."""

from foveacam_server.foundation.store import Document
from tests.system.conftest import Running


def rows(found: Document, part: str, key: str) -> dict[str, Document]:
    return {row[key]: row for row in found[part]}


def test_engine_tells_the_load_of_threads_stages_cameras_and_the_start(server: Running) -> None:
    server.fixate()
    found = server.poll(
        "/engine",
        lambda engine: engine["window_s"] is not None and engine["event_loop"]["worst_lag_ms"] is not None,
    )

    threads = rows(found, "threads", "name")
    assert {"event loop", "foveacam-hardware", "foveacam-engine"} <= set(threads)
    assert 0.0 <= threads["foveacam-hardware"]["cpu_share"] <= 1.1  # of 2 s, counted in 10 ms
    assert 0.0 <= found["hardware"]["busy_share"] <= 1.0
    assert rows(found, "stages", "stage")["look"]["count"] > 0
    assert rows(found, "stages", "stage")["look"]["median_ms"] > 0.0
    assert [camera["role"] for camera in found["cameras"]] == ["wide", "left", "right"]
    assert all(camera["worst_gap_ms"] > 0.0 for camera in found["cameras"])
    assert rows(found, "views", "view")["wide"]["published"] > 0
    process = found["process"]
    assert process["up_s"] >= process["services_opened_s"] > 0.0
    assert process["memory_mb"] > 1.0 and process["database_mb"] > 0.0 and process["open_files"] > 0


def test_every_step_of_the_start_has_its_duration(server: Running) -> None:
    start = server.get("/engine").json()["start"]
    assert [step["device"] for step in start[:5]] == ["rig", "mirrors", "wide", "left", "right"]
    assert all(step["duration_s"] >= 0.0 and step["after_s"] > 0.0 for step in start)
    assert [step["after_s"] for step in start] == sorted(step["after_s"] for step in start)
