"""Adds, describes, changes and ends the following of targets."""

import itertools
from concurrent.futures import Future

from foveacam_hardware.contract import Busy, Frame, InvalidInput, Role
from foveacam_pipeline.capture.recording.values import STREAM_OF_ROLE, TrackedBox
from foveacam_pipeline.track.round_writer import SeenTarget
from foveacam_pipeline.verge.values import Target
from foveacam_server.foundation.names import new_id
from foveacam_server.resources.looking.fixations.request import check_target, target_of
from foveacam_server.resources.looking.fixations.schema import FixationRequest
from foveacam_server.resources.looking.follows.first_look import sides_px, track_click
from foveacam_server.resources.looking.follows.follow_job import FollowJob, FollowTools, change_of
from foveacam_server.resources.looking.follows.followed import FollowedRecord, position_at, wide_place_px
from foveacam_server.resources.looking.follows.records import FollowedRecords
from foveacam_server.resources.looking.follows.schema import (
    FollowedDocument,
    FollowPatch,
    FollowRequest,
    TrailPoint,
)
from foveacam_server.rig.schema import Direction, FollowMark


class FollowService:
    """The followed targets; callable from any thread."""

    def __init__(self, tools: FollowTools) -> None:
        self._tools = tools
        self._records = FollowedRecords()
        self._job = FollowJob(tools, self._records)
        self._numbers = itertools.count(1)

    @property
    def following(self) -> bool:
        """Whether any target is followed."""
        return bool(self._records)

    def follow(self, request: FollowRequest) -> FollowedDocument:
        """Follow a further target; raise at once where that is not possible now."""
        tools, calibration = self._tools, self._tools.calibration.require()
        target = self._target(request)
        check_target(target, calibration)
        tools.hardware.check_may_move()
        if tools.looping():
            raise Busy(
                "the vergence loop has the eyes",
                found="a running loop",
                remedy="end it first: DELETE /api/v1/loop",
            )
        record = FollowedRecord(
            id=new_id("fol"),
            label=request.label or self._label(request),
            target=target,
            box_px=sides_px(target, request.box_px),
            tracker=request.tracker,
            priority=request.priority,
            click=track_click(
                tools.hardware.recent_wide,
                target,
                frame_seq=request.frame_seq,
                box_px=request.box_px,
                now_ns=tools.clock.now_ns(),
            ),
        )
        self._records.add(record)
        tools.events.emit("follow.started", f"{record.label} will be followed", data=change_of(record))
        self._job.begin()
        return self.get(record.id)

    def every(self) -> list[FollowedDocument]:
        """Return all followed targets as they are now, oldest first."""
        calibration, now_ns = self._tools.calibration.current, self._tools.clock.now_ns()
        with self._records.all() as records:
            return [record.describe(calibration, now_ns=now_ns) for record in records.values()]

    def get(self, follow_id: str) -> FollowedDocument:
        """Return a followed target as it is now, or raise `NotFound`."""
        with self._records.one(follow_id) as record:
            return record.describe(self._tools.calibration.current, now_ns=self._tools.clock.now_ns())

    def trail(self, follow_id: str) -> list[TrailPoint]:
        """Return a followed target's last hits, or raise `NotFound`."""
        with self._records.one(follow_id) as record:
            return record.trail()

    def change(self, follow_id: str, patch: FollowPatch) -> FollowedDocument:
        """Change label, tracker or priority, or raise `NotFound`."""
        self._records.change(follow_id, lambda record: record.take(patch))
        return self.get(follow_id)

    def end(self, follow_id: str) -> None:
        """Stop following a target, or raise `NotFound`."""
        self.get(follow_id)
        self._job.drop(follow_id, "on request")

    def end_all(self) -> None:
        """Stop following all targets."""
        self._job.drop_all("on request")

    def check_followed(self) -> None:
        """Raise `Busy` while no target is followed."""
        with self._records.all() as records:
            followed = any(record.report is not None for record in records.values())
        if not followed:
            raise Busy(
                "no target is followed now",
                found="no followed target",
                remedy="follow one first: POST /api/v1/follows",
            )

    def take_round(self) -> "Future[list[SeenTarget]]":
        """Request one look at each target within reach, made between the ordinary looks."""
        return self._job.take_round()

    def marks(self) -> list[FollowMark]:
        """Return the marks of the targets in the wide view now."""
        return [
            FollowMark(
                id=record.id, label=record.label, state=record.state, x_px=round(x_px, 1), y_px=round(y_px, 1)
            )
            for record, (x_px, y_px) in self._places(self._tools.clock.now_ns())
        ]

    def boxes(self, frame: Frame) -> list[TrackedBox]:
        """Return the boxes of the targets in a wide frame; a lost target has none."""
        found = []
        for record, (x_px, y_px) in self._places(frame.t_ns):
            width, height = record.box_px
            box = (x_px - width / 2.0, y_px - height / 2.0, float(width), float(height))
            found.append(
                TrackedBox(
                    slot=record.label,
                    t_ns=frame.t_ns,
                    bbox_px=box if record.state == "followed" else None,
                    frames={STREAM_OF_ROLE[Role.WIDE]: frame.seq},
                )
            )
        return found

    def _places(self, t_ns: int) -> list[tuple[FollowedRecord, tuple[float, float]]]:
        """Return the targets inside the wide view at a time, with their wide pixels."""
        calibration = self._tools.calibration.current
        if calibration is None or not self._records:
            return []
        with self._records.all() as records:
            known = [(record, record.report) for record in records.values()]
        places = [
            (record, wide_place_px(calibration, position_at(report.estimate, t_ns)))
            for record, report in known
            if report is not None
        ]
        return [(record, pixel) for record, pixel in places if pixel is not None]

    def _target(self, request: FollowRequest) -> Target:
        """Return the target of a request; raise `InvalidInput`, or `NotFound` for an unknown target."""
        places = {"pixel": request.pixel, "rectangle": request.rectangle, "direction": request.direction}
        if request.target_id is None:
            return target_of(FixationRequest.model_validate(places))
        if any(one is not None for one in places.values()):
            raise InvalidInput(
                "a followed target is named by target_id or by a place, found both",
                asked="a target to follow",
                found="two targets",
                remedy="send one of them",
            )
        place = self._tools.targets.get(request.target_id).fixation.target
        direction = Direction(ax_deg=place.ax_deg, ay_deg=place.ay_deg)
        return target_of(FixationRequest(direction=direction))

    def _label(self, request: FollowRequest) -> str:
        """Return the label of a target of an earlier fixation, or a new default label."""
        if request.target_id is not None:
            return self._tools.targets.get(request.target_id).label
        return f"Followed {next(self._numbers)}"
