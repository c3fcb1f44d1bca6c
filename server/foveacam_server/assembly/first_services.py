"""Opens the services that all others share: store, events, calibrations, settings, views, 3D pane, hardware.

The hardware thread opens the chosen rig, or a recording to play.
"""

import asyncio
import logging
import secrets
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError
from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_replay import replay_rig
from foveacam_server.accounts.accounts import Accounts
from foveacam_server.doors.closing import ClosingStack
from foveacam_server.foundation.events import EventLevel, EventLog
from foveacam_server.foundation.jobs import JobRunner
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibrating.calibrations.health import CalibrationHealth
from foveacam_server.resources.calibrating.calibrations.service import CalibrationService
from foveacam_server.resources.devices.cameras.records import CameraRecords
from foveacam_server.resources.devices.cameras.service import CameraSettingsService
from foveacam_server.resources.devices.settle_time.service import SettleTimeService
from foveacam_server.resources.looking.fixations.schema import FixationSelectedEvent
from foveacam_server.resources.operating.views.live_stereo import LiveStereo
from foveacam_server.resources.operating.views.overlay import GazeOverlay
from foveacam_server.rig import refusals
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.frame_hub import FrameHub
from foveacam_server.rig.frame_tap import FrameTap
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.hardware_thread.kernel_preparation import Preparation
from foveacam_server.rig.live_views import LiveRates
from foveacam_server.rig.loop_lag import LoopLag
from foveacam_server.rig.ports import AssembledRig, SceneViewer
from foveacam_server.rig.settle_times import SettleTimes
from foveacam_server.rig.stream import LiveStreams
from foveacam_web.scene import ViewerScene

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerFoundation:
    """Settings, store, accounts and events; `stack` closes what is opened, last opened first."""

    settings: Settings
    stack: ClosingStack
    clock: Clock
    store: Store
    accounts: Accounts
    events: EventLog
    lag: LoopLag
    kernels: Preparation


@dataclass(frozen=True, slots=True, kw_only=True)
class RigKnowledge:
    """Stored data of the rig: calibrations (in `folder`), settle time, camera settings."""

    folder: Path
    calibration: CalibrationService
    health: CalibrationHealth
    settling: SettleTimeService
    cameras: CameraSettingsService
    cameras_folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplayServices:
    """Views, live streams, the overlay of the wide view, and the 3D pane."""

    hub: FrameHub
    tap: FrameTap
    """Sink of frames and pictures, which passes them to the hub and to recordings."""
    streams: LiveStreams
    stereo: LiveStereo
    viewer: SceneViewer | None
    overlay: GazeOverlay


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedServices:
    """The services with which those of the resources are opened."""

    foundation: ServerFoundation
    knowledge: RigKnowledge
    displays: DisplayServices
    hardware: HardwareThread
    jobs: JobRunner


def open_foundation(
    settings: Settings,
    *,
    stack: ClosingStack,
    clock: Clock,
    loop: asyncio.AbstractEventLoop,
    kernels: Preparation,
) -> ServerFoundation:
    """Open the store, event log, accounts, and lag measurement of the event loop; called on the loop."""
    store = stack.enter_context(Store(settings.data))
    events = EventLog(store)
    stack.callback(events.close)
    accounts = Accounts(
        store,
        shared_token=settings.token is not None and bool(settings.token.get_secret_value()),
        guarded=not (settings.loopback or settings.insecure),
    )
    stack.callback(accounts.close)
    lag = LoopLag(loop)
    stack.callback(lag.close)
    return ServerFoundation(
        settings=settings,
        stack=stack,
        clock=clock,
        store=store,
        accounts=accounts,
        events=events,
        lag=lag,
        kernels=kernels,
    )


def open_rig_knowledge(foundation: ServerFoundation) -> RigKnowledge:
    """Open calibrations, settle time and camera settings."""
    folder = foundation.store.subfolder("calibrations")
    calibration = CalibrationService(
        chosen=foundation.settings.calibration, folder=folder, events=foundation.events
    )
    health = CalibrationHealth(foundation.events)
    calibration.on_change(health.begin)
    settling = SettleTimeService(SettleTimes(folder / "settle"), events=foundation.events)
    cameras_folder = foundation.store.subfolder("cameras")
    return RigKnowledge(
        folder=folder,
        calibration=calibration,
        health=health,
        settling=settling,
        cameras=CameraSettingsService(CameraRecords(cameras_folder), events=foundation.events),
        cameras_folder=cameras_folder,
    )


