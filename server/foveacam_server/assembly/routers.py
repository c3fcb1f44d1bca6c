"""The routers of REST, one line per module of `resources`; paths are matched in this order."""

import importlib

from foveacam_server.accounts.route_rights import GuardedRouter

MODULES = (
    "devices.rig_state.routes",
    "devices.rig_state.binning_routes",
    "devices.rig_setup.routes",
    "operating.rigs.routes",
    "devices.cameras.preset_routes",
    "devices.cameras.routes",
    "capturing.captures.routes",
    "capturing.mosaics.routes",
    "capturing.references.routes",
    "capturing.exports.routes",
    "capturing.batches.routes",
    "capturing.stills.routes",
    "devices.mirrors.routes",
    "devices.mirrors.steering",
    "devices.positioners.pan_tilt_routes",
    "devices.positioners.rail_routes",
    "capturing.recordings.imports.routes",  # before the routes with an id in their place
    "capturing.recordings.routes",
    "capturing.recordings.moment_routes",
    "operating.views.routes",
    "operating.views.layout_routes",
    "looking.fixations.routes",
    "looking.follows.routes",
    "looking.loop.routes",
    "looking.fixations.correction_routes",
    "looking.fixations.target_routes",
    "looking.suggestions.routes",
    "looking.reach.routes",
    "looking.clouds.routes",
    "looking.clouds.depth_routes",
    "looking.wide_depth.routes",
    "looking.measurements.routes",
    "calibrating.calibrations.routes",
    "calibrating.sessions.routes",
    "looking.depth_backends.routes",
    "devices.displays.routes",
    "calibrating.drift_checks.routes",
    "calibrating.acceptances.routes",
    "devices.settle_time.routes",
    "studying.planner.routes",
    "capturing.archive.routes",
    "capturing.retention.routes",
    "devices.simulation.routes",
    "operating.jobs.routes",
    "operating.engine.routes",
    "operating.events.routes",
    "devices.faults.routes",
    "operating.lease.routes",
    "operating.people.session_routes",
    "operating.people.user_routes",
    "operating.people.token_routes",
    "operating.people.audit_routes",
    "devices.stop.routes",
)


def load_routers() -> list[GuardedRouter]:
    """Return the routers of all modules, importing them if needed."""
    return [importlib.import_module(f"foveacam_server.resources.{name}").router for name in MODULES]
