"""Activities of people and services, and mishaps, in an hour of a rig; each leaves it ready for the next."""

import asyncio
import contextlib
import itertools
import random
import time
from collections.abc import Callable
from typing import TypeAlias

from foveacam_bench.small_disk import SmallDisk
from foveacam_bench.soak.soaked_server import SoakedServer
from foveacam_bench.soak.tally import SoakTally, run_job
from foveacam_bench.stream.clients import StreamViewer
from foveacam_server.foundation.http.addresses import websocket_address

FIELD_PX = ((300.0, 1140.0), (250.0, 830.0))
GRID_DEG = 2.0
RECORDED_S, FOLLOWED_S, SHOWN_S, STOPPED_S = 2.0, 1.0, 1.0, 0.2
LEASE_IDLE_S = 601.0
"""A lease ends after ten minutes without a request."""
SUCCEEDED = {"succeeded"}
Activity: TypeAlias = Callable[["Soak"], None]


class Soak:
    """The server under test, what happened to it so far, and a disk that can be filled."""

    def __init__(self, server: SoakedServer, *, seed: int, disk: SmallDisk | None) -> None:
        self.server = server
        self.rng = random.Random(seed)  # noqa: S311 - not a secret
        self.disk = disk
        self.tally = SoakTally()
        self._numbers = itertools.count(1)

    def pixel(self) -> dict[str, float]:
        """Return a place of the wide view that both eyes reach."""
        (left, right), (top, bottom) = FIELD_PX
        return {"x_px": self.rng.uniform(left, right), "y_px": self.rng.uniform(top, bottom)}

    def name(self, what: str) -> str:
        """Return a name that was not used before."""
        return f"{what} {next(self._numbers):05d}"

    def be_ready(self) -> None:
        """Wait until the rig is usable: all devices are there, and no job uses them."""
        self.server.wait_until(self._is_ready, "a rig that is ready")

    def _is_ready(self) -> bool:
        if self.server.get("/rig")["state"] != "ready":
            return False
        return all(job["ended_utc"] is not None for job in self.server.get("/jobs"))


def click(soak: Soak) -> None:
    """Verge on a place; a place without texture is an accepted answer too."""
    began_s = time.perf_counter()
    answer = soak.server.send("POST", "/fixations", {"pixel": soak.pixel()}, {"Prefer": "wait=60"})
    soak.tally.click_ms.append(1e3 * (time.perf_counter() - began_s))
    soak.tally.expect("click", answer, 200)


def raster(soak: Soak) -> None:
    """Capture nine points."""
    grid = {"kind": "grid", "columns": 3, "rows": 3, "half_width_deg": GRID_DEG, "half_height_deg": GRID_DEG}
    plan = {"points": grid, "verging": {"mode": "given", "distance_m": 2.0}}
    body = {"name": soak.name("raster"), "plan": plan}
    run_job(soak.tally, soak.server, "raster", "/captures", body, states=SUCCEEDED)


def recording(soak: Soak) -> None:
    """Record all cameras."""
    body = {"name": soak.name("recording"), "duration_s": RECORDED_S, "rate": "live"}
    run_job(soak.tally, soak.server, "recording", "/recordings", body, states=SUCCEEDED)


def still(soak: Soak) -> None:
    """Take a still and keep it."""
    body = {"name": soak.name("still"), "save": True}
    run_job(soak.tally, soak.server, "still", "/stills", body, states=SUCCEEDED)


def drift(soak: Soak) -> None:
    """Check the calibration after the hours that have passed."""
    run_job(soak.tally, soak.server, "drift", "/drift_checks", {}, states=SUCCEEDED)


def knock(soak: Soak) -> None:
    """Somebody bumps into a mount; a check sees it, and the mount is put back."""
    knocked = {"shift_x_deg": soak.rng.uniform(0.05, 0.1)}
    body = {soak.rng.choice(("knocked_left", "knocked_right")): knocked}
    soak.tally.expect("knock", soak.server.send("PUT", "/simulation/faults", body), 200)
    run_job(soak.tally, soak.server, "knock", "/drift_checks", {}, states=SUCCEEDED)
    soak.server.send("DELETE", "/simulation/faults")


