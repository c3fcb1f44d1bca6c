"""Routes of the list of rigs: one address for a whole lab."""

from typing import Annotated, Protocol

from fastapi import Depends
from fastapi.responses import Response

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import opened_services, problems
from foveacam_server.resources.operating.rigs.schema import RigEntry
from foveacam_server.resources.operating.rigs.service import RigDirectory

router = GuardedRouter("/rigs", tags=["rig"], reading=Right.VIEW, changing=Right.OPERATE)


class RigListServices(Protocol):
    """Services that these routes use."""

    rigs: RigDirectory


ServicesDep = Annotated[RigListServices, Depends(opened_services)]


@router.get("", summary="This rig, and the others of the lab")
async def rigs(services: ServicesDep) -> list[RigEntry]:
    """Return this rig first, then those of the list and those that announce themselves, each as it is now."""
    return await services.rigs.describe()


@router.get(
    "/{rig_id}/picture.jpg",
    summary="The wide picture of another rig",
    response_class=Response,
    responses={200: {"content": {"image/jpeg": {}}, "description": "JPEG"}, **problems(404, 503)},
)
async def picture(rig_id: str, services: ServicesDep) -> Response:
    """Return the newest wide picture of a rig of the list, read through this server."""
    content = await services.rigs.picture(rig_id)
    return Response(content, media_type="image/jpeg", headers={"Cache-Control": "no-store"})
