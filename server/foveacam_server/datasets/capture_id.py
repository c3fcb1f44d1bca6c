"""The id of a capture in the path of a route."""

from typing import Annotated

from fastapi import Path

CaptureId = Annotated[str, Path(max_length=255)]
