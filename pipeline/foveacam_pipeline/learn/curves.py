"""The parts of the loss over the steps, as CSV and as a picture."""

import csv
from pathlib import Path

import numpy as np

from foveacam_pipeline.diagrams import figures_installed, new_figure
from foveacam_pipeline.storage.disk import disk_errors

CSV, PNG = "curves.csv", "curves.png"
SMOOTHED = 50
"""Number of steps over which the drawn curve is averaged."""


class LossCurves:
    """Collects the losses of a run; those of an earlier one, up to `steps`, are read from its file."""

    def __init__(self, folder: Path, *, steps: int) -> None:
        self._folder = folder
        self._rows: list[dict[str, float]] = [row for row in _read(folder / CSV) if row["step"] <= steps]

    def add(self, step: int, parts: dict[str, float]) -> None:
        """Add the parts of the loss at a step."""
        self._rows.append({"step": float(step), **parts})

    def write(self) -> None:
        """Write both files, unless there is no step yet."""
        if not self._rows:
            return
        with disk_errors("the curves", self._folder):
            with (self._folder / CSV).open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, fieldnames=list(self._rows[0]))
                writer.writeheader()
                writer.writerows(self._rows)
            if figures_installed():
                self._draw()

    def _draw(self) -> None:
        figure = new_figure((8, 4.5))
        axes = figure.subplots()
        steps = np.array([row["step"] for row in self._rows])
        for name in list(self._rows[0])[1:]:
            values = np.array([row[name] for row in self._rows])
            window = min(SMOOTHED, len(values))
            smooth = np.convolve(values, np.ones(window) / window, mode="valid")
            axes.plot(steps[window - 1 :], smooth, label=name)
        axes.set_xlabel("step")
        axes.set_ylabel(f"part of the loss, mean of {SMOOTHED} steps")
        axes.legend()
        axes.grid(alpha=0.3)
        figure.savefig(self._folder / PNG, dpi=120)


def _read(path: Path) -> list[dict[str, float]]:
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
