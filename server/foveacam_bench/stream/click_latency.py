"""Time from a mouse click on the wide view until the page shows the distance of that fixation, and its parts.

Clicks are made on textured points of the default scene that both eyes can see, according to the simulation's
truth, or anywhere in the steering field. Before the next click the shape is computed and drawn, and the
target is deleted: a click beside it would correct it instead of making a new one. The page's clock measures
from the press to the change of the result card; the parts come from the server's records, on the same wall
clock.
"""

import math
import time
from datetime import datetime
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from foveacam_bench.figures import Figures
from foveacam_bench.servers import ServerProcess
from foveacam_bench.stream.console_page import PATIENCE_S, page_position, wait_until
from foveacam_bench.verge.field_clicks import FIELD_DEG
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_client.document import JsonObject
from foveacam_hardware.contract import DeviceFault
from foveacam_hardware.sim.rig import open_simulated
from foveacam_pipeline.models import load_calibration
from foveacam_pipeline.verge.values import Basis
from foveacam_server.resources.studying.studies.click_truth import ClickKind, classify_click, truth_of
from foveacam_server.resources.studying.studies.judged_clicks import FARTHEST_M, NEAREST_M

if TYPE_CHECKING:
    from playwright.sync_api import Page

SCENE = "bench"
"""The default scene of the server."""
BORDER_PX = 200.0
SEED = 21
SHAPE_S = 5.0
"""Longest time until the shape of an answer appears; not every answer has one."""
LOOK_AT_SHAPE_S = 3.0
"""Time between a shape and the next click: the browser draws it and flies there."""
_WATCH_CARD = """(patience_ms) => {
  const card = document.getElementById("fixation");
  const before = card.dataset.fixation;
  let [clicked_ms, estimated_ms] = [null, null];
  const click = (event) => { clicked_ms = event.timeStamp; };
  document.addEventListener("pointerdown", click, { capture: true, once: true });
  window.benchAnswer = new Promise((resolve) => {
    const observer = new MutationObserver(() => {
      const { fixation } = card.dataset;
      const estimate = card.querySelector("[data-role=estimate]:not(.quiet)");
      if (clicked_ms !== null && estimate?.checkVisibility()) estimated_ms ??= performance.now();
      if (clicked_ms === null || !fixation || fixation === before) return;
      const shown_ms = performance.now();
      observer.disconnect();
      estimated_ms ??= shown_ms;
      resolve({ fixation, clicked_ms, estimated_ms, shown_ms, origin_ms: performance.timeOrigin });
    });
    observer.observe(card, { attributes: true, childList: true, subtree: true });
    setTimeout(() => { observer.disconnect(); resolve(null); }, patience_ms);
  });
}"""
"""Sets `benchAnswer` to a promise of the fixation that the card shows after the next press.

`estimated_ms`: when the card showed the first number of it, an estimate or else the answer."""


def click_latency_figures(page: "Page", server: ServerProcess, pixels: list[tuple[float, float]]) -> Figures:
    """Click on wide pixels one after the other; return median, 90th percentile, and the parts' medians.

    An answer without a distance is timed like any other. `inferred_s_median`: of the answers inferred from
    their surroundings; null where none was.
    """
    clicks = [_click(page, server, pixel) for pixel in pixels]
    times = [parts for _, parts in clicks]
    total_s = [parts.pop("total") for parts in times]
    first_s = [parts.pop("first_estimate") for parts in times]
    inferred_s = [s for s, (basis, _) in zip(total_s, clicks, strict=True) if basis == Basis.SURROUNDINGS]
    return {
        "inferred_s_median": round(median(inferred_s), 3) if inferred_s else None,
        "clicks_inferred": len(inferred_s),
        "click_to_distance_s_median": round(median(total_s), 3),
        "first_estimate_s_median": round(median(first_s), 3),
        "click_to_distance_s_p90": round(float(np.quantile(total_s, 0.9)), 3),
        **{f"click_{part}_s": round(median(parts[part] for parts in times), 3) for part in times[0]},
    }


