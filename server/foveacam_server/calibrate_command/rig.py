"""A rig for `foveacam calibrate`: opened here and now, a simulated one usually in virtual time."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Column

from foveacam_hardware.contract import NotConnected, Role
from foveacam_hardware.rig import Rig, open_rig
from foveacam_hardware.rig_config import SerialMirrorsConfig, SerialRigConfig, SimulatedRigConfig
from foveacam_pipeline.calibrate.fit.measured import NominalRig
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.calibrate_command.choices import CalibrateOptions
from foveacam_server.calibrating.sessions import SessionCollection
from foveacam_server.calibrating.settle_times import SettleTime, SettleTimes
from foveacam_server.calibrating.step_environment import ExclusiveRig, StepEnvironment
from foveacam_server.runtime.calibrations import CalibrationService
from foveacam_server.runtime.events import EventLog
from foveacam_server.runtime.opening import rig_config
from foveacam_server.runtime.store import Store
from foveacam_server.settings import Settings
from foveacam_server.simulation import check_simulation, compile_renderer

if TYPE_CHECKING:
    from foveacam_hardware.sim.presets import RigPreset


@dataclass(frozen=True, slots=True, kw_only=True)
class RigChoice:
    """Which rig: `real_time` alone makes a simulated one wait as a real one does."""

    settings: Settings
    seed: int | None = None
    real_time: bool = False

    @classmethod
    def of(cls, wish: CalibrateOptions) -> "RigChoice":
        """Return what a command was told."""
        return cls(settings=wish.settings, seed=wish.seed, real_time=wish.real_time)

    @property
    def config(self) -> SimulatedRigConfig | SerialRigConfig:
        """The rig's configuration."""
        config = rig_config(self.settings)
        if isinstance(config, SimulatedRigConfig) and self.seed is not None:
            return config.model_copy(update={"seed": self.seed})
        return config

    @property
    def rig_id(self) -> str:
        """What calibrations of this rig name."""
        config = self.config
        if isinstance(config, SerialRigConfig):
            return config.rig_id
        return _preset(config).rig_id(config.seed)

    @property
    def drive(self) -> "SerialMirrorsConfig | RigPreset":
        """Its drive filter and how long it waits after a move, as its file says."""
        config = self.config
        return config.mirrors if isinstance(config, SerialRigConfig) else _preset(config)

    @property
    def baseline_m(self) -> float:
        """Nominal distance between its mirrors."""
        config = self.config
        return config.baseline_m if isinstance(config, SerialRigConfig) else NominalRig(rig_id="").baseline_m


def _preset(config: SimulatedRigConfig) -> "RigPreset":
    from foveacam_hardware.sim.presets import find_preset

    return find_preset(config.preset)


@dataclass(frozen=True, slots=True, kw_only=True)
class LockedDataDirectory:
    """The data directory while one command works in it."""

    rig_id: str
    baseline_m: float
    calibration: CalibrationService
    sessions: SessionCollection
    drift_folder: Path
    settle_times: SettleTimes


@contextmanager
def opened_shop(choice: RigChoice) -> Iterator[LockedDataDirectory]:
    """Take the data directory for one command; raise `Busy` while a server has it."""
    with ExitStack() as stack:
        store = stack.enter_context(Store(choice.settings.data))
        events = EventLog(store)
        stack.callback(events.close)
        folder = store.subfolder("calibrations")
        calibration = CalibrationService(chosen=choice.settings.calibration, folder=folder, events=events)
        calibration.choose_for(choice.rig_id)
        yield LockedDataDirectory(
            rig_id=choice.rig_id,
            baseline_m=choice.baseline_m,
            calibration=calibration,
            sessions=SessionCollection(folder / "sessions"),
            drift_folder=folder / "drift",
            settle_times=SettleTimes(folder / "settle"),
        )


@contextmanager
def opened_workplace(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[StepEnvironment]:
    """Open the rig as the steps see it, and park it again at the end."""
    with opened_rig(choice, times, console=console) as rig:
        yield workplace_of(rig, times)


@contextmanager
def opened_rig(choice: RigChoice, times: SettleTimes, *, console: Console) -> Iterator[Rig]:
    """Open and enable the rig, refuse one that lacks a device, and park it again at the end."""
    config = choice.config
    if isinstance(config, SimulatedRigConfig):
        check_simulation(config)
        compile_renderer(console)
    with _rig_of(config, real_time=choice.real_time) as rig:
        if rig.problems:
            told = "; ".join(f"{problem.device}: {problem.detail}" for problem in rig.problems)
            raise NotConnected(f"every device of the rig is needed: {told}")
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


def workplace_of(rig: Rig, times: SettleTimes | None = None) -> StepEnvironment:
    """Return a rig that is opened and enabled as the steps see it; `times`: where settle times are kept."""

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


class CalibrationProgressBar:
    """Implements `StepWatcher` with a bar and the time left on the terminal; silent with `--json`."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self._task: TaskID | None = None
        self.fitted_ids: list[str] = []

    def stage(self, name: str) -> None:
        """Begin another bar; the one before is over."""
        self.finish()
        if self._progress is not None:
            self._task = self._progress.add_task(name, total=None, note="")

    def finish(self) -> None:
        """Fill the bar."""
        if self._progress is not None and self._task is not None:
            total = self._progress.tasks[self._task].total
            self._progress.update(self._task, completed=total)

    def progress(self, done: int, *, total: int, note: str = "") -> None:
        """Move the bar."""
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, completed=done, total=total, note=note.replace("[", "\\["))

    def cancelled(self) -> bool:
        """Go on; Ctrl-C ends it."""
        return False

    def show(self, name: str, image: NDArray[np.uint8]) -> None:
        """Look away."""

    def sample(self, sample_id: str) -> None:
        """Ignore it."""

    def pose(self, station: str, *, index: int, left: str, right: str) -> None:
        """Ignore it: the note says so."""

    def fitted(self, calibration: Calibration) -> None:
        """Remember it."""
        self.fitted_ids.append(calibration.id)


@contextmanager
def watching(console: Console, *, silent: bool) -> Iterator[CalibrationProgressBar]:
    """Show what a step does, unless `silent`."""
    if silent:
        yield CalibrationProgressBar(None)
        return
    columns = (
        TextColumn("{task.description:>7}", table_column=Column(no_wrap=True, min_width=7)),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", table_column=Column(no_wrap=True, overflow="ellipsis", ratio=1)),
    )
    with Progress(*columns, console=console, expand=True) as progress:
        watch = CalibrationProgressBar(progress)
        yield watch
        watch.finish()
