"""Routes of displays: screens that show a calibration pattern at its true size, and that pattern."""

from typing import Annotated

from fastapi import Path, Query
from fastapi.responses import Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter, needs
from foveacam_server.foundation.http.answers import LeaseHeader, file_responses, problems
from foveacam_server.foundation.http.provided import Provided
from foveacam_server.foundation.lease import Lease
from foveacam_server.resources.devices.displays.schema import (
    DisplayDocument,
    DisplayId,
    DisplayRequest,
    PatternDocument,
    PrintQuery,
    ShownPattern,
)
from foveacam_server.resources.devices.displays.service import PatternDisplayService

router = GuardedRouter("/displays", tags=["calibrations"], reading=Right.VIEW, changing=Right.OPERATE)


DisplayIdPath = Annotated[DisplayId, Path(description="what the screen calls itself, hexadecimal")]


@router.get("", summary="Connected displays")
async def connected(displays: Provided[PatternDisplayService]) -> list[DisplayDocument]:
    """Return the screens that show the pattern; a screen silent for 15 s is left out."""
    return displays.connected()


@router.get("/pattern", summary="The pattern of the displays")
async def pattern(displays: Provided[PatternDisplayService]) -> PatternDocument:
    """Return the pattern that all screens show."""
    return displays.pattern()


@router.put("/pattern", summary="Show a pattern", responses=problems(409))
def show(
    request: ShownPattern,
    lease: Provided[Lease],
    displays: Provided[PatternDisplayService],
    x_lease: LeaseHeader = None,
) -> PatternDocument:
    """Show a pattern at its true size on all screens, now and after a restart."""
    lease.check(x_lease)
    return displays.show(request)


@router.get(
    "/pattern.svg",
    summary="The pattern as SVG",
    response_class=Response,
    responses=file_responses("image/svg+xml"),
)
def svg(displays: Provided[PatternDisplayService]) -> Response:
    """Return the pattern at its true size in millimetres, for screens and printers."""
    return Response(displays.svg(), media_type="image/svg+xml")


@router.get(
    "/pattern.pdf",
    summary="A pattern as PDF",
    response_class=Response,
    responses=file_responses("application/pdf"),
)
def pdf(displays: Provided[PatternDisplayService], query: Annotated[PrintQuery, Query()]) -> Response:
    """Return the pattern of the query (without `kind`, that of the displays), to be printed at 100 %.

    A pattern larger than the paper is split over up to nine sheets, with crop marks.
    """
    printed = displays.print(query)
    headers = {"Content-Disposition": f'attachment; filename="{printed.file_name}"'}
    return Response(printed.content, media_type="application/pdf", headers=headers)


@router.put("/{display_id}", summary="Register a display", responses=problems(409))
@needs(Right.VIEW)
async def register(
    display_id: DisplayIdPath, request: DisplayRequest, displays: Provided[PatternDisplayService]
) -> PatternDocument:
    """Register a screen or renew its registration, to be repeated within 15 s; return its pattern."""
    return displays.register(display_id, request)


@router.delete("/{display_id}", status_code=204, summary="Remove a display from the list")
@needs(Right.VIEW)
async def forget(display_id: DisplayIdPath, displays: Provided[PatternDisplayService]) -> None:
    """Remove a screen that no longer shows the pattern from the list."""
    displays.forget(display_id)
