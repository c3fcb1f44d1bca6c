"""The pair of steering mirrors: DAC codes in, mechanical tilts out, at any time of the last 10 s.

Codes -> volts -> low-pass and resonance (`low_pass`, linear and exact) -> static law from volts to tilt.
The law is a balance of torques, not a polynomial; the effect of a tilt on the image is in `optics`.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import MirrorVolts, Role
from foveacam_hardware.sim.low_pass import DriveHistory, ResonantMode
from foveacam_hardware.sim.rest_deviation import RestDeviation
from foveacam_hardware.simulated_faults import MIRROR_AXES, MirrorAxis, MirrorDisturbance

FULL_SCALE_V = 200.0
FULL_SCALE_CODE = 65_535
NOMINAL_BIAS_V = 90.0
BALANCE_ITERATIONS = 8  # the axes couple by about 1 %, so each iteration gains two digits


@dataclass(frozen=True, slots=True, kw_only=True)
class MirrorLaw:
    """The tilts at which one mirror rests: electrostatic torque against stiffening springs.

    Pairs are (x, y). Tilts are mechanical; the light turns by twice the x tilt and 1.41 times the y tilt.
    """

    gain_rad_per_v: tuple[float, float]
    stiffening_per_rad2: tuple[float, float]
    rest_rad: tuple[float, float]
    skew_rad: tuple[float, float]
    """Rotation of the x and of the y electrodes against the axes of the springs."""
    side: int
    """-1 left, +1 right: the eyes, and so their cross-talk, are mirror images of each other."""

    def tilt_rad(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the tilts at rest (n, 2) under differential volts (n, 2) float64."""
        drive = volts_v * np.array(self.gain_rad_per_v)
        skew_x, skew_y = self.skew_rad
        torque_x = drive[:, 0] + skew_x * drive[:, 1]
        torque_y = drive[:, 1] + skew_y * drive[:, 0]
        tilt_x, tilt_y = np.zeros(len(drive)), np.zeros(len(drive))
        for _ in range(BALANCE_ITERATIONS):
            pull_x, pull_y = self._cross_talk(tilt_x, tilt_y)
            soft_x, soft_y = 1.0 + SHARED_STIFFENING * tilt_y**2, 1.0 + SHARED_STIFFENING * tilt_x**2
            tilt_x, tilt_y = (
                _solve_balance(torque_x + pull_x, soft_x, self.stiffening_per_rad2[0]),
                _solve_balance(torque_y + pull_y, soft_y, self.stiffening_per_rad2[1]),
            )
        return np.stack([tilt_x + self.rest_rad[0], tilt_y + self.rest_rad[1]], axis=1)

    def _cross_talk(
        self, tilt_x: NDArray[np.float64], tilt_y: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the torque that each axis's comb adds to the other axis as it rises out of its slots."""
        rise = COMB_HEIGHT_RAD * (np.sqrt(1.0 + (tilt_y / COMB_HEIGHT_RAD) ** 2) - 1.0)
        lift = np.arctan(tilt_x / COMB_HEIGHT_RAD) * COMB_HEIGHT_RAD
        return -self.side * CROSS_TALK_X * rise, self.side * CROSS_TALK_Y * lift * tilt_y


# Fitted so that mirror and optics together match the published 9 x 9 sweep of the real rig: about 11 %
# less range at 170 V than the slope at rest predicts, -/+0.34 deg (y^2) and +/-0.42 deg (x y) across axes.
SHARED_STIFFENING = 1.0
COMB_HEIGHT_RAD = 0.2
CROSS_TALK_X = 0.10
CROSS_TALK_Y = 0.48


def built_law(role: Role, *, seed: int) -> MirrorLaw:
    """Return the law of one mirror with its manufacturing tolerances, which the seed decides."""
    rng = np.random.default_rng([seed, 1 if role is Role.LEFT else 2, 0x3E35])
    gain_x, gain_y = np.deg2rad([0.0306, 0.0372]) * rng.uniform(0.985, 1.015, 2)
    rest_x, rest_y = np.deg2rad(rng.uniform(-0.05, 0.05, 2))
    skew_x, skew_y = rng.uniform(-0.02, 0.02, 2)
    return MirrorLaw(
        gain_rad_per_v=(float(gain_x), float(gain_y)),
        stiffening_per_rad2=(19.0, 12.6),
        rest_rad=(float(rest_x), float(rest_y)),
        skew_rad=(float(skew_x), float(skew_y)),
        side=-1 if role is Role.LEFT else 1,
    )


class MirrorPair:
    """Both mirrors and their amplifier; not thread safe (the world's lock guards it)."""

    def __init__(self, *, mode: ResonantMode, cutoff_hz: int, t_ns: int, seed: int) -> None:
        self.laws = {role: built_law(role, seed=seed) for role in (Role.LEFT, Role.RIGHT)}
        self.dead_axes: Set[MirrorAxis] = set()
        """Axes that do not move, whatever the drive does."""
        self._new_history = partial(DriveHistory, axes=4, mode=mode, cutoff_hz=cutoff_hz, t_ns=t_ns)
        self._history = self._new_history()
        self.drive_scale = 1.0
        """Volts at the electrodes as a share of the commanded ones."""
        self._deviation: RestDeviation | None = None
        self._seed = seed
        self._codes: tuple[int, ...] = (0,) * 8
        self._rail_on = False
        self._dead_axis_v: dict[MirrorAxis, float] = {}

    def disturb(self, disturbance: MirrorDisturbance) -> None:
        """Disturb the rest angles from the first move on; called before it."""
        if disturbance != MirrorDisturbance():
            rest_rad = self._law_tilts_rad(np.zeros(4))
            drive = self._new_history()
            self._deviation = RestDeviation(disturbance, drive=drive, rest_rad=rest_rad, seed=self._seed)

    def set_codes(self, t_ns: int, codes: tuple[int, ...]) -> None:
        """Set the 8 DAC codes: left x+, x-, y+, y-, then right."""
        self._codes = codes
        self._apply(t_ns)

    def set_rail(self, t_ns: int, *, on: bool) -> None:
        """Switch the high voltage; without it the springs return the mirrors to rest."""
        self._rail_on = on
        self._apply(t_ns)

    def set_low_pass(self, t_ns: int, cutoff_hz: int) -> None:
        """Set the filters' cut-off; 0 stops their clock, and the outputs hold."""
        if cutoff_hz > 0:
            self._history.set_low_pass(t_ns, cutoff_hz)
            if self._deviation is not None:
                self._deviation.set_low_pass(t_ns, cutoff_hz)

    def tilt_rad(self, role: Role, t_ns: int) -> tuple[float, float]:
        """Return the mechanical tilts (x, y) of one mirror at `t_ns`."""
        x_rad, y_rad = self.tilts_rad(role, (t_ns,))[0].tolist()
        return x_rad, y_rad

    def tilts_rad(self, role: Role, times_ns: Sequence[int]) -> NDArray[np.float64]:
        """Return the mechanical tilts (n, 2) of one mirror at several times."""
        volts_v = [self._history.output_v(t_ns) for t_ns in times_ns]
        if self.dead_axes or self._dead_axis_v:
            volts_v = [self._hold_dead_axes(each_v) for each_v in volts_v]
        tilts_rad = self.laws[role].tilt_rad(np.stack(volts_v)[:, _axes(role)])
        if self._deviation is None:
            return tilts_rad
        return tilts_rad + np.stack([self._deviation.tilt_rad(t_ns) for t_ns in times_ns])[:, _axes(role)]

    def rest_tilt_rad(self, role: Role, volts: MirrorVolts) -> tuple[float, float]:
        """Return the tilts (x, y) at which an undisturbed mirror rests under differential volts (truth)."""
        x_rad, y_rad = self.laws[role].tilt_rad(np.array([[volts.x_v, volts.y_v]]))[0].tolist()
        return x_rad, y_rad

    def _hold_dead_axes(self, volts_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts (4,), those of dead axes as they were when these failed."""
        held_v = volts_v.copy()
        for number, axis in enumerate(MIRROR_AXES):
            if axis in self.dead_axes:
                held_v[number] = self._dead_axis_v.setdefault(axis, float(volts_v[number]))
            else:
                self._dead_axis_v.pop(axis, None)
        return held_v

    def _apply(self, t_ns: int) -> None:
        channels_v = np.array(self._codes, dtype=np.float64) * (FULL_SCALE_V / FULL_SCALE_CODE)
        plus_v, minus_v = channels_v[0::2], channels_v[1::2]
        # The two electrodes of an axis pull with the square of their volts: 2 bias v at the nominal bias.
        pull_v = (plus_v**2 - minus_v**2) / (2.0 * NOMINAL_BIAS_V)
        inputs_v = self.drive_scale * pull_v if self._rail_on else np.zeros(4)
        self._history.set_inputs(t_ns, inputs_v)
        if self._deviation is not None:
            dead = np.array([axis in self.dead_axes for axis in MIRROR_AXES]).reshape(2, 2)
            self._deviation.move(t_ns, self._law_tilts_rad(inputs_v), dead=dead)

    def _law_tilts_rad(self, inputs_v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rest tilts of the static law (2, 2), left and right, under inputs (4,), volts."""
        return np.vstack([law.tilt_rad(inputs_v[None, _axes(role)]) for role, law in self.laws.items()])


def _axes(role: Role) -> slice:
    return slice(0, 2) if role is Role.LEFT else slice(2, 4)


def _solve_balance(
    torque: NDArray[np.float64], softness: NDArray[np.float64], stiffening: float
) -> NDArray[np.float64]:
    """Solve tilt (softness + stiffening tilt^2) = torque: the one real root, in closed form."""
    p = softness / stiffening
    q = torque / stiffening
    scale = np.sqrt(p / 3.0)
    return np.asarray(2.0 * scale * np.sinh(np.arcsinh(q / (2.0 * scale**3)) / 3.0))
