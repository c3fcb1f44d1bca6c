"""The rig of the settings, and the preparation of a simulated rig for a command."""

from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from foveacam_hardware.rig_config import SerialRigConfig, SimulatedRigConfig, load_rig_config
from foveacam_server.foundation.settings import Settings
from foveacam_server.rig.hardware_thread.kernel_preparation import KernelProgress, prepare_kernels


def rig_config(settings: Settings) -> SimulatedRigConfig | SerialRigConfig:
    """Return the configuration of the settings' rig; raise `InvalidInput` for a file that cannot be used."""
    if settings.rig == "sim":
        return SimulatedRigConfig(scene=settings.scene, preset=settings.preset)
    return load_rig_config(Path(settings.rig))


class ChosenRig:
    """The rig to open: first the command line's, later one chosen while the server runs."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings

    @property
    def name(self) -> str:
        """`sim`, or the path of a rig file."""
        return self._settings.rig

    @property
    def scene(self) -> str:
        """Scene of the built-in simulated rig: a shipped name, or the path of a scene file."""
        return self._settings.scene

    def choose(self, name: str, *, scene: str | None = None) -> None:
        """Choose another rig, which takes effect when the rig is opened the next time.

        `scene`: of the built-in simulated rig; None: the present one.
        """
        self._settings = self._settings.model_copy(update={"rig": name, "scene": scene or self.scene})

    def config(self) -> SimulatedRigConfig | SerialRigConfig:
        """Return the rig's configuration; raise `InvalidInput` for a file that cannot be used."""
        return rig_config(self._settings)


def check_simulation(config: SimulatedRigConfig) -> None:
    """Raise `InvalidInput` for an unknown preset or scene."""
    from foveacam_hardware.sim.presets import find_preset
    from foveacam_hardware.sim.scenes.loader import load_scene

    find_preset(config.preset)
    load_scene(config.scene)


def shipped_scenes() -> dict[str, str]:
    """Return the title of each scene in which the built-in simulated rig can be opened, by its name."""
    from foveacam_hardware.sim.scenes.loader import scene_titles

    return scene_titles()


def compile_renderer(console: Console) -> None:
    """Prepare the renderer of the simulated rig, which takes half a minute the first time."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("preparing the simulated rig (first start: half a minute)", total=None)

        def show(kernels: KernelProgress) -> None:
            progress.update(task, completed=kernels.done, total=kernels.total)

        prepare_kernels(show, cancelled=lambda: False)
