"""The load of the server's parts by REST."""

from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import Running


def rows(found: Document, part: str, key: str) -> dict[str, Document]:
    return {row[key]: row for row in found[part]}


def test_engine_tells_the_load_of_threads_stages_cameras_and_the_start(api_server: Running) -> None:
    api_server.fixate()
    found = api_server.poll(
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


def test_every_step_of_the_start_has_its_duration(api_server: Running) -> None:
    start = api_server.get("/engine").json()["start"]
    assert [step["device"] for step in start[:6]] == [
        "rig",
        "renderer",
        "mirrors",
        "wide",
        "left",
        "right",
    ]
    assert all(step["duration_s"] >= 0.0 and step["after_s"] > 0.0 for step in start)
    assert [step["after_s"] for step in start] == sorted(step["after_s"] for step in start)


def test_engine_tells_who_feeds_whom(api_server: Running) -> None:
    api_server.fixate()
    assert api_server.http.get("/api/v1/views/wide/snapshot.jpg").status_code == 200

    def joined(engine: Document) -> set[tuple[str, str, str]]:
        return {(edge["source"], edge["target"], edge["items"]) for edge in engine["edges"]}

    found = api_server.poll(
        "/engine", lambda engine: ("foveacam-jobs", "foveacam-shapes", "looks") in joined(engine)
    )
    assert joined(found) >= {
        ("camera wide", "foveacam-hardware", "frames"),
        ("camera left", "foveacam-hardware", "frames"),
        ("event loop", "foveacam-jobs", "jobs"),
        ("foveacam-jobs", "foveacam-hardware", "commands"),
        ("foveacam-jobs", "foveacam-wide-depth", "looks"),
        ("foveacam-hardware", "mirrors", "moves"),
        ("foveacam-hardware", "view wide", "pictures"),
    }
    ends = {edge[end] for edge in found["edges"] for end in ("source", "target")}
    assert {part["name"] for part in found["parts"]} == ends
    parts = rows(found, "parts", "name")
    assert parts["camera wide"]["kind"] == "camera" and parts["view wide"]["kind"] == "view"
    assert parts["foveacam-hardware"]["waiting"] >= 0
    wide = next(edge for edge in found["edges"] if edge["target"] == "view wide")
    assert wide["rate_hz"] > 0.0 and wide["mb_per_s"] > 0.0 and found["flow_window_s"] > 0.0
