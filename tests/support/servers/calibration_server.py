"""A server in the room to calibrate in, in virtual time, and the steps that tests run in its sessions."""

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from foveacam_hardware.contract import Clock, Station, StationTarget, VirtualClock
from foveacam_hardware.rig import Rig
from foveacam_hardware.rig_config import SimulatedRigConfig
from foveacam_hardware.sim.rig import VIRTUAL_START_NS, simulated_rig
from foveacam_pipeline.calibrate.sweep import sweep_reference
from foveacam_server import app
from foveacam_server.assembly import first_services
from foveacam_server.foundation.events import Event
from tests.support.scenes.marker_room import changed_room, make_grey
from tests.support.servers.running_server import API, Running, running

PATIENCE_S = 200.0
LIVE_HZ = 0.1, 0.1
"""Of the live views, at which nobody looks; in virtual time a second of them comes soon again."""
WIDE_HZ = 3.0
"""Of the wide camera, which is looked at for as long as something is waited for."""


@dataclass
class CalibrationServer:
    """A server, and the sessions in its data directory."""

    server: Running
    data: Path

    @property
    def stations(self) -> list[Station]:
        """Where markers stand, the farthest first."""
        return [s for s in self.server.rig.stations if s.target is StationTarget.MARKERS]

    def begin(self, session_id: str, step: str, **options: object) -> dict[str, Any]:  # Any: a JSON document
        """Begin a step; return its job."""
        answer = self.server.post(
            f"/calibration_sessions/{session_id}/runs", {"step": step, "options": options}
        )
        assert answer.status_code == 202, answer.text
        job: dict[str, Any] = answer.json()
        assert answer.headers["Location"] == f"{API}/jobs/{job['id']}"
        return job

    @contextmanager
    def held_at(self, kind: str, *, step: str | None = None) -> Iterator[None]:
        """Hold the job that emits such an event (`step`: of that step) until the context ends."""
        events, reached, go_on = self.server.services.events, threading.Event(), threading.Event()
        emit = events.emit

        def emit_and_wait(emitted: str, message: str, **more: Any) -> Event:  # noqa: ANN401 - passed on
            event = emit(emitted, message, **more)
            if emitted == kind and step in (None, event.data.get("step")) and not reached.is_set():
                reached.set()
                go_on.wait(PATIENCE_S)
            return event

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(events, "emit", emit_and_wait)
            try:
                yield
            finally:
                go_on.set()

    def cancelled(
        self, session_id: str, step: str, at: str, *, at_step: str | None = None, **options: object
    ) -> dict[str, Any]:
        """Begin a step, cancel it at an event, and return the event's data."""
        before = self.server.last_event
        with self.held_at(at, step=at_step):
            job = self.begin(session_id, step, **options)
            data = self.server.wait_for_event(at, after=before, step=at_step)
            self.server.post(f"/jobs/{job['id']}/cancel")
        assert self.ended(job)["state"] == "cancelled"
        return data

    def ended(self, job: dict[str, Any]) -> dict[str, Any]:
        """Wait for a job to end, for so long and no longer."""
        asyncio.run(self.server.services.jobs.ended(job["id"], timeout_s=PATIENCE_S))
        return self.server.ended(job)

    def done(self, session_id: str, step: str, **options: object) -> dict[str, Any]:
        """Run a step to its end and return the session."""
        job = self.ended(self.begin(session_id, step, **options))
        assert job["state"] == "succeeded", job["problem"]
        return self.session(session_id)

    def session(self, session_id: str) -> dict[str, Any]:
        """Return a session."""
        found: dict[str, Any] = self.server.get(f"/calibration_sessions/{session_id}").json()
        return found


@contextmanager
def calibration_server(
    folder: Path, *, plain: bool = True, rig_file: str = ""
) -> Iterator[CalibrationServer]:
    """A server in virtual time: however busy this machine is, the boards are held long enough to be seen.

    The pictures are grey, and the room without texture (`plain`): both cost time, and few look at them. After
    a sweep the rig returns to two of its nodes instead of five.
    `rig_file`: what a rig file says beside the scene; without it the rig is as it ships.
    """
    clock, data = VirtualClock(VIRTUAL_START_NS), folder / "data"
    folder.mkdir(exist_ok=True)
    scene, file = changed_room(folder, plain=plain), folder / "rig.toml"
    if rig_file:
        file.write_text(f'kind = "simulated"\nscene = "{scene}"\n{rig_file}')
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(app, "MonotonicClock", lambda: clock)
        patch.setattr(first_services, "open_rig", _in_virtual_time)
        patch.setattr(sweep_reference, "CROSS", sweep_reference.CROSS[:2])
        with running(data, rig=str(file) if rig_file else "sim", scene=scene, live_hz=LIVE_HZ) as server:
            rig = server.rig
            server.services.hardware.submit(lambda _: _set_cameras(rig)).result(PATIENCE_S)
            yield CalibrationServer(server, data)


def _set_cameras(rig: Rig) -> None:
    """Let cameras cost little; in the thread that owns them, for an exposure under way would be lost."""
    make_grey(rig)
    rig.wide.configure(replace(rig.wide.settings, frame_rate_hz=WIDE_HZ))


def _in_virtual_time(config: SimulatedRigConfig, *, clock: Clock, **_given: object) -> Rig:
    """Open the simulated rig in this process, on a clock that nobody waits for."""
    return simulated_rig(config, clock=clock, inline=True)
