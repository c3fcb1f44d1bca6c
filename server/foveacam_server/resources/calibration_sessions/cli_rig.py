"""Open a rig and the data directory for a command of `foveacam calibrate`, `capture`, `record` or `still`.

A simulated rig runs in virtual time unless `real_time` is given.
"""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from foveacam_hardware.contract import NotConnected, Role
from foveacam_hardware.rig import Rig, open_rig
from foveacam_hardware.rig_config import SerialMirrorsConfig, SerialRigConfig, SimulatedRigConfig
from foveacam_pipeline.calibrate.fit.measured import NominalRig
from foveacam_server.assembly.opening import rig_config
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.settings import Settings
from foveacam_server.foundation.store import Store
from foveacam_server.resources.calibration_sessions.cli_choices import CalibrateOptions
from foveacam_server.resources.calibration_sessions.sessions import SessionCollection
from foveacam_server.resources.calibration_sessions.step_environment import ExclusiveRig, StepEnvironment
from foveacam_server.resources.calibrations.service import CalibrationService
from foveacam_server.resources.settle_time.records import SettleTime, SettleTimes
from foveacam_server.simulation import check_simulation, compile_renderer

if TYPE_CHECKING:
    from foveacam_hardware.sim.presets import RigPreset


@dataclass(frozen=True, slots=True, kw_only=True)
class RigChoice:
    """The chosen rig; `real_time`: let a simulated one run in real time."""

    settings: Settings
    seed: int | None = None
    real_time: bool = False

    @classmethod
    def of(cls, rig_options: CalibrateOptions) -> "RigChoice":
        """Return the choice of a command's options."""
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
        """The rig id that its calibrations name."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class DataDirectory:
    """What a command reads and writes in the data directory, for one rig."""

    rig_id: str
    baseline_m: float
    calibration: CalibrationService
    sessions: SessionCollection
    drift_folder: Path
    settle_times: SettleTimes


@contextmanager
def open_data(choice: RigChoice, *, lock: bool) -> Iterator[DataDirectory]:
    """Open the data directory for one command; with `lock`, raise `Busy` while a server has it.

    A command locks it to change what a server holds in memory (the calibration and the settle time in use),
    or to measure with a rig in a session. All others run beside a server: they write new files, or into
    folders with a lock of their own.
    """
    folder = choice.settings.data / "calibrations"
    with ExitStack() as stack:
        events = None
        if lock:
            events = EventLog(stack.enter_context(Store(choice.settings.data)))
            stack.callback(events.close)
        calibration = CalibrationService(chosen=choice.settings.calibration, folder=folder, events=events)
        calibration.choose_for(choice.rig_id)
        yield DataDirectory(
            rig_id=choice.rig_id,
            baseline_m=choice.baseline_m,
            calibration=calibration,
            sessions=SessionCollection(folder / "sessions"),
            drift_folder=folder / "drift",
            settle_times=SettleTimes(folder / "settle"),
        )


@contextmanager
def open_environment(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[StepEnvironment]:
    """Open the rig for calibration steps and park it at the end."""
    with open_enabled_rig(choice, times, console=console) as rig:
        yield environment_of(rig, times)


@contextmanager
def open_enabled_rig(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[Rig]:
    """Open and enable the rig and park it at the end; raise `NotConnected` when a device is missing."""
    config = choice.config
    if isinstance(config, SimulatedRigConfig):
        check_simulation(config)
        compile_renderer(console)
    with _rig_of(config, real_time=choice.real_time) as rig:
        if rig.problems:
            problems = "; ".join(f"{problem.device}: {problem.detail}" for problem in rig.problems)
            raise NotConnected(f"every device of the rig is needed: {problems}")
        known = times.of(rig.rig_id)
        if known is not None and known.suits(rig.mirrors.low_pass_hz):
            rig.settle_us = known.settle_us
        rig.mirrors.enable()
        yield rig


def _rig_of(config: SimulatedRigConfig | SerialRigConfig, *, real_time: bool) -> Rig:
    if isinstance(config, SerialRigConfig) or real_time:
        return open_rig(config, guarded=True)
    from foveacam_hardware.sim.rig import simulated_rig

    return simulated_rig(config, inline=True)


def environment_of(rig: Rig, times: SettleTimes | None = None) -> StepEnvironment:
    """Return the environment of steps on an opened, enabled rig; `times`: stores settle times put in use."""

    def wait_after_moves(time: SettleTime) -> None:
        if times is not None:
            times.keep(time)
        rig.settle_us = time.settle_us

    @contextmanager
    def use(_what: str) -> Iterator[ExclusiveRig]:
        yield ExclusiveRig(head=rig.head, pan_tilt=rig.pan_tilt)

    return StepEnvironment(
        rig_id=rig.rig_id,
        baseline_m=rig.baseline_m,
        stations=rig.stations,
        clock=rig.clock,
        serials={role: rig.camera(role).info.serial for role in Role},
        fovea_settings=rig.left.settings,
        max_v=rig.mirrors.limits.max_v,
        markers=rig.markers,
        use=use,
        wait_after_moves=wait_after_moves,
    )
