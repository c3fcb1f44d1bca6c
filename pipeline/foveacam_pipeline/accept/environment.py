"""What an acceptance run needs of a rig and what is known of it, and how much is measured."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Protocol

from foveacam_hardware.contract import Binning, Clock, Station
from foveacam_pipeline.calibrate.settle.settle_values import SettleSettings
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher
from foveacam_pipeline.capture.run.access import RigAccess
from foveacam_pipeline.models.calibration import Calibration


class RigUse(Protocol):
    """Reserves the rig for some checks."""

    def __call__(self, binning: Binning | None) -> AbstractContextManager[RigAccess]:
        """Reserve it until the context ends; `binning`: of its frames, None for the rig's working binning."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptanceOptions:
    """How much is measured.

    `looks`: without a pause; `wide_s`: of the wide camera at full rate; `step`: that traces the mirrors.
    """

    looks: int = 300
    wide_s: float = 60.0
    step: SettleSettings = field(default_factory=lambda: SettleSettings(delays=20, ringing_delays=16))


@dataclass(frozen=True, slots=True, kw_only=True)
class AcceptanceEnvironment:
    """The rig under test, what is known of it, and how to turn it to its markers.

    `problems`: device and reason for each device that is not there. `stations`: those with markers, the
    farthest first; `turn` brings the rig before one, `turns`: by motors.
    """

    rig_id: str
    clock: Clock
    layout: MarkerLayout
    stations: Sequence[Station]
    problems: Sequence[tuple[str, str]]
    calibration: Calibration | None
    use: RigUse
    turn: Callable[[RigAccess, Station, ProcedureWatcher], None]
    turns: bool
