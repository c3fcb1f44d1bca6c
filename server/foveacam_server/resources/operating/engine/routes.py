"""Route of the engine: the load of the server's parts."""

from typing import Annotated, Protocol

from fastapi import Depends

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.http.answers import opened_services
from foveacam_server.resources.operating.engine.schema import EngineDocument
from foveacam_server.resources.operating.engine.service import EngineService

router = GuardedRouter("/engine", tags=["health"], reading=Right.VIEW, changing=Right.OPERATE)


class EngineRouteServices(Protocol):
    """Services that these routes use."""

    engine: EngineService


ServicesDep = Annotated[EngineRouteServices, Depends(opened_services)]


@router.get("", summary="Load, rates, gaps and drops of the server's parts")
def engine(services: ServicesDep) -> EngineDocument:
    """Return what each thread, queue, stage, camera and view does now, and how long the start took."""
    return services.engine.describe()
