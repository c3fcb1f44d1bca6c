"""Exports a trained network into the package as the shipped one, with its card and its figures.

`python -m foveacam_bench.learned.ship CHECKPOINT --pairs TRAIN --held-out HELD [--data FOLDER]` exports the
checkpoint, fits the curve of its sigma on pairs that it was trained on, measures it on held-out ones, and
writes `networks/shipped/`: `foveal.onnx`, `foveal.yaml`, `CARD.md`.
"""

import shutil
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer

from foveacam_bench.depth.error_fit import LEAST_ERROR_PX, fit_quantile
from foveacam_bench.figures import Figures
from foveacam_bench.learned.serving import network_figures
from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.learn.checkpoint import Checkpoint, load_checkpoint
from foveacam_pipeline.learn.export import LAPLACE, SigmaCurve, export_network
from foveacam_pipeline.learn.network.refinement import CELL_PX
from foveacam_pipeline.learn.pair_folder import PairSample, StoredPairs
from foveacam_pipeline.networks.card import SHIPPED, SHIPPED_NAME, StereoNetwork, load_network
from foveacam_pipeline.networks.estimator import NetworkEstimator, largest_deviation_px
from foveacam_pipeline.stereo.refine import seen_at_right

LICENCE = "MIT"
STRIDE_PX = 4
"""Stride of the rows and columns on which the factor is fitted."""
LARGEST_BYTES = 4 << 20
TEMPLATE = Path(__file__).parent / "card_template.md"


def ship(checkpoint: Path, *, pairs: Path, held_out: Path, data: Path | None) -> StereoNetwork:
    """Write the shipped network; return it. Raise InvalidInput for one above 4 MiB."""
    trained, training = load_checkpoint(checkpoint), StoredPairs(pairs)
    with TemporaryDirectory() as name:
        folder = Path(name)
        raw = _exported(trained, folder / "raw", LAPLACE)
        curve = fit_sigma_curve(NetworkEstimator.open(raw), training)
        network = _exported(trained, folder / "fitted", curve)
        size = network.graph.stat().st_size
        if size > LARGEST_BYTES:
            raise InvalidInput(
                f"the graph has {size} bytes, at most {LARGEST_BYTES} ship; train a smaller size"
            )
        figures = network_figures(network, quick=False, data=data, pairs=held_out)
        SHIPPED.mkdir(exist_ok=True)
        for path in (network.graph, network.folder / f"{SHIPPED_NAME}.yaml"):
            shutil.copyfile(path, SHIPPED / path.name)
    document = _document(trained, training, StoredPairs(held_out), figures, size=size, curve=curve)
    (SHIPPED / "CARD.md").write_text(document, encoding="utf-8")
    return load_network(SHIPPED / f"{SHIPPED_NAME}.yaml")


def fit_sigma_curve(estimator: NetworkEstimator, samples: Iterable[PairSample]) -> SigmaCurve:
    """Return the curve of the stated deviation below which 68.3 % of the errors of kept pixels lie."""
    errors, deviations = [], []
    every = np.s_[::STRIDE_PX, ::STRIDE_PX]
    for sample in samples:
        disparity_px, deviation_px = estimator.answer(sample.pair)
        if sample.truth is None or deviation_px is None:
            continue
        used = sample.truth.both & seen_at_right(disparity_px, sample.pair.valid_right)
        used = (used & (deviation_px <= largest_deviation_px()))[every]
        errors.append(np.abs(disparity_px - sample.truth.disparity_px)[every][used])
        deviations.append(deviation_px[every][used])
    log_error = np.log(np.maximum(np.concatenate(errors), LEAST_ERROR_PX)).astype(np.float64)
    log_deviation = np.log(np.concatenate(deviations)).astype(np.float64)
    cues = np.column_stack([np.ones_like(log_deviation), log_deviation])
    log_factor, power = fit_quantile(cues, log_error, np.full(len(cues), 1.0 / len(cues))).tolist()
    return SigmaCurve(factor=float(np.exp(log_factor)), power=power)


def _exported(trained: Checkpoint, folder: Path, curve: SigmaCurve) -> StereoNetwork:
    card = export_network(trained, folder, name=SHIPPED_NAME, licence=LICENCE, curve=curve)
    return load_network(card)


def _document(
    trained: Checkpoint,
    training: StoredPairs,
    held_out: StoredPairs,
    figures: Figures,
    *,
    size: int,
    curve: SigmaCurve,
) -> str:
    facts, config = trained.facts, trained.network().config
    rows = "\n".join(f"| `{name}` | {_shown(value)} |" for name, value in figures.items())
    return TEMPLATE.read_text(encoding="utf-8").format(
        size_name=config.size,
        steps=facts.steps,
        steps_planned=facts.steps_planned,
        seed=facts.seed,
        started=f", begun with the weights of {facts.started_from}" if facts.started_from else "",
        datasets=", ".join(f"{name} ({digest[:16]}…)" for name, digest in facts.datasets.items()),
        pairs=len(training),
        pairs_seed=training.document.seed,
        held_out=len(held_out),
        held_out_seed=held_out.document.seed,
        width=held_out.document.width,
        height=held_out.document.height,
        reach_px=CELL_PX * config.reach_cells,
        kilobytes=round(size / 1e3),
        factor=curve.factor,
        power=curve.power,
        licence=LICENCE,
        figures=rows,
    )


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def main(
    checkpoint: Annotated[Path, typer.Argument(help="checkpoint (.safetensors) of `foveacam learn train`")],
    pairs: Annotated[Path, typer.Option(help="folder of the pairs that it was trained on")],
    held_out: Annotated[Path, typer.Option(help="folder of held-out pairs")],
    data: Annotated[Path | None, typer.Option(help="folder of real pairs (aloe/, tsukuba/)")] = None,
) -> None:
    """Export a trained network into the package as the shipped one, with its card and its figures."""
    network = ship(checkpoint, pairs=pairs, held_out=held_out, data=data)
    typer.echo(f"{network.graph}: {network.card.sha256}")


if __name__ == "__main__":
    typer.run(main)
