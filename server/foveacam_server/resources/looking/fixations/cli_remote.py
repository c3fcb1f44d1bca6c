"""`foveacam look --server`: a fixation of a running server, by the client."""

from foveacam_client import Rig, models
from foveacam_server.commands.options import RigOptions
from foveacam_server.commands.server_rig import server_rig
from foveacam_server.resources.looking.fixations.cli_order import LookOrder, print_answer, save_shape

WAIT_S = 120.0
"""Time for which the command waits for an answer."""


def run_look_at(rig_options: RigOptions, order: LookOrder, *, server: str) -> None:
    """Look with a server's rig; print the answer and save its shape."""
    request = models.FixationRequest.model_validate(order.request.as_json())
    with server_rig(server, token=rig_options.settings.token) as rig:
        started = rig.api.fixations.create(request)
        fixation = rig.wait(started, timeout_s=WAIT_S, cancel_on_interrupt=True)
        print_answer(order, fixation, as_json=rig_options.as_json)
        save_shape(order, fixation, lambda: _content(rig, order, fixation), as_json=rig_options.as_json)


def _content(rig: Rig, order: LookOrder, fixation: models.FixationDocument) -> bytes:
    """Return the shape's file, once the server has computed it."""
    points = rig.cloud(fixation)
    if order.file == "cloud.ply":
        return points.ply
    cloud_id = str(rig.api.fixations.get(fixation.id).cloud_id)
    clouds = rig.api.clouds
    return (clouds.glb if order.file == "mesh.glb" else clouds.depth_png)(cloud_id).read()
