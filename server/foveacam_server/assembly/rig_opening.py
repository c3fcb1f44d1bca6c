"""Opens the hardware thread on the rig that is chosen, or on a recording that is played."""

from pathlib import Path

from foveacam_hardware.rig import open_rig
from foveacam_hardware.rig_replay import replay_rig
from foveacam_server.assembly.collection_services import live_rates
from foveacam_server.assembly.first_services import (
    DisplayServices,
    RigKnowledge,
    ServerFoundation,
)
from foveacam_server.rig.chosen_rig import ChosenRig
from foveacam_server.rig.hardware import HardwareThread
from foveacam_server.rig.ports import AssembledRig


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
    )
    foundation.stack.callback(hardware.close)
    displays.stereo.spare_while(lambda: hardware.use.firm)
    return hardware


def _open_rig(foundation: ServerFoundation, knowledge: RigKnowledge, chosen: ChosenRig) -> AssembledRig:
    replay = foundation.settings.replay
    if replay is not None:
        return _open_replay(foundation, knowledge, replay)
    rig = open_rig(chosen.config(), clock=foundation.clock, guarded=True)
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
