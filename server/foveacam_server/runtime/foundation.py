"""What a running server stands on: its store and events, what is known of the rig, what is to be seen."""

import asyncio
import logging
import secrets
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError, MonotonicClock
from foveacam_server.calibrating.settle_times import SettleTimes
from foveacam_server.recordings.frame_tap import FrameTap
from foveacam_server.runtime.calibration_health import CalibrationHealth
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.camera_records import CameraRecords
from foveacam_server.runtime.camera_settings_service import CameraSettingsService
from foveacam_server.runtime.events import EventLevel, EventLog
from foveacam_server.runtime.frame_hub import FrameHub
from foveacam_server.runtime.overlay import GazeOverlay
from foveacam_server.runtime.ports import SceneViewer
from foveacam_server.runtime.settle_time_service import SettleTimeService
from foveacam_server.runtime.store import Store
from foveacam_server.runtime.stream import LiveStreams
from foveacam_server.settings import Settings
from foveacam_web.scene import ViewerScene

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerFoundation:
    """What everything stands on; `stack` closes what is opened, last opened first."""

    settings: Settings
    stack: ExitStack
    clock: Clock
    store: Store
    events: EventLog


@dataclass(frozen=True, slots=True, kw_only=True)
class RigKnowledge:
    """What is known of the rig; `folder` holds it."""

    folder: Path
    calibration: CalibrationService
    health: CalibrationHealth
    settling: SettleTimeService
    cameras: CameraSettingsService
    cameras_folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplayServices:
    """What is to be seen."""

    boot_id: str
    hub: FrameHub
    tap: FrameTap
    """Where frames and pictures are published: they go to the hub, and to who records."""
    streams: LiveStreams
    viewer: SceneViewer | None
    overlay: GazeOverlay


def lay_ground(settings: Settings, *, stack: ExitStack) -> ServerFoundation:
    """Open the store and the log of events."""
    store = stack.enter_context(Store(settings.data))
    events = EventLog(store)
    stack.callback(events.close)
    return ServerFoundation(
        settings=settings, stack=stack, clock=MonotonicClock(), store=store, events=events
    )


def open_lore(ground: ServerFoundation) -> RigKnowledge:
    """Open what is known of the rig."""
    folder = ground.store.subfolder("calibrations")
    calibration = CalibrationService(chosen=ground.settings.calibration, folder=folder, events=ground.events)
    health = CalibrationHealth(ground.events)
    calibration.on_change(health.begin)
    settling = SettleTimeService(SettleTimes(folder / "settle"), events=ground.events)
    cameras_folder = ground.store.subfolder("cameras")
    return RigKnowledge(
        folder=folder,
        calibration=calibration,
        health=health,
        settling=settling,
        cameras=CameraSettingsService(CameraRecords(cameras_folder), events=ground.events),
        cameras_folder=cameras_folder,
    )


def open_sights(
    ground: ServerFoundation, lore: RigKnowledge, *, loop: asyncio.AbstractEventLoop
) -> DisplayServices:
    """Open what is to be seen, the 3D scene with it."""
    boot_id = secrets.token_hex(6)
    hub = FrameHub(clock=ground.clock)
    streams = LiveStreams(hub, boot_id=boot_id)
    ground.stack.callback(streams.close)
    return DisplayServices(
        boot_id=boot_id,
        hub=hub,
        tap=FrameTap(hub),
        streams=streams,
        viewer=_open_viewer(ground, loop=loop),
        overlay=GazeOverlay(lambda: lore.calibration.current),
    )


def _open_viewer(ground: ServerFoundation, *, loop: asyncio.AbstractEventLoop) -> SceneViewer | None:
    if not ground.settings.viewer:
        return None
    scene, events = ViewerScene(), ground.events
    try:
        scene.start()
    except (FoveaError, OSError) as error:
        _log.warning("the 3D pane could not be started: %s", error)
        events.emit("viewer.failed", f"the 3D pane could not be started: {error}", level=EventLevel.WARNING)
        return None
    ground.stack.callback(scene.stop)

    async def on_select(fixation_id: str) -> None:
        events.emit("fixation.selected", f"{fixation_id} was clicked", data={"fixation_id": fixation_id})

    scene.on_select(on_select, loop)
    return scene
