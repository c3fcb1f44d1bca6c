"""Captures all followed targets at once: one look at each, kept as a dataset."""

from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass

from pydantic import JsonValue

from foveacam_hardware.contract import InvalidInput, Timeout
from foveacam_pipeline.capture.dataset import DatasetHeader
from foveacam_pipeline.capture.run.describe import conditions_document, rig_document
from foveacam_pipeline.track.round_writer import SeenTarget, target_conditions, write_round
from foveacam_server.datasets.collection import CAPTURES_URL, DatasetCollection
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.resources.looking.follows.schema import FollowRoundRequest, FollowRoundTaken
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_commands import answer_of
from foveacam_server.rig.ports import AssembledRig, CalibrationInForce

KIND = "follow_round"
ID_PREFIX = "cap-"
LONGEST_S = 30.0
"""Timeout of a round, during which another job may have the rig."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundTools:
    """Services that rounds need. `take`: requests one look at each followed target."""

    take: Callable[[], "Future[list[SeenTarget]]"]
    collection: DatasetCollection
    hardware: HardwareThread
    calibration: CalibrationInForce
    jobs: JobRunner
    events: EventLog


class FollowRounds:
    """Captures rounds as jobs that run while following continues."""

    def __init__(self, tools: RoundTools) -> None:
        self._tools = tools
        tools.jobs.handle(KIND, self._work, parallel=True)

    def start(self, request: FollowRoundRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a round; raise `InvalidInput` for a name that cannot be used."""
        if not self._tools.jobs.has_key(idempotency_key):
            self._tools.collection.new_folder(request.name)
        return self._tools.jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def get(self, capture_id: str) -> FollowRoundTaken:
        """Return the round that was captured under an id."""
        found = self._tools.collection.get(capture_id)
        targets = 0 if found.dataset is None else len(found.dataset)
        return FollowRoundTaken(capture_id=found.id, name=found.name, targets=targets)

    def _work(self, context: JobContext) -> str:
        tools, request = self._tools, context.job.parse_request(FollowRoundRequest)
        seen = self._seen()
        context.check()
        folder = tools.collection.new_folder(request.name)
        rig, conditions = answer_of(tools.hardware.submit(_described), asked="the rig's settings")
        capture_id = ID_PREFIX + context.job.id.partition("-")[2]
        header = DatasetHeader(
            id=capture_id,
            points=len(seen),
            plan={"format": "foveacam-follow-round"},
            rig=rig,
            conditions={**conditions, "targets": target_conditions(seen)},
            calibration=tools.calibration.current,
            label=request.label,
        )
        write_round(folder, seen, header)
        data = FollowRoundTaken(capture_id=capture_id, name=folder.name, targets=len(seen))
        tools.events.emit(
            "follow.round", f"round {folder.name}: {len(seen)} targets were captured", data=data
        )
        return f"{CAPTURES_URL}/{capture_id}"

    def _seen(self) -> list[SeenTarget]:
        asked = self._tools.take()
        try:
            seen = asked.result(LONGEST_S)
        except FutureTimeout:
            asked.cancel()
            raise Timeout(
                f"asked for one look at each followed target: not made within {LONGEST_S:g} s; wait until no "
                "other job has the rig"
            ) from None
        if not seen:
            raise InvalidInput("no followed target could be looked at; follow one that both eyes reach")
        return seen


def _described(rig: AssembledRig) -> tuple[dict[str, JsonValue], dict[str, JsonValue]]:
    return rig_document(rig), conditions_document(rig)