def field_pixels(count: int) -> list[tuple[float, float]]:
    """Return wide pixels of directions spread evenly over the steering field, whatever is there."""
    limit_rad = np.radians(FIELD_DEG)
    angles_rad = np.random.default_rng(SEED).uniform(-limit_rad, limit_rad, (count, 2))
    return [(x, y) for x, y in load_calibration(CERTIFICATE).wide.pixels(angles_rad).tolist()]


def textured_pixels(count: int) -> list[tuple[float, float]]:
    """Return wide pixels of textured points that both eyes see."""
    calibration, rng = load_calibration(CERTIFICATE), np.random.default_rng(SEED)
    size = np.array([calibration.wide.width, calibration.wide.height])
    found: list[tuple[float, float]] = []
    with open_simulated(scene=SCENE, inline=True) as rig:
        truth = truth_of(rig)
        while len(found) < count:
            x_px, y_px = rng.uniform(BORDER_PX, size - BORDER_PX).tolist()
            t_ns = rig.clock.now_ns()
            click = classify_click(truth, calibration, scene=SCENE, pixel=(x_px, y_px), t_ns=t_ns)
            if click is None or click.kind is not ClickKind.TEXTURED:
                continue
            if NEAREST_M <= click.range_m <= FARTHEST_M:
                found.append((x_px, y_px))
    return found


def _click(
    page: "Page", server: ServerProcess, pixel: tuple[float, float]
) -> tuple[str | None, dict[str, float]]:
    """Click on a wide pixel; return the answer's basis, and the time until it is shown with its parts, s."""
    position = page_position(page, *pixel)
    page.evaluate(_WATCH_CARD, 1e3 * PATIENCE_S)
    page.mouse.click(*position)
    answer = page.evaluate("benchAnswer")
    if answer is None:
        raise DeviceFault(f"a click on pixel {pixel} was not answered within {PATIENCE_S:.0f} s")
    fixation = server.send("GET", f"/fixations/{answer['fixation']}").json()
    if math.dist((fixation["request"]["pixel"]["x_px"], fixation["request"]["pixel"]["y_px"]), pixel) > 1.0:
        raise DeviceFault(f"the page showed another fixation than that of the click on pixel {pixel}")
    parts = _parts_s(answer, fixation, server.send("GET", f"/jobs/{fixation['job_id']}").json())
    wait_for_shape(page, server, fixation["id"])
    delete_targets(server)
    return fixation["basis"], parts


def wait_for_shape(page: "Page", server: ServerProcess, fixation_id: str) -> bool:
    """Wait until the shape of a fixation is computed and drawn; return False where it gets none."""
    shape_by_s = time.monotonic() + SHAPE_S
    wait_until(page, lambda: _has_shape(server, fixation_id) or time.monotonic() > shape_by_s)
    page.wait_for_timeout(1e3 * LOOK_AT_SHAPE_S)
    return _has_shape(server, fixation_id)


def delete_targets(server: ServerProcess) -> None:
    """Delete all targets with their shapes, so that a click beside one does not correct it."""
    for target in server.send("GET", "/targets").json():
        server.send("DELETE", f"/targets/{target['id']}")


def _has_shape(server: ServerProcess, fixation_id: str) -> bool:
    return any(cloud["fixation_id"] == fixation_id for cloud in server.clouds())


def _parts_s(answer: JsonObject, fixation: JsonObject, job: JsonObject) -> dict[str, float]:
    """Return the total time and its parts, s; the server's times have steps of 1 ms."""
    clicked_s = 1e-3 * (answer["origin_ms"] + answer["clicked_ms"])
    shown_s = 1e-3 * (answer["origin_ms"] + answer["shown_ms"])
    created_s, started_s, answered_s = (
        datetime.fromisoformat(utc).timestamp()
        for utc in (job["created_utc"], job["started_utc"], fixation["created_utc"])
    )
    loop_s = 1e-3 * fixation["duration_ms"]
    compute_s = 1e-3 * sum(step["compute_ms"] for step in fixation["steps"])
    return {
        "total": shown_s - clicked_s,
        "first_estimate": 1e-3 * (answer["estimated_ms"] - answer["clicked_ms"]),
        "send": created_s - clicked_s,
        "queue": started_s - created_s,
        "rig_access": answered_s - started_s - loop_s,
        "looks": loop_s - compute_s,
        "compute": compute_s,
        "show": shown_s - answered_s,
    }
