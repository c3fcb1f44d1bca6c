"""The console's own files: the page, the video pane alone, and what they load."""

from pathlib import Path

from fastapi import APIRouter, FastAPI
from fastapi.responses import FileResponse
from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

import foveacam_web

router = APIRouter(include_in_schema=False)

STATIC = Path(foveacam_web.__file__).parent / "static"

NO_STALE_PAGES = {"Cache-Control": "no-cache"}
"""The browser asks each time whether its copy is still the newest: page and server are of one version."""


class _FreshFiles(StaticFiles):
    """Files that no browser uses unasked: a module of yesterday must not meet one of today."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers.update(NO_STALE_PAGES)
        return response


@router.get("/")
async def console() -> FileResponse:
    """Return the console."""
    return FileResponse(STATIC / "index.html", headers=NO_STALE_PAGES)


@router.get("/view")
async def video_pane() -> FileResponse:
    """Return the video pane alone, for the panel in the 3D pane."""
    return FileResponse(STATIC / "view.html", headers=NO_STALE_PAGES)


@router.get("/favicon.ico")
async def icon() -> FileResponse:
    """Return the icon that browsers ask for by themselves."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml", headers=NO_STALE_PAGES)


def install(app: FastAPI) -> None:
    """Serve the page, and the files that it loads."""
    app.include_router(router)
    app.mount("/static", _FreshFiles(directory=STATIC, check_dir=False), name="static")
