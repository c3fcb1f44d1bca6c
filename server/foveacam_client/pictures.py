"""Pictures as arrays; needs numpy and OpenCV, which the package itself does not."""

from typing import TYPE_CHECKING, Any

from foveacam_client.problems import ClientError, UnexpectedAnswer

if TYPE_CHECKING:
    from numpy.typing import NDArray


def decode_picture(content: bytes) -> "NDArray[Any]":  # Any: uint8, or uint16 of a 16-bit PNG
    """Return a JPEG or PNG picture: (h, w) or (h, w, 3), RGB."""
    try:
        import cv2
        import numpy as np
    except ImportError as error:
        raise ClientError(
            "pictures as arrays need numpy and OpenCV: pip install numpy opencv-python-headless"
        ) from error
    found = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if found is None:
        raise UnexpectedAnswer("the picture is neither JPEG nor PNG")
    return found if found.ndim == 2 else cv2.cvtColor(found, cv2.COLOR_BGR2RGB)
