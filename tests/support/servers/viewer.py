"""The viser server of a scene that is open."""

import viser

from foveacam_web.scene import ViewerScene


def viewer_of(scene: ViewerScene) -> viser.ViserServer:
    """Return the server, whose scene and clients a test looks at."""
    assert scene._server is not None
    return scene._server
