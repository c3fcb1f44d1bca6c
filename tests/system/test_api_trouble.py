"""Trouble: a dying controller, a lost camera, missing devices, restarts, foreign calibrations."""

import itertools
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.contract import PARKED, LookOptions, PixelFormat, Role, StereoVolts
from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess
from foveacam_server.resources.calibrating.calibrations.service import SHIPPED
from foveacam_server.rig.hardware_commands import ExclusiveHead, RequestedLook
from tests.support.servers.running_server import (
    API,
    CENTRE,
    PATIENCE_S,
    SELDOM_HZ,
    Running,
    missing_rig,
    running,
)

pytestmark = pytest.mark.timeout(300)

ASIDE = {"direction": {"ax_deg": 3.0, "ay_deg": 1.0}}
NOWHERE = {"x_v": None, "y_v": None, "ax_deg": None, "ay_deg": None}


def test_controller_that_dies_in_a_fixation_fails_the_job_and_is_parked_on_return(
    server: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller = server.truth.controller
    assert isinstance(controller, ControllerProcess)
    before = server.last_event
    killed = threading.Event()

    def kill() -> None:
        controller.die()
        killed.set()

    with monkeypatch.context() as patch:
        patch.setattr(ExclusiveHead, "begin_look", before_look(1, kill))
        answer = server.post("/fixations", CENTRE, Prefer="wait=60")
    assert killed.is_set()
    assert answer.status_code in (502, 503, 504)
    assert "controller" in answer.json()["detail"]
    assert server.wait_for_event("device.fault", after=before)["device"] == "mirrors"
    assert server.http.get("/healthz").status_code == 200
    ready = server.http.get("/readyz")
    assert (ready.status_code, ready.json()["problems"][0]["device"]) == (503, "mirrors")
    assert server.post("/fixations", CENTRE).status_code == 503
    controller.power_cycle()
    assert server.wait_for_event("device.recovered", after=before) == {"device": "mirrors"}
    assert server.rig.mirrors.state.volts == PARKED
    assert server.fixate({**CENTRE, "depth": False})["state"] == "verged"


def test_unplugged_wide_camera_is_told_and_comes_back(server: Running) -> None:
    before = server.last_event
    server.truth.world.faults.unplugged.add(Role.WIDE)
    assert server.wait_for_event("device.fault", after=before)["device"] == "wide"
    rig = server.get("/rig").json()
    assert [problem["device"] for problem in rig["problems"]] == ["wide"]
    server.truth.world.faults.unplugged.discard(Role.WIDE)
    assert server.wait_for_event("device.recovered", after=before) == {"device": "wide"}


def seen(server: Running) -> dict[str, Any]:  # Any: a JSON document
    """Return the mirrors as they are now: the hardware thread has looked at them again."""
    hardware = server.services.hardware
    hardware.submit(hardware.refresh).result(PATIENCE_S)
    found: dict[str, Any] = server.get("/mirrors").json()
    return found


def test_mirrors_whose_controller_was_killed_are_unknown_until_it_is_back_and_parked(server: Running) -> None:
    controller, began = server.truth.controller, server.last_event
    assert isinstance(controller, ControllerProcess)
    assert server.post("/mirrors/steer", ASIDE).json()["left"]["x_v"] > 10.0

    os.kill(controller.pid, signal.SIGKILL)
    assert server.wait_for_event("device.fault", after=began)["device"] == "mirrors"
    gone = seen(server)
    assert (gone["connected"], gone["enabled"]) == (False, None)
    assert (gone["left"], gone["right"]) == (NOWHERE, NOWHERE)
    assert server.services.hardware.pose is None

    assert server.wait_for_event("device.recovered", after=began)["device"] == "mirrors"
    back = seen(server)
    assert (back["connected"], back["enabled"], back["left"]["x_v"]) == (True, True, 0.0)
    assert server.post("/mirrors/steer", ASIDE).status_code == 200


def test_missing_serial_port_does_not_keep_the_server_from_starting(tmp_path: Path) -> None:
    with running(tmp_path / "data", rig=missing_rig(tmp_path)) as server:
        assert server.http.get("/healthz").status_code == 200
        ready = server.http.get("/readyz")
        assert ready.status_code == 503
        missing = {problem["device"]: problem["detail"] for problem in ready.json()["problems"]}
        assert "/dev/ttyNOBODY" in missing["mirrors"]
        assert "workshop" in missing["calibration"]
        remedies = {problem["device"]: problem["remedy"] for problem in server.get("/rig").json()["problems"]}
        assert "plug in the device or correct the port" in remedies["mirrors"]
        assert "start the server again" in remedies["wide"]  # no cable helps a camera that the file lacks
        refused = server.post("/fixations", CENTRE)
        assert (refused.status_code, refused.json()["type"]) == (409, "/problems/not-calibrated")
        stopped = server.post("/stop").json()
        assert (stopped["engaged"], stopped["parked"]) == (True, False)


def test_calibration_of_another_rig_is_refused_and_said(tmp_path: Path) -> None:
    rig = missing_rig(tmp_path, rig_id="sim-rig120")
    with running(tmp_path, rig=rig, calibration=SHIPPED / "sim-paper.json") as server:
        refused = server.post("/fixations", CENTRE)
        assert refused.status_code == 409
        assert "sim-paper" in refused.json()["detail"]
        assert "sim-rig120" in refused.json()["detail"]
        assert server.get("/rig").json()["calibration"] is None


def test_restart_keeps_targets_and_settings_of_cameras_until_they_are_reset(tmp_path: Path) -> None:
    with running(tmp_path, live_hz=SELDOM_HZ) as server:
        newest = server.get("/cameras/self_tests/newest").json()
        assert [eye["verdict"] for eye in newest["eyes"]] == ["untested", "untested"]
        assert server.get("/cameras/self_tests").json() == []
        fixation = server.fixate()
        server.wait_for_event("cloud.created", after=0)
        change(server, "left", gain_db=4.0, linked=True)
        change(server, "wide", pixel_format="Mono8", exposure_auto="continuous")
        last = server.last_event
    with running(tmp_path, live_hz=SELDOM_HZ) as server:
        target = server.get(f"/targets/{fixation['target_id']}").json()
        assert target["distance_m"] == fixation["distance_m"]
        assert server.get(f"/clouds/{target['cloud_id']}").status_code == 200
        assert server.get("/depth", x_px=720.0, y_px=560.0).status_code in (200, 404)
        assert server.services.events.after(0)[0].id == 1
        assert server.last_event > last
        assert settings(server, "wide")["exposure_auto"] == "continuous"
        assert [settings(server, role)["gain_db"] for role in ("wide", "left", "right")] == [0.0, 4.0, 4.0]
        assert server.rig.wide.settings.pixel_format is PixelFormat.MONO8
        answer = server.http.delete(f"{API}/cameras/left/settings").json()
        assert answer["cameras"][0]["settings"]["gain_db"] == 0.0
        assert answer["cameras"][0]["settings"]["kept"] is False
        assert [entry["setting"] for entry in answer["divergence"]] == ["gain_db"]


def change(server: Running, role: str, **body: object) -> None:
    answer = server.http.patch(f"{API}/cameras/{role}", json=body)
    assert answer.status_code == 200, answer.text


def settings(server: Running, role: str) -> dict[str, Any]:  # Any: a JSON document
    found: dict[str, Any] = server.get(f"/cameras/{role}").json()["settings"]
    return found


def before_look(number: int, act: Callable[[], object]) -> Callable[..., RequestedLook]:
    """Return a look that calls `act` when a job has done `number` looks, before its next."""
    begin_look, count = ExclusiveHead.begin_look, itertools.count()

    def counted(head: ExclusiveHead, volts: StereoVolts, *, options: LookOptions) -> RequestedLook:
        if next(count) == number:
            act()
        return begin_look(head, volts, options=options)

    return counted