def unplug(soak: Soak) -> None:
    """A camera is unplugged and returns; without both foveae the mirrors are at rest."""
    both = soak.rng.random() < 0.5
    names = ["left", "right"] if both else [soak.rng.choice(("wide", "left", "right"))]
    soak.tally.expect("unplug", soak.server.send("PUT", "/simulation/faults", {"unplugged": names}), 200)
    server = soak.server
    server.wait_until(lambda: server.get("/rig")["state"] == "degraded", "a report of the camera")
    if both:
        time.sleep(STOPPED_S)
        server.require_rest(True)
        time.sleep(STOPPED_S)
        server.require_rest(False)
    server.send("DELETE", "/simulation/faults")


def stop(soak: Soak) -> None:
    """Stop the mirrors, check that they are at rest, and release the stop."""
    click(soak)
    answer = soak.server.send("POST", "/stop")
    if soak.tally.expect("stop", answer, 200) and answer.json()["parked"] is not True:
        soak.tally.unexpected["stop: not parked"] += 1
    soak.server.require_rest(True)
    time.sleep(STOPPED_S)
    soak.server.require_rest(False)
    soak.server.send("DELETE", "/stop")


def follow(soak: Soak) -> None:
    """Follow two places for a while; one without texture is refused."""
    for _ in range(2):
        answer = soak.server.send("POST", "/follows", {"pixel": soak.pixel()})
        soak.tally.expect("follow", answer, 201, 409, 422)
    time.sleep(FOLLOWED_S)
    soak.server.send("DELETE", "/follows")


def loop(soak: Soak) -> None:
    """Keep both eyes on a place for a while; one without texture is refused."""
    soak.tally.expect("loop", soak.server.send("POST", "/loop", {"pixel": soak.pixel()}), 200, 409, 422)
    time.sleep(FOLLOWED_S)
    soak.server.send("DELETE", "/loop")


def viewers(soak: Soak) -> None:
    """Three browsers open the live views and go away."""

    async def show() -> None:
        url = websocket_address(soak.server.url, "/api/v1/views/ws")
        streams = [StreamViewer(url, choice={"wide": 2, "left": 2, "right": 2}) for _ in range(3)]
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(SHOWN_S):
                await asyncio.gather(*(stream.watch() for stream in streams))
        if not all(stream.arrivals for stream in streams):
            soak.tally.unexpected["viewers: no picture"] += 1

    asyncio.run(show())


def lease(soak: Soak) -> None:
    """A service takes the lease and sends nothing more: after ten minutes another one gets it."""
    server = soak.server
    soak.tally.expect("lease", server.send("POST", "/lease", {"holder": "silent service"}), 200)
    server.skip(LEASE_IDLE_S)
    answer = server.send("POST", "/lease", {"holder": "next service"})
    if soak.tally.expect("lease", answer, 200):
        server.send("DELETE", "/lease", headers={"X-Lease": answer.json()["token"]})


def full_disk(soak: Soak) -> None:
    """The disk is full: requests that write are refused or end early, and work again afterwards."""
    if soak.disk is None:
        return
    soak.disk.fill()
    answer = soak.server.send("POST", "/recordings", {"name": "no room", "duration_s": RECORDED_S})
    soak.tally.expect("full disk", answer, 507)
    click(soak)
    soak.disk.free()
    recording(soak)


def tidy(soak: Soak) -> None:
    """Delete permanently what the hour has produced."""
    for kind in ("captures", "recordings", "stills"):
        for found in soak.server.get(f"/{kind}"):
            answer = soak.server.send("DELETE", f"/{kind}/{found['id']}")
            soak.tally.expect(f"tidy {kind}", answer, 200, 204)
        soak.tally.expect(f"tidy {kind}", soak.server.send("DELETE", f"/{kind}/trash"), 200)
    for kind in ("targets", "clouds"):
        for found in soak.server.get(f"/{kind}"):
            soak.server.send("DELETE", f"/{kind}/{found['id']}")
