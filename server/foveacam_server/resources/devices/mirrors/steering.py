"""The steering WebSocket and one client's session: turns messages into targets, reports the state."""

import asyncio
import math
from dataclasses import dataclass

from fastapi import WebSocket, WebSocketDisconnect

from foveacam_hardware.contract import Busy, FoveaError, InvalidInput, StereoVolts
from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.errors import AllTaken, PersonLimit
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.http.answers import server_places
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.foundation.persons.person_quota import PERSON, close_of
from foveacam_server.resources.devices.mirrors import steering_messages as messages
from foveacam_server.resources.devices.mirrors.routes import OverlayDistance
from foveacam_server.resources.devices.mirrors.targets import gaze_volts, volts_of
from foveacam_server.rig.hand_steering import SteeringCourse, SteeringStatus
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import CalibrationInForce
from foveacam_server.rig.refusals import check_volts
from foveacam_server.rig.stream import MessageStream

STATE_PERIOD_S, REST_PERIOD_S = 0.1, 0.5
"""Periods of the state's reports, while the mirrors are steered and otherwise."""
FIRST_MESSAGE_S = 10.0
_POLICY_VIOLATION = 1008

router = GuardedRouter(tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


@dataclass(frozen=True, slots=True)
class SteeringServices:
    """Services that a steering session needs."""

    hardware: HardwareThread
    calibration: CalibrationInForce
    overlay: OverlayDistance
    lease: Lease
    events: EventLog


class SteeringSession:
    """Serves one client of the steering socket; to be used on the event loop only.

    After a stop, a job, a fault or silence, nothing moves until the client has released and pressed again.
    """

    def __init__(self, services: SteeringServices, wire: MessageStream) -> None:
        self._services = services
        self._hand = services.hardware.hand
        self._wire = wire
        self._begin = messages.Begin(type="begin")
        self._course: SteeringCourse | None = None
        self._barred: str | None = None
        """Why the client must release before it can steer again."""
        self._refused: str | None = None
        self._wakeup = asyncio.Event()

    async def run(self) -> None:
        """Serve the client until it disconnects; raise `FoveaError` when its first message is refused."""
        await self._begin_with(await self._first())
        tasks = [asyncio.create_task(self._listen()), asyncio.create_task(self._send_states())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            if self._course is not None:
                self._hand.lose(self._course)

    async def _first(self) -> messages.Begin:
        async with asyncio.timeout(FIRST_MESSAGE_S):
            message = messages.parse(await self._wire.receive_text())
        if not isinstance(message, messages.Begin):
            raise InvalidInput(
                "asked to steer without a first message that begins", remedy='send {"type":"begin"} first'
            )
        return message

    async def _begin_with(self, begin: messages.Begin) -> None:
        self._begin = begin
        calibrated = self._services.calibration.current is not None
        await self._wire.send_text(
            messages.hello(max_v=self._services.hardware.status.max_v, calibrated=calibrated)
        )

    # Messages of the client --------------------------------------------------------------------------------

    async def _listen(self) -> None:
        while True:
            text = await self._wire.receive_text()
            try:
                message = messages.parse(text)
                if isinstance(message, messages.Begin):
                    await self._begin_with(message)
                else:
                    self._obey(message)
            except FoveaError as error:
                self._refused = messages.problem(error)
            self._wakeup.set()

    def _obey(self, message: messages.Steer) -> None:
        self._note_end()
        if self._barred is not None:
            if message.held:
                return
            self._barred, self._course = None, None
        self._check_lease()
        course = self._course
        if course is None or not course.held:
            if message.held or message.volts is not None or message.gaze is not None:
                self._press(message)
            return
        self._hand.record_message(course)  # the client is alive, whether or not its target is refused
        self._hand.record_message(course, self._target(message, before=course.target))
        if not message.held:
            self._hand.release(course)

    def _check_lease(self) -> None:
        try:
            self._services.lease.check(self._begin.lease)
        except Busy as error:
            if self._course is not None:
                self._hand.end(self._course, error.found or str(error))
            self._barred = error.found
            raise

    def _press(self, message: messages.Steer) -> None:
        target = self._target(message, before=self._services.hardware.gaze)
        name = self._begin.name
        try:
            self._course = self._hand.press(name, target, held=message.held)
        except FoveaError as error:
            self._barred = error.found if message.held else None
            raise
        self._services.events.emit("mirrors.steered", f"{name} steers by hand")

    def _target(self, message: messages.Steer, *, before: StereoVolts) -> StereoVolts:
        services = self._services
        if message.gaze is not None:
            volts = gaze_volts(message.gaze, services.calibration.require())
            services.overlay.look_at_distance(message.gaze.distance_m or math.inf)
        elif message.volts is not None:
            volts = volts_of(message.volts, before=before)
        else:
            return before
        check_volts(volts, max_v=services.hardware.status.max_v)
        return volts

    def _note_end(self) -> None:
        course = self._course
        if course is not None and course.over is not None and self._barred is None:
            self._barred = course.over

    # Reports to the client ---------------------------------------------------------------------------------

    async def _send_states(self) -> None:
        while True:
            self._wakeup.clear()
            if self._refused is not None:
                refused, self._refused = self._refused, None
                await self._wire.send_text(refused)
            status = self._status()
            await self._wire.send_text(self._state(status))
            active = status in (SteeringStatus.STEERING, SteeringStatus.SILENT)
            await self._pause(status, STATE_PERIOD_S if active else REST_PERIOD_S)

    async def _pause(self, sent: SteeringStatus, wait_s: float) -> None:
        """Wait until the next report is due: the steering period, or longer while nothing changes."""
        await asyncio.sleep(STATE_PERIOD_S)
        if self._status() is sent and self._refused is None and wait_s > STATE_PERIOD_S:
            try:
                async with asyncio.timeout(wait_s - STATE_PERIOD_S):
                    await self._wakeup.wait()
            except TimeoutError:
                return

    def _status(self) -> SteeringStatus:
        self._note_end()
        if self._barred is not None:
            return SteeringStatus.ENDED
        if self._course is None:
            return SteeringStatus.RELEASED
        return self._hand.status(self._course)

    def _state(self, status: SteeringStatus) -> str:
        course = self._course
        return messages.state(
            status=status.value,
            reason=self._barred,
            by=self._hand.by,
            pose=self._services.hardware.pose,
            target=None if course is None else course.target,
            gaze_rad=self._gaze_rad(),
        )

    def _gaze_rad(self) -> tuple[float, float] | None:
        """Return the mean direction of both eyes; None while it is unknown."""
        pose, calibration = self._services.hardware.pose, self._services.calibration.current
        if pose is None or calibration is None:
            return None
        (left_x, left_y), (right_x, right_y) = calibration.gaze_rad(pose)
        return 0.5 * (left_x + right_x), 0.5 * (left_y + right_y)


@router.websocket("/mirrors/steering")
@needs(Right.OPERATE)
async def steering_socket(
    websocket: WebSocket,
    hardware: Provided[HardwareThread],
    calibration: Provided[CalibrationInForce],
    overlay: Provided[OverlayDistance],
    lease: Provided[Lease],
    events: Provided[EventLog],
) -> None:
    """Let one client steer both mirrors by hand."""
    services = SteeringServices(hardware, calibration, overlay, lease, events)
    places = await server_places(websocket)
    await websocket.accept()
    try:
        with places.steering.hold(PERSON.get()):
            await SteeringSession(services, websocket).run()
    except (AllTaken, PersonLimit) as refusal:
        await websocket.close(*close_of(refusal))
    except FoveaError as error:
        await websocket.send_text(messages.problem(error))
        await websocket.close(_POLICY_VIOLATION, "the first message was refused")
    except TimeoutError:
        await websocket.close(_POLICY_VIOLATION, "no first message came")
    except WebSocketDisconnect:
        return  # the client has left
