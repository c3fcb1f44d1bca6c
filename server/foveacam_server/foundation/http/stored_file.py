"""A response that sends a stored file, whole or by ranges, and raises `NotFound` where it was removed."""

import os
from typing import Any

from anyio import to_thread
from fastapi.responses import FileResponse
from starlette.types import Receive, Scope, Send

from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.http.answers import file_responses, problems


class StoredFile(FileResponse):
    """Sends a file; raises `NotFound` if it was removed since its lookup."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file, or the part of it that is asked for."""
        try:
            self.stat_result = await to_thread.run_sync(os.stat, self.path)
        except FileNotFoundError as error:
            raise NotFound(
                f"{scope['path']} was removed a moment ago",
                asked=scope["path"],
                found="its file is gone",
                remedy="list what there is, and ask for one of those",
            ) from error
        self.set_stat_headers(self.stat_result)
        await super().__call__(scope, receive, send)


def stored_file_responses(media_type: str) -> dict[int | str, dict[str, Any]]:  # Any: FastAPI's own type
    """Describe the answer of a route that sends a `StoredFile`, for OpenAPI."""
    return {**file_responses(media_type), **problems(416)}
