"""`foveacam serve` on a scene of walkers, with the simulation's truth about them in a file.

`python -m foveacam_bench.pace.judged_server PORT DATA SCENE LOG` appends a line of JSON every 50 ms: the time
of the rig's clock, and for each walker where the wide view shows the chest, how far that is, and whether both
foveae show it. Nothing in the server reads the file.
"""

import json
import sys
import threading
import time
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from foveacam_bench.track.following import CHEST_M
from foveacam_hardware.contract import Role
from foveacam_hardware.sim.scenes.format import SceneObject
from foveacam_hardware.sim.scenes.motion import pose
from foveacam_hardware.sim.truth import Truth
from foveacam_server.foundation.settings import Settings
from foveacam_server.resources.studying.studies.click_truth import EYES
from foveacam_server.serving import run_server

PERIOD_S = 0.05
WALKER = "walker "
"""Prefix of each walker's name."""
_RIG_IS_OPEN = threading.Event()


def keep_truth(known: list[Truth]) -> None:
    """Keep the truth of every simulated rig that this process opens from now on."""
    begin = Truth.__init__

    def kept(truth: Truth, *parts: object) -> None:
        begin(truth, *parts)  # type: ignore[arg-type]  # as they came
        known.append(truth)
        _RIG_IS_OPEN.set()

    Truth.__init__ = kept  # type: ignore[method-assign,assignment]  # in this process alone


def write_truth(known: list[Truth], log: TextIO) -> None:
    """Append a line every `PERIOD_S` once a rig is open."""
    _RIG_IS_OPEN.wait()
    while True:
        log.write(json.dumps(_line(known[-1])) + "\n")
        log.flush()
        time.sleep(PERIOD_S)


def _line(truth: Truth) -> dict[str, object]:
    t_ns = time.monotonic_ns()  # the rig's clock
    walkers = [one for one in truth.world.animated_scene.file.objects if one.name.startswith(WALKER)]
    return {"t_ns": t_ns, "walkers": [_walker(truth, walker, t_ns) for walker in walkers]}


def _walker(truth: Truth, placed: SceneObject, t_ns: int) -> dict[str, object]:
    chest = pose(placed, truth.world.scene_s(t_ns))[:3, 3] - np.array([0.0, CHEST_M, 0.0])
    x_px, y_px = truth.wide_pixels(chest[None])[0].tolist()
    range_m = float(np.linalg.norm(chest))
    return {
        "x_px": x_px,
        "y_px": y_px,
        "range_m": range_m,
        "in_both": all(_shows(truth, role, chest, t_ns) for role in EYES),
    }


def _shows(truth: Truth, role: Role, point_rig_m: NDArray[np.float64], t_ns: int) -> bool:
    view = truth.projection(role, t_ns)
    x, y, w = view.M @ (point_rig_m - view.C)
    return bool(w > 0.0 and 0.0 <= x / w < view.width and 0.0 <= y / w < view.height)


def main() -> None:
    """Serve until interrupted."""
    port, data, scene, log = sys.argv[1:5]
    known: list[Truth] = []
    keep_truth(known)
    with Path(log).open("a") as file:
        threading.Thread(target=write_truth, args=(known, file), daemon=True).start()
        run_server(Settings(port=int(port), data=Path(data), scene=scene), console=Console())


if __name__ == "__main__":
    main()
