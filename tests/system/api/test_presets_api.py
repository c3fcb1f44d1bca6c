"""Named settings of the cameras and named layouts of windows over REST."""

import pytest

from foveacam_server.foundation.store import Document
from tests.support.servers.running_server import API, Running

pytestmark = pytest.mark.timeout(120)

PRESETS, LAYOUTS = f"{API}/cameras/presets", f"{API}/views/layouts"
LAYOUT = "row-600(wide,column-500(left,right))"


def settings(server: Running, role: str) -> Document:
    found: Document = server.get(f"/cameras/{role}").json()["settings"]
    return found


def test_settings_of_all_cameras_are_saved_changed_and_applied_again(api_server: Running) -> None:
    api_server.poll("/rig", lambda rig: all(camera["connected"] for camera in rig["cameras"]))
    api_server.poll("/rig/binning", lambda found: found["in_force"] == found["working_binning"])
    api_server.http.patch(f"{API}/cameras/left", json={"pixel_format": "RGB8", "linked": True})
    before = {role: settings(api_server, role) for role in ("wide", "left", "right")}
    saved = api_server.http.put(f"{PRESETS}/Bright room").json()
    assert [camera["role"] for camera in saved["cameras"]] == ["wide", "left", "right"]
    changed = api_server.http.patch(f"{API}/cameras/left", json={"exposure_ms": 3.0, "linked": True})
    assert changed.status_code == 200
    api_server.http.patch(f"{API}/cameras/wide", json={"gain_db": 6.0})
    assert settings(api_server, "wide")["gain_db"] == 6.0

    applied = api_server.post("/cameras/presets/Bright room/apply")

    assert applied.status_code == 200, applied.text
    for role, wanted in before.items():
        now = settings(api_server, role)
        assert {**now, "kept": None} == {**wanted, "kept": None}
    assert [preset["name"] for preset in api_server.get("/cameras/presets").json()] == ["Bright room"]
    assert api_server.http.delete(f"{PRESETS}/Bright room").status_code == 204
    assert api_server.get("/cameras/presets").json() == []


def test_unknown_preset_and_foreign_lease_are_refused(api_server: Running) -> None:
    assert api_server.post("/cameras/presets/none/apply").status_code == 404
    token = api_server.post("/lease", {"holder": "ada"}).json()["token"]
    assert api_server.post("/cameras/presets/none/apply").status_code == 409
    api_server.http.delete(f"{API}/lease", headers={"X-Lease": token})


def test_layout_of_a_window_is_saved_replaced_and_deleted(api_server: Running) -> None:
    assert api_server.http.put(f"{LAYOUTS}/Bench", json={"layout": "wide"}).status_code == 200
    api_server.http.put(f"{LAYOUTS}/Bench", json={"layout": LAYOUT})
    assert api_server.get("/views/layouts").json() == [{"name": "Bench", "layout": LAYOUT}]
    assert api_server.http.put(f"{LAYOUTS}/Bench", json={"layout": "<script>"}).status_code == 422
    assert api_server.http.delete(f"{LAYOUTS}/Bench").status_code == 204
    assert api_server.http.delete(f"{LAYOUTS}/Bench").status_code == 404
