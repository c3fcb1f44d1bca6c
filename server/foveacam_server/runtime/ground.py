"""What a running server stands on: its store and events, what is known of the rig, what is to be seen."""

import asyncio
import logging
import secrets
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from foveacam_hardware.contract import Clock, FoveaError, MonotonicClock
from foveacam_server.calibrating.settle_times import SettleTimes
from foveacam_server.recordings.tap import FrameTap
from foveacam_server.runtime.calibration_health import CalibrationHealth
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.camera_desk import CameraDesk
from foveacam_server.runtime.camera_records import CameraRecords
from foveacam_server.runtime.events import EventLog, Level
from foveacam_server.runtime.frame_hub import FrameHub
from foveacam_server.runtime.overlay import Overlay
from foveacam_server.runtime.ports import Viewer
from foveacam_server.runtime.settle_desk import SettleDesk
from foveacam_server.runtime.store import Store
from foveacam_server.runtime.stream import Streams
from foveacam_server.settings import Settings
from foveacam_web.scene import ViewerScene

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """What everything stands on; `stack` closes what is opened, last opened first."""

    settings: Settings
    stack: ExitStack
    clock: Clock
    store: Store
    events: EventLog


@dataclass(frozen=True, slots=True, kw_only=True)
class Lore:
    """What is known of the rig; `folder` holds it."""

    folder: Path
    calibration: CalibrationService
    health: CalibrationHealth
    settling: SettleDesk
    cameras: CameraDesk
    cameras_folder: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Sights:
    """What is to be seen."""

    boot_id: str
    hub: FrameHub
    tap: FrameTap
    """Where frames and pictures are published: they go to the hub, and to who records."""
    streams: Streams
    viewer: Viewer | None
    overlay: Overlay


def lay_ground(settings: Settings, *, stack: ExitStack) -> Ground:
    """Open the store and the log of events."""
    store = stack.enter_context(Store(settings.data))
    events = EventLog(store)
    stack.callback(events.close)
    return Ground(settings=settings, stack=stack, clock=MonotonicClock(), store=store, events=events)


def open_lore(ground: Ground) -> Lore:
    """Open what is known of the rig."""
    folder = ground.store.subfolder("calibrations")
    calibration = CalibrationService(chosen=ground.settings.calibration, folder=folder, events=ground.events)
    health = CalibrationHealth(ground.events)
    calibration.on_change(health.begin)
    settling = SettleDesk(SettleTimes(folder / "settle"), events=ground.events)
    cameras_folder = ground.store.subfolder("cameras")
    return Lore(
        folder=folder,
        calibration=calibration,
        health=health,
        settling=settling,
        cameras=CameraDesk(CameraRecords(cameras_folder), events=ground.events),
        cameras_folder=cameras_folder,
    )


def open_sights(ground: Ground, lore: Lore, *, loop: asyncio.AbstractEventLoop) -> Sights:
    """Open what is to be seen, the 3D scene with it."""
    boot_id = secrets.token_hex(6)
    hub = FrameHub(clock=ground.clock)
    streams = Streams(hub, boot_id=boot_id)
    ground.stack.callback(streams.close)
    return Sights(
        boot_id=boot_id,
        hub=hub,
        tap=FrameTap(hub),
        streams=streams,
        viewer=_open_viewer(ground, loop=loop),
        overlay=Overlay(lambda: lore.calibration.current),
    )


def _open_viewer(ground: Ground, *, loop: asyncio.AbstractEventLoop) -> Viewer | None:
    if not ground.settings.viewer:
        return None
    scene, events = ViewerScene(), ground.events
    try:
        scene.start()
    except (FoveaError, OSError) as error:
        _log.warning("the 3D pane could not be started: %s", error)
        events.emit("viewer.failed", f"the 3D pane could not be started: {error}", level=Level.WARNING)
        return None
    ground.stack.callback(scene.stop)

    async def on_select(fixation_id: str) -> None:
        events.emit("fixation.selected", f"{fixation_id} was clicked", data={"fixation_id": fixation_id})

    scene.on_select(on_select, loop)
    return scene
