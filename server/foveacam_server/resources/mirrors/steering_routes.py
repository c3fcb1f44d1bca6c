"""Route of the steering socket: moves the mirrors by hand, message after message."""

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from foveacam_hardware.contract import FoveaError
from foveacam_server.foundation.answers import opened_services
from foveacam_server.resources.mirrors import steering_messages
from foveacam_server.resources.mirrors.routes import MirrorRouteServices
from foveacam_server.resources.mirrors.steering import SteeringSession

router = APIRouter(tags=["rig"])

_POLICY_VIOLATION = 1008


@router.websocket("/mirrors/steering")
async def steering_socket(websocket: WebSocket) -> None:
    """Let one client steer both mirrors by hand."""
    services: MirrorRouteServices = await opened_services(websocket)  # type: ignore[assignment]  # app.state is untyped
    await websocket.accept()
    try:
        await SteeringSession(services, websocket).run()
    except FoveaError as error:
        await websocket.send_text(steering_messages.problem(error))
        await websocket.close(_POLICY_VIOLATION, "the first message was refused")
    except TimeoutError:
        await websocket.close(_POLICY_VIOLATION, "no first message came")
    except WebSocketDisconnect:
        return  # the client has left
