"""A mirror controller whose process is killed: what the server says meanwhile, and its return."""

import os
import signal
from typing import Any

from foveacam_hardware.sim.far_ends.controller_process import ControllerProcess

from .conftest import PATIENCE_S, Running

ASIDE = {"direction": {"ax_deg": 3.0, "ay_deg": 1.0}}
NOWHERE = {"x_v": None, "y_v": None, "ax_deg": None, "ay_deg": None}


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
