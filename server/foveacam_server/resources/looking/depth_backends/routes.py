"""Routes of depth backends: those there are, the choice, and the check of a network."""

from typing import Annotated, Protocol

from fastapi import Depends, Path
from fastapi.responses import Response
from starlette.concurrency import run_in_threadpool

from foveacam_server.accounts.rights import Right
from foveacam_server.accounts.route_rights import GuardedRouter
from foveacam_server.foundation.computing.compute_queue import ComputeQueue
from foveacam_server.foundation.http.answers import file_responses, opened_services, problems
from foveacam_server.resources.looking.depth_backends.comparison import BackendComparisons, PictureName
from foveacam_server.resources.looking.depth_backends.documents import check_document
from foveacam_server.resources.looking.depth_backends.schema import (
    BackendComparisonDocument,
    BackendComparisonRequest,
    BackendName,
    DepthBackendChoice,
    DepthBackendsDocument,
    NetworkCheckDocument,
)
from foveacam_server.resources.looking.depth_backends.service import DepthBackendService

router = GuardedRouter("/depth", tags=["clouds"], reading=Right.VIEW, changing=Right.OPERATE)


class DepthBackendRouteServices(Protocol):
    """Services that these routes use."""

    depth_backends: DepthBackendService
    backend_comparisons: BackendComparisons
    computing: ComputeQueue


ServicesDep = Annotated[DepthBackendRouteServices, Depends(opened_services)]


@router.get("/backends", summary="Backends that compute the depth of looks")
def backends(services: ServicesDep) -> DepthBackendsDocument:
    """Return semi-global matching and all networks, which is in use, and why the last look did without it."""
    return services.depth_backends.describe()


@router.put("/backend", summary="Choose the backend of looks", responses=problems(404, 507))
async def choose(request: DepthBackendChoice, services: ServicesDep) -> DepthBackendsDocument:
    """Use a backend for all looks from now on; it is kept over a restart."""
    return await run_in_threadpool(services.depth_backends.choose, request)


@router.post("/backends/{name}/check", summary="Check a network", responses=problems(404, 409))
async def check(name: Annotated[BackendName, Path()], services: ServicesDep) -> NetworkCheckDocument:
    """Run a network on a pair whose disparities are known; say what is wrong with it or its card."""
    return check_document(await services.computing.run(lambda: services.depth_backends.check(name)))


@router.post("/comparisons", summary="Compare two backends on the newest look", responses=problems(404, 409))
async def compare(request: BackendComparisonRequest, services: ServicesDep) -> BackendComparisonDocument:
    """Compute the depth of the newest look by two backends; return how they differ, with pictures."""
    return await services.computing.run(lambda: services.backend_comparisons.compare(request))


@router.get(
    "/comparisons/{comparison_id}/{picture}.png",
    summary="Picture of a comparison",
    response_class=Response,
    responses={**file_responses("image/png"), **problems(404)},
)
def picture(
    comparison_id: Annotated[str, Path(max_length=100)],
    picture: PictureName,
    services: ServicesDep,
) -> Response:
    """Return the depth of either backend, their difference, or the left picture; of the last comparisons."""
    content = services.backend_comparisons.picture(comparison_id, picture)
    return Response(content, media_type="image/png", headers={"Cache-Control": "private, max-age=3600"})
