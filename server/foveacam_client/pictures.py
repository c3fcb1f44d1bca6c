"""Pictures as arrays; needs numpy and OpenCV, which the package itself does not."""

from typing import TYPE_CHECKING, Any, Literal

from foveacam_client.problems import ClientError, UnexpectedAnswer

if TYPE_CHECKING:
    from numpy.typing import NDArray

JPEG_QUALITY = 80
UNCHANGED_BYTES = 50_000
"""A picture up to this size is shown as it is where there is no OpenCV to shrink it."""


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


def shrunk_picture(content: bytes, *, width_px: int, form: Literal["jpg", "png"]) -> bytes | None:
    """Return a picture at most so wide; without OpenCV as it is, or None where it is large."""
    try:
        import cv2
        import numpy as np
    except ImportError:
        return content if len(content) <= UNCHANGED_BYTES else None
    found = cv2.imdecode(
        np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    )
    if found is None:
        raise UnexpectedAnswer("the picture is neither JPEG nor PNG")
    height, width = found.shape[:2]
    if width > width_px:
        size = width_px, max(1, round(height * width_px / width))
        found = cv2.resize(found, size, interpolation=cv2.INTER_AREA)
    options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if form == "jpg" else []
    return cv2.imencode(f".{form}", found, options)[1].tobytes()
