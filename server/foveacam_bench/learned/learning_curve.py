"""The learning curve of runs that continued from each other's weights, and its extrapolation.

`python -m foveacam_bench.learned.learning_curve RUN... --out FILE.svg` joins their `curves.csv` in the order
given, fits loss = a + b steps^-c, draws both, and prints the figures as JSON.
"""

import csv
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from scipy.optimize import curve_fit

PART = "truth"
MEANS = 60
"""Number of points of the curve, each the mean of an equal block of steps."""
FIRST_SHARE = 0.02
"""Share of the steps left out of the fit: the learning rate rises there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaw:
    """loss = floor + scale * steps^-exponent."""

    floor: float
    scale: float
    exponent: float

    def at(self, steps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the loss after a number of steps."""
        return self.floor + self.scale * steps**-self.exponent


def read_losses(runs: Sequence[Path], *, part: str = PART) -> NDArray[np.float64]:
    """Return a part of the loss at every step of all runs, one after the other."""
    losses: list[float] = []
    for run in runs:
        with (run / "curves.csv").open(newline="") as file:
            losses += [float(row[part]) for row in csv.DictReader(file)]
    return np.array(losses)


def block_means(losses: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middles of equal blocks of steps, and their mean losses."""
    blocks = np.array_split(losses, MEANS)
    ends = np.cumsum([len(block) for block in blocks])
    middles = ends - np.array([len(block) for block in blocks]) / 2.0
    return middles, np.array([block.mean() for block in blocks])


def fit_power_law(steps: NDArray[np.float64], losses: NDArray[np.float64]) -> PowerLaw:
    """Return the law that fits the means best, with a floor of 0 or more."""
    start = (0.5 * float(losses.min()), float(losses[0]), 0.3)
    (floor, scale, exponent), _ = curve_fit(
        lambda n, a, b, c: a + b * n**-c, steps, losses, p0=start, bounds=([0.0, 0.0, 0.0], [1.0, 1e3, 2.0])
    )
    return PowerLaw(floor=float(floor), scale=float(scale), exponent=float(exponent))


def main(
    runs: Annotated[list[Path], typer.Argument(help="folders of training, in their order")],
    out: Annotated[Path, typer.Option(help="picture to write, .svg or .png")],
) -> None:
    """Draw the curve and print the law."""
    losses = read_losses(runs)
    steps, means = block_means(losses)
    settled = steps > FIRST_SHARE * len(losses)
    law = fit_power_law(steps[settled], means[settled])
    _draw(out, steps, means, law)
    figures = {
        "steps": len(losses),
        "floor": law.floor,
        "exponent": law.exponent,
        "residual": float(np.std(means[settled] - law.at(steps[settled]))),
    }
    for factor in (1, 2, 10):
        figures[f"at_{factor}x_steps"] = float(law.at(np.array(float(factor * len(losses)))))
    sys.stdout.write(json.dumps(figures, indent=1) + "\n")


def _draw(out: Path, steps: NDArray[np.float64], means: NDArray[np.float64], law: PowerLaw) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    line = np.geomspace(steps[0], 10.0 * steps[-1], 200)
    axes.loglog(steps, means, "o", ms=3, label="mean of the steps")
    formula = f"{law.floor:.2f} + {law.scale:.1f} steps$^{{-{law.exponent:.2f}}}$"
    axes.loglog(line, law.at(line), label=formula)
    axes.axvline(steps[-1], ls=":", color="0.5")
    axes.set_xlabel("steps, all runs together")
    axes.set_ylabel("loss by the truth")
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    figure.savefig(out, metadata={"Date": None} if out.suffix == ".svg" else None)


if __name__ == "__main__":
    typer.run(main)
