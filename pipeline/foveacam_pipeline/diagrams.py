"""Matplotlib's figures, loaded when the first diagram is drawn; the extra `figures` installs it."""

from importlib.util import find_spec
from typing import TYPE_CHECKING

from foveacam_hardware.contract import InvalidInput, install_command

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figures_installed() -> bool:
    """Return whether Matplotlib is installed."""
    return find_spec("matplotlib") is not None


def check_figures(what: str) -> None:
    """Raise `InvalidInput` where Matplotlib is not installed; `what` needs it: "a reference's diagram"."""
    if not figures_installed():
        raise InvalidInput(
            f"{what} needs Matplotlib, which is not installed",
            asked=what,
            found="Matplotlib is not installed",
            remedy=install_command("figures"),
        )


def new_figure(size_in: tuple[float, float], *, dpi: int = 100) -> "Figure":
    """Return an empty figure of a size in inches; raise `InvalidInput` where Matplotlib is not installed."""
    check_figures("a diagram")
    from matplotlib.figure import Figure  # loads for seconds

    return Figure(figsize=size_in, dpi=dpi, layout="constrained")
