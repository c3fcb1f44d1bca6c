"""Takes one picture of a found camera: the open rig's newest, or by opening the camera briefly."""

import threading
from typing import Protocol

from foveacam_hardware.contract import Clock, NotConnected
from foveacam_hardware.device_trials import named_camera, take_picture
from foveacam_server.resources.devices.rig_setup.found_devices import DeviceSearch
from foveacam_server.resources.devices.rig_setup.schema import SIMULATED, CameraKind
from foveacam_server.rig.encoder import encode_jpeg
from foveacam_server.rig.status import RigStatus
from foveacam_server.rig.view_state import ViewPicture


class NewestPictures(Protocol):
    """The newest picture of each view."""

    def newest(self, view: str) -> ViewPicture | None:
        """Return the newest picture of a view; None before the first."""
        ...


class CameraPictures:
    """Takes one picture at a time; blocks for seconds, so not to be called on the event loop."""

    def __init__(self, views: NewestPictures, search: DeviceSearch, *, clock: Clock) -> None:
        self._views = views
        self._search = search
        self._clock = clock
        self._one_at_a_time = threading.Lock()

    def take(self, kind: CameraKind, name: str, status: RigStatus) -> bytes:
        """Return a picture as JPEG, at half size for a camera of the open rig.

        Raise `NotFound` for a camera that is not there, `NotConnected` for one in use by another program.
        """
        view = _view_of(kind, name, status)
        if view is not None:
            return self._of_view(view)
        with self._one_at_a_time:
            self._search.require_camera(kind, name)
            image, bits = take_picture(named_camera(kind, name), clock=self._clock)
        return encode_jpeg(image, bits=bits)

    def _of_view(self, view: str) -> bytes:
        picture = self._views.newest(view)
        if picture is None:
            raise NotConnected(
                f"camera {view} is open in this rig and has sent no picture yet; a fovea waits for the"
                " controller's pulse"
            )
        return encode_jpeg(picture.image, bits=picture.bits, reduction=2)


def _view_of(kind: CameraKind, name: str, status: RigStatus) -> str | None:
    """Return the view of a camera of the open rig; None for any other camera."""
    for camera in status.cameras:
        mine = camera.role.value if status.simulated else camera.info.serial
        if (kind == SIMULATED) == status.simulated and mine == name and camera.connected:
            return camera.role.value
    return None
