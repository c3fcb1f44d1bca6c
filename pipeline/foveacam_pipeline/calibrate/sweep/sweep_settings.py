"""Settings of a sweep: nominal data of the rig, and the limits of the procedure."""

import math
from dataclasses import dataclass, field

from foveacam_hardware.contract import Role
from foveacam_pipeline.calibrate.sweep.base_turn import TurnSettings
from foveacam_pipeline.calibrate.sweep.centring import CentringSettings
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepSettings:
    """The rig's name and limits, and the limits of the sweep.

    `rad_per_v` and `zoom` (fovea over wide, px) are nominal and corrected by the first looks. `wide_frames`:
    averaged at a pose. `still_px`: maximum movement of a marker meanwhile, wide px. `give_up_after`: number
    of refused poses in a row of an eye that was never measured. `approach_rad`: longest step away from known
    gazes; a longer way is divided into steps. `probe_v`, `least_response`: the test step of each axis, and
    the share of the expected turn that must follow. `run`: names the run of the procedure, the same at all of
    its stations. `reference_rows`: number of rows after which the middle of the field is measured again, as
    before the first and after the last one, because the mounts drift; 0: never.
    """

    rig_id: str
    created_utc: str
    wide_serial: str = ""
    left_serial: str = ""
    right_serial: str = ""
    layout: MarkerLayout = field(default_factory=MarkerLayout)
    baseline_m: float = 0.2
    max_v: float = 170.0
    rad_per_v: tuple[float, float] = (math.radians(0.060), math.radians(0.052))
    zoom: float = 9.1
    wide_frames: int = 4
    still_px: float = 0.15
    most_restarts: int = 2
    give_up_after: int = 5
    approach_rad: float = math.radians(4.6)
    probe_v: float = 4.0
    least_response: float = 0.35
    run: str = ""
    reference_rows: int = 2
    turning: TurnSettings = field(default_factory=TurnSettings)
    centring: CentringSettings = field(default_factory=CentringSettings)

    def eye_x_m(self, role: Role) -> float:
        """Return the x of an eye's reference point on the baseline, m."""
        return -0.5 * self.baseline_m if role is Role.LEFT else 0.5 * self.baseline_m
