"""Opens the rig of a command: a simulated one in virtual time unless `real_time` is given."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from rich.console import Console

from foveacam_hardware.contract import Clock, Head, NotConnected
from foveacam_hardware.rig import Rig, open_rig
from foveacam_hardware.rig_config import SerialMirrorsConfig, SerialRigConfig, SimulatedRigConfig
from foveacam_pipeline.calibrate.fit.measured import NominalRig
from foveacam_pipeline.capture.run import CaptureRig
from foveacam_server.commands.options import RigOptions
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.chosen_rig import check_simulation, compile_renderer, rig_config
from foveacam_server.rig.settle_times import SettleTimes

if TYPE_CHECKING:
    from foveacam_hardware.sim.presets import RigPreset


@dataclass(frozen=True, slots=True, kw_only=True)
class RigChoice:
    """The chosen rig; `real_time`: run a simulated one in real time."""

    settings: Settings
    seed: int | None = None
    real_time: bool = False

    @classmethod
    def of(cls, rig_options: RigOptions) -> "RigChoice":
        """Return the choice made by a command's options."""
        return cls(settings=rig_options.settings, seed=rig_options.seed, real_time=rig_options.real_time)

    @property
    def config(self) -> SimulatedRigConfig | SerialRigConfig:
        """The rig's configuration."""
        config = rig_config(self.settings)
        if isinstance(config, SimulatedRigConfig) and self.seed is not None:
            return config.model_copy(update={"seed": self.seed})
        return config

    @property
    def rig_id(self) -> str:
        """The rig's id, by which its calibrations are found."""
        config = self.config
        if isinstance(config, SerialRigConfig):
            return config.rig_id
        return _preset(config).rig_id(config.seed)

    @property
    def drive(self) -> "SerialMirrorsConfig | RigPreset":
        """Its drive filter and settle time, from its file or preset."""
        config = self.config
        return config.mirrors if isinstance(config, SerialRigConfig) else _preset(config)

    @property
    def baseline_m(self) -> float:
        """Nominal distance between its mirrors, m."""
        config = self.config
        return config.baseline_m if isinstance(config, SerialRigConfig) else NominalRig(rig_id="").baseline_m


def _preset(config: SimulatedRigConfig) -> "RigPreset":
    from foveacam_hardware.sim.presets import find_preset

    return find_preset(config.preset)


@contextmanager
def open_enabled_rig(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[Rig]:
    """Open and enable the rig and park it at the end; raise `NotConnected` when a device is missing."""
    config = choice.config
    if isinstance(config, SimulatedRigConfig):
        check_simulation(config)
        compile_renderer(console)
    with rig_of(config, real_time=choice.real_time) as rig:
        if rig.problems:
            problems = "; ".join(f"{problem.device}: {problem.detail}" for problem in rig.problems)
            raise NotConnected(f"every device of the rig is needed: {problems}")
        known = times.of(rig.rig_id)
        if known is not None and known.suits(rig.mirrors.low_pass_hz):
            rig.settle_us = known.settle_us
        rig.mirrors.enable()
        yield rig


def rig_of(config: SimulatedRigConfig | SerialRigConfig, *, real_time: bool) -> Rig:
    """Return the rig of a configuration, not connected; a simulated one runs in virtual time by default."""
    if isinstance(config, SerialRigConfig) or real_time:
        return open_rig(config, guarded=True)
    from foveacam_hardware.sim.rig import simulated_rig

    return simulated_rig(config, inline=True)


T = TypeVar("T")


class OwnRig:
    """Implements the pipeline's `RigAccess` for a rig that this thread owns."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    @property
    def clock(self) -> Clock:
        """The rig's clock."""
        return self._rig.clock

    @property
    def head(self) -> Head:
        """The rig's own head."""
        return self._rig.head

    def check_may_move(self) -> None:
        """Do nothing: this command owns the rig, so moves are always allowed."""

    def run_moving(self, work: Callable[[CaptureRig], T]) -> T:
        """Run `work` on the rig at once."""
        return work(self._rig)

    def run_still(self, work: Callable[[CaptureRig], T]) -> T:
        """Run `work` on the rig at once."""
        return work(self._rig)
