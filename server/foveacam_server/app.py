"""The application: opens the services, includes one router a resource, closes in the reverse order."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI

from foveacam_hardware.contract import Clock, MonotonicClock
from foveacam_server import __version__
from foveacam_server.assembly.first_services import open_foundation
from foveacam_server.assembly.opening import open_services
from foveacam_server.assembly.services import registry_of
from foveacam_server.console import openapi_document, pages, security, viser_relay
from foveacam_server.console.person_requests import PersonRequests
from foveacam_server.doors import error_handlers
from foveacam_server.doors.closing import ClosingStack, run_beside
from foveacam_server.doors.compression import CompressedAnswers
from foveacam_server.doors.deferred_routes import Inclusion
from foveacam_server.doors.middleware import (
    FrameworkProblems,
    HeaderLimit,
    HeadRequests,
    RequestTimes,
    UncollectedStreams,
)
from foveacam_server.doors.process_end import ProcessEnd
from foveacam_server.doors.process_limits import bound_threads
from foveacam_server.doors.request_headers import RequestHeaders
from foveacam_server.doors.request_tracing import RequestIds, RequestTraces
from foveacam_server.doors.root_path import RootPath
from foveacam_server.foundation.http.answers import BODY_BYTES, problems
from foveacam_server.foundation.persons.person_quota import ServerPlaces
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.watching.tracing import open_traces
from foveacam_server.resources.calibrating.calibrations import routes as calibrations
from foveacam_server.resources.calibrating.drift_checks import routes as drift_checks
from foveacam_server.resources.calibrating.sessions import routes as calibration_sessions
from foveacam_server.resources.capturing.archive import routes as archive
from foveacam_server.resources.capturing.batches import routes as batches
from foveacam_server.resources.capturing.captures import routes as captures
from foveacam_server.resources.capturing.mosaics import routes as mosaics
from foveacam_server.resources.capturing.recordings import moment_routes as recording_moments
from foveacam_server.resources.capturing.recordings import routes as recordings
from foveacam_server.resources.capturing.recordings.imports import routes as recording_imports
from foveacam_server.resources.capturing.references import routes as references
from foveacam_server.resources.capturing.retention import routes as retention
from foveacam_server.resources.capturing.stills import routes as stills
from foveacam_server.resources.devices.cameras import preset_routes as camera_presets
from foveacam_server.resources.devices.cameras import routes as cameras
from foveacam_server.resources.devices.displays import routes as displays
from foveacam_server.resources.devices.faults import routes as faults
from foveacam_server.resources.devices.mirrors import routes as mirrors
from foveacam_server.resources.devices.mirrors import steering
from foveacam_server.resources.devices.positioners import pan_tilt_routes as pan_tilt
from foveacam_server.resources.devices.positioners import rail_routes as rail
from foveacam_server.resources.devices.rig_setup import routes as rig_setup
from foveacam_server.resources.devices.rig_state import binning_routes, health_routes
from foveacam_server.resources.devices.rig_state import routes as rig_state
from foveacam_server.resources.devices.settle_time import routes as settle_time
from foveacam_server.resources.devices.simulation import routes as simulation
from foveacam_server.resources.devices.stop import routes as stop
from foveacam_server.resources.looking.clouds import depth_routes as depth
from foveacam_server.resources.looking.clouds import routes as clouds
from foveacam_server.resources.looking.depth_backends import routes as depth_backends
from foveacam_server.resources.looking.fixations import correction_routes as corrections
from foveacam_server.resources.looking.fixations import routes as fixations
from foveacam_server.resources.looking.fixations import target_routes as targets
from foveacam_server.resources.looking.follows import routes as follows
from foveacam_server.resources.looking.loop import routes as loop
from foveacam_server.resources.looking.measurements import routes as measurements
from foveacam_server.resources.looking.reach import routes as reach
from foveacam_server.resources.looking.suggestions import routes as suggestions
from foveacam_server.resources.looking.wide_depth import routes as wide_depth
from foveacam_server.resources.operating.engine import routes as engine
from foveacam_server.resources.operating.events import routes as events
from foveacam_server.resources.operating.jobs import routes as jobs
from foveacam_server.resources.operating.lease import routes as lease
from foveacam_server.resources.operating.people import audit_routes as audit
from foveacam_server.resources.operating.people import session_routes as session
from foveacam_server.resources.operating.people import token_routes as service_tokens
from foveacam_server.resources.operating.people import user_routes as users
from foveacam_server.resources.operating.rigs import routes as rigs
from foveacam_server.resources.operating.views import layout_routes as window_layouts
from foveacam_server.resources.operating.views import routes as views
from foveacam_server.resources.studying.planner import routes as planner
from foveacam_server.rig.hardware_thread.kernel_preparation import Preparation, prepare_kernels

API = "/api/v1"

_RESOURCES = (
    rig_state,
    binning_routes,
    rig_setup,
    rigs,
    camera_presets,
    cameras,
    captures,
    mosaics,
    references,
    batches,
    stills,
    mirrors,
    steering,
    pan_tilt,
    rail,
    recording_imports,  # before the routes with an id in their place
    recordings,
    recording_moments,
    views,
    window_layouts,
    fixations,
    follows,
    loop,
    corrections,
    targets,
    suggestions,
    reach,
    clouds,
    depth,
    wide_depth,
    measurements,
    calibrations,
    calibration_sessions,
    depth_backends,
    displays,
    drift_checks,
    settle_time,
    planner,
    archive,
    retention,
    simulation,
    jobs,
    engine,
    events,
    faults,
    lease,
    session,
    users,
    service_tokens,
    audit,
    stop,
)


def create_app(
    settings: Settings, *, clock: Clock | None = None, kernels: Preparation = prepare_kernels
) -> FastAPI:
    """Return the application; nothing is opened before its lifespan starts.

    `clock`: the one of the rig and of all timestamps; None: the system's monotonic clock. `kernels`: makes
    those of a simulated rig ready.
    """
    app = FastAPI(
        title="FoveaCam Duo",
        version=__version__,
        summary="Foveated stereo: point somewhere, both foveae verge on it, distance and shape come back.",
        lifespan=partial(_lifespan, settings=settings, clock=clock or MonotonicClock(), kernels=kernels),
        openapi_url=None,  # ours is built beside the event loop
        docs_url=None,  # ours need nothing from other servers
        redoc_url=None,
        redirect_slashes=False,  # a path is served as it is written, or not at all
        telemetry={"tracing": False, "metrics": False, "logs": False, "auto_configure": False},  # ours alone
    )
    app.state.places = ServerPlaces()
    app.state.ending = None  # set by who ends the process with the application
    pages.install(app)
    error_handlers.install(app)
    _add_middleware(app, settings)
    inclusion = Inclusion(prefix=API, responses=problems(413, 422, 507), max_body_size=BODY_BYTES)
    for resource in _RESOURCES:
        inclusion.add(app, resource.router)
    for module in (health_routes, viser_relay):
        app.include_router(module.router, max_body_size=BODY_BYTES)
    openapi_document.install(app, token_needed=app.state.gate.token is not None, root_path=settings.root_path)
    return app


@asynccontextmanager
async def _lifespan(
    app: FastAPI, *, settings: Settings, clock: Clock, kernels: Preparation
) -> AsyncIterator[None]:
    """Open the services before the first request, and close them after the last."""
    bound_threads()
    await run_beside(partial(prepare_routes, app))
    stack = ClosingStack()
    try:
        app.state.traces = stack.enter_context(open_traces(settings.otlp_endpoint))
        loop = asyncio.get_running_loop()
        foundation = open_foundation(settings, stack=stack, clock=clock, loop=loop, kernels=kernels)
        services = open_services(foundation, loop=loop)
    except Exception as error:
        app.state.failure = error  # `foveacam serve` prints it in place of a traceback
        await run_beside(stack.close)
        raise
    app.state.services = services
    app.state.provided = registry_of(services)
    app.state.gate.accounts = services.accounts
    app.state.gate.viewers_may_stop = services.rig_setup.viewers_may_stop
    yield
    ending: ProcessEnd | None = app.state.ending
    if ending is None:
        await run_beside(stack.close)
    else:
        ending.closed(await run_beside(partial(stack.close, ending.left_s)))


def _add_middleware(app: FastAPI, settings: Settings) -> None:
    """Add what every request passes, the innermost first."""
    app.add_middleware(UncollectedStreams)
    app.add_middleware(FrameworkProblems)
    app.add_middleware(HeaderLimit)
    app.add_middleware(RequestHeaders)
    app.add_middleware(PersonRequests, places=app.state.places.requests)
    app.state.gate = security.install(app, settings)
    app.add_middleware(HeadRequests)
    app.add_middleware(RequestTimes)
    app.add_middleware(RequestTraces)
    app.add_middleware(RequestIds)
    if settings.root_path:
        app.add_middleware(RootPath, root=settings.root_path)
    app.add_middleware(CompressedAnswers)  # of pages with the root in their addresses


def prepare_routes(app: FastAPI) -> None:
    """Let every included router complete itself, which the first request would have to wait for otherwise.

    FastAPI does so for a router when it first matches a path. The routes of resources are `DeferredRoute`s.
    """
    nowhere = {"type": "http", "method": "GET", "path": f"{API}/nowhere", "root_path": "", "headers": []}
    for route in app.router.routes:
        route.matches(dict(nowhere))
    app.state.gate.routes.load()
