"""Routes of depth backends: those there are, the choice, and the check of a network."""

from typing import Annotated, Protocol

from fastapi import APIRouter, Depends, Path
from starlette.concurrency import run_in_threadpool

from foveacam_server.foundation.answers import opened_services, problems
from foveacam_server.foundation.compute_queue import ComputeQueue
from foveacam_server.resources.depth_backends.documents import check_document
from foveacam_server.resources.depth_backends.schema import (
    BackendName,
    DepthBackendChoice,
    DepthBackendsDocument,
    NetworkCheckDocument,
)
from foveacam_server.resources.depth_backends.service import DepthBackendService

router = APIRouter(prefix="/depth", tags=["clouds"])


class DepthBackendRouteServices(Protocol):
    """Services that these routes use."""

    depth_backends: DepthBackendService
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
