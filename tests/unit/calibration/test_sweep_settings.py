"""What a sweep is told of the rig: who it is, and what its markers are as the rig file says."""

from contextlib import AbstractContextManager, nullcontext

from foveacam_hardware.contract import Binning, MarkerPrint, Role, VirtualClock
from foveacam_server.resources.calibrating.sessions.mirrors_step import sweep_settings
from foveacam_server.resources.calibrating.sessions.step_environment import ExclusiveRig, StepEnvironment


def no_rig(what: str, *, binning: Binning | None = 1) -> AbstractContextManager[ExclusiveRig]:
    return nullcontext()  # type: ignore[return-value]  # never used: nothing moves here


def test_a_sweep_looks_for_the_markers_of_the_rig_file() -> None:
    environment = StepEnvironment(
        rig_id="lab-1",
        baseline_m=0.2,
        stations=(),
        clock=VirtualClock(),
        serials={Role.LEFT: "L1"},
        fovea_settings=None,
        max_v=170.0,
        markers=MarkerPrint(side_m=0.04, spacing_m=0.09, left_id=7),
        use=no_rig,
        wait_after_moves=lambda _time: None,
    )

    settings = sweep_settings(environment)

    assert (settings.layout.side_m, settings.layout.spacing_m) == (0.04, 0.09)
    assert settings.layout.ids == (0, 7, 2)
    assert (settings.rig_id, settings.left_serial) == ("lab-1", "L1")