def open_displays(
    foundation: ServerFoundation, knowledge: RigKnowledge, *, loop: asyncio.AbstractEventLoop
) -> DisplayServices:
    """Open the views and, unless it is switched off, the 3D pane."""
    hub = FrameHub(clock=foundation.clock)
    streams = LiveStreams(hub, boot_id=secrets.token_hex(6))
    foundation.stack.callback(streams.close)
    tap = FrameTap(hub)
    stereo = LiveStereo(tap, calibration=lambda: knowledge.calibration.current, clock=foundation.clock)
    stereo.start()
    foundation.stack.callback(stereo.close)
    return DisplayServices(
        hub=hub,
        tap=tap,
        streams=streams,
        stereo=stereo,
        viewer=_open_viewer(foundation, loop=loop),
        overlay=GazeOverlay(lambda: knowledge.calibration.current),
    )


def _open_viewer(foundation: ServerFoundation, *, loop: asyncio.AbstractEventLoop) -> SceneViewer | None:
    if not foundation.settings.viewer:
        return None
    scene = ViewerScene(view_url=f"{foundation.settings.root_path}/view")
    events = foundation.events
    try:
        scene.start()
    except (FoveaError, OSError) as error:
        _log.warning("the 3D pane could not be started: %s", error)
        events.emit("viewer.failed", f"the 3D pane could not be started: {error}", level=EventLevel.WARNING)
        return None
    foundation.stack.callback(scene.stop)

    async def on_select(fixation_id: str) -> None:
        events.emit(
            "fixation.selected",
            f"{fixation_id} was clicked",
            data=FixationSelectedEvent(fixation_id=fixation_id),
        )

    scene.on_select(on_select, loop)
    return scene


def live_rates(settings: Settings) -> LiveRates:
    """Return the rates of the live views."""
    return LiveRates(wide_hz=settings.live_wide_hz, fovea_hz=settings.live_fovea_hz)


def open_hardware(
    foundation: ServerFoundation, knowledge: RigKnowledge, displays: DisplayServices, *, rig: ChosenRig
) -> HardwareThread:
    """Open the hardware thread; the rig itself opens on it, once it is started."""
    settings = foundation.settings
    hardware = HardwareThread(
        lambda: _open_rig(foundation, knowledge, rig),
        sink=displays.tap,
        events=foundation.events,
        clock=foundation.clock,
        overlay=displays.overlay.of,
        limits=live_rates(settings),
        keeper=knowledge.cameras,
        prepare=foundation.kernels,
        blocked_ns=foundation.lag.blocked_ns,
    )
    knowledge.calibration.refuse_without_rig(lambda: refusals.not_open(hardware.status))
    foundation.stack.callback(hardware.close)
    displays.stereo.spare_while(lambda: hardware.use.firm)
    return hardware


def _open_rig(foundation: ServerFoundation, knowledge: RigKnowledge, chosen: ChosenRig) -> AssembledRig:
    knowledge.calibration.forget_rig()
    replay = foundation.settings.replay
    if replay is not None:
        return _open_replay(foundation, knowledge, replay)
    rig = open_rig(chosen.config(), clock=foundation.clock, guarded=True)
    if foundation.settings.binning != "rig":
        rig.working_binning = 2 if foundation.settings.binning == "2" else 1
    knowledge.calibration.choose_for(rig.rig_id)
    knowledge.settling.restore(rig)
    return rig


def _open_replay(foundation: ServerFoundation, knowledge: RigKnowledge, replay: Path) -> AssembledRig:
    """Return the rig that plays a recording, with the calibration that was recorded with it."""
    from foveacam_server.rig.replay import open_recording, playback_of

    recorded = open_recording(replay)
    rig = replay_rig(recorded, playback=playback_of(foundation.settings), clock=foundation.clock)
    knowledge.calibration.choose_for(rig.rig_id, brought=recorded.calibration)
    knowledge.settling.restore(rig)
    return rig
