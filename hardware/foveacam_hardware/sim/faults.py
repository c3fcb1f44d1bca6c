"""Disturbances of the simulated rig: faults that a test or a demonstration sets, and thermal drift."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import Role
from foveacam_hardware.simulated_faults import (
    CAMERA_NAMES,
    EYE_NAMES,
    MIRROR_AXES,
    MirrorAxis,
    MountKnock,
    SimulatedFaults,
)

DRIFT_PERIODS_S = (1380.0, 421.0)  # deduced: the heating cycle of a room, and that of the electronics
DRIFT_SHARES = (0.7, 0.3)


@dataclass(slots=True)
class WorldFaults:
    """The faults in force; none while every set is empty.

    `frozen`: cameras that count frames but repeat the last image. `unplugged`: cameras off the bus.
    `no_strobe`: cameras whose strobe cable is off (they still expose). `no_trigger`: cameras whose trigger
    cable is off. `dead_axes`: mirror axes that do not move. `drift_step_rad`: rotation of an eye's mount by
    a knock, about the rig's x, y and z (roll), in addition to the thermal drift.
    """

    frozen: set[Role] = field(default_factory=set)
    unplugged: set[Role] = field(default_factory=set)
    no_strobe: set[Role] = field(default_factory=set)
    no_trigger: set[Role] = field(default_factory=set)
    dead_axes: set[MirrorAxis] = field(default_factory=set)
    drift_step_rad: dict[Role, tuple[float, float, float]] = field(default_factory=dict)

    @property
    def in_force(self) -> SimulatedFaults:
        """The faults in force, in the form of a rig file."""
        return SimulatedFaults(
            unplugged=[name for name in CAMERA_NAMES if Role(name) in self.unplugged],
            frozen=[name for name in CAMERA_NAMES if Role(name) in self.frozen],
            no_trigger=[eye for eye in EYE_NAMES if Role(eye) in self.no_trigger],
            no_strobe=[eye for eye in EYE_NAMES if Role(eye) in self.no_strobe],
            dead_axes=[axis for axis in MIRROR_AXES if axis in self.dead_axes],
            knocked_left=self._knock(Role.LEFT),
            knocked_right=self._knock(Role.RIGHT),
        )

    def set_faults(self, faults: SimulatedFaults) -> None:
        """Set exactly the faults that a rig file lists, and clear all others."""
        self.unplugged = {Role(name) for name in faults.unplugged}
        self.frozen = {Role(name) for name in faults.frozen}
        self.no_trigger = {Role(name) for name in faults.no_trigger}
        self.no_strobe = {Role(name) for name in faults.no_strobe}
        self.dead_axes = set(faults.dead_axes)
        knocks = {Role.LEFT: faults.knocked_left, Role.RIGHT: faults.knocked_right}
        self.drift_step_rad = {
            role: _turn_rad(knock) for role, knock in knocks.items() if knock != MountKnock()
        }

    def _knock(self, role: Role) -> MountKnock:
        x_rad, y_rad, roll_rad = self.drift_step_rad.get(role, (0.0, 0.0, 0.0))
        return MountKnock(
            shift_x_deg=_deg(y_rad),
            shift_y_deg=_deg(-x_rad),
            rotation_deg=_deg(roll_rad),
        )


def _turn_rad(knock: MountKnock) -> tuple[float, float, float]:
    """Return the rotation about +x (right), +y (down) and +z: about +x upwards, about +y to the right."""
    shift_x_rad, shift_y_rad = math.radians(knock.shift_x_deg), math.radians(knock.shift_y_deg)
    return -shift_y_rad, shift_x_rad, math.radians(knock.rotation_deg)


def _deg(angle_rad: float) -> float:
    return round(math.degrees(angle_rad), 9) + 0.0  # no minus before a zero


class ThermalMountDrift:
    """Rotation of each eye's mount about the rig's x and y as a slow function of time.

    `zero_s`: when there is none, as at a calibration.
    """

    def __init__(
        self, *, seed: int, amplitude_rad: float = float(np.deg2rad(0.002)), zero_s: float = 0.0
    ) -> None:
        self.amplitude_rad = amplitude_rad
        self.zero_s = zero_s
        phases = np.random.default_rng([seed, 0xD21F]).uniform(0.0, 2.0 * np.pi, (2, 2, len(DRIFT_PERIODS_S)))
        self._phases = {Role.LEFT: phases[0], Role.RIGHT: phases[1]}

    def turn_rad(self, role: Role, t_s: float) -> NDArray[np.float64]:
        """Return the rotation (2,) about x and y, radians, at time `t_s`."""
        phases = self._phases[role]
        per_s = 2.0 * np.pi / np.array(DRIFT_PERIODS_S)
        swing = np.sin(per_s * t_s + phases) - np.sin(per_s * self.zero_s + phases)
        return np.asarray(self.amplitude_rad * (swing @ np.array(DRIFT_SHARES)), dtype=np.float64)
