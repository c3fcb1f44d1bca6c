"""The commands `foveacam learn pairs|train|prior|evaluate|export|info`, which need the extra `learn`."""

from pathlib import Path
from typing import Annotated

import typer

from foveacam_server.commands.options import ClusterOption, JsonOption, parse_pair

app = typer.Typer(
    name="learn",
    help="Train a stereo network on what the rig captured, or on simulated pairs with truth (Sec. 5).",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

DatasetsArgument = Annotated[
    list[Path], typer.Argument(help="verged pairs: captured datasets, recordings (.fcap), folders of `pairs`")
]
CheckpointArgument = Annotated[Path, typer.Argument(help="checkpoint (.safetensors)")]
CROP = "256x160"
PAIR_SIZE = "360x270"


@app.command()
def pairs(
    *,
    out: Annotated[Path, typer.Option(help="folder for the pairs; an existing one is resumed")],
    count: Annotated[int, typer.Option(help="pairs in all", min=1, max=10_000_000)],
    seed: Annotated[int, typer.Option(help="seed of the stream of pairs", min=0)] = 0,
    split: Annotated[str, typer.Option(help="train, or held-out: other scenes and textures")] = "train",
    size: Annotated[
        str, typer.Option(help="width and height, px: 360x270, 720x540 or 1440x1080")
    ] = PAIR_SIZE,
    workers: Annotated[int, typer.Option(help="processes", min=1, max=256)] = 1,
    cluster: ClusterOption = None,
    as_json: JsonOption = False,
) -> None:
    """Render verged pairs of random scenes with their truth."""
    from foveacam_server.resources.studying.learning.simulated_pairs import PairRequest, run_pairs

    request = PairRequest(
        out=out,
        count=count,
        seed=seed,
        split=split,
        size=parse_pair(size, option="--size", example=PAIR_SIZE) or (0, 0),
        workers=workers,
        cluster=cluster,
    )
    run_pairs(request, as_json=as_json)


@app.command()
def train(
    datasets: DatasetsArgument,
    *,
    out: Annotated[Path, typer.Option(help="folder for checkpoint and curves; an existing one is resumed")],
    held_out: Annotated[
        list[Path] | None,
        typer.Option(help="dataset of another scene for evaluation; again for more"),
    ] = None,
    size: Annotated[str, typer.Option(help="nano, tiny, small or base")] = "nano",
    steps: Annotated[int, typer.Option(help="steps in all", min=1, max=10_000_000)] = 2000,
    batch: Annotated[int, typer.Option(help="crops a step", min=1, max=256)] = 4,
    crop: Annotated[str, typer.Option(help="width and height of a crop, px, multiples of 8")] = CROP,
    seed: Annotated[int, typer.Option(help="seed of all that is drawn at random", min=0)] = 0,
    truth: Annotated[
        bool, typer.Option("--truth/--no-truth", help="supervise by the truth of pairs that have it")
    ] = True,
    prior: Annotated[
        str, typer.Option(help="loss by a monocular prior: none, annealed (to nothing) or full (constant)")
    ] = "none",
    prior_network: Annotated[
        Path | None,
        typer.Option(help="checkpoint of `learn prior`, or folder of Depth-Anything-V2 (extra `prior`)"),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            help="term of the loss to omit: photometric, reconstruction, smoothness; again for more"
        ),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option("--from", help="checkpoint of the same size for initial weights"),
    ] = None,
    device: Annotated[str, typer.Option(help="auto (a GPU where there is one), cpu or cuda")] = "auto",
    precision: Annotated[
        str, typer.Option(help="of features: auto (bfloat16 on a GPU), float32 or bfloat16")
    ] = "auto",
    workers: Annotated[
        int | None,
        typer.Option(help="processes that make crops; by default none on a processor", min=0, max=256),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Train on datasets and evaluate on a held-out scene; after Ctrl-C, repeat the command to resume."""
    from foveacam_server.resources.studying.learning.run import TrainingOrder, run_training

    order = TrainingOrder(
        datasets=tuple(datasets),
        held_out=tuple(held_out or ()),
        out=out,
        size=size,
        steps=steps,
        batch=batch,
        crop_px=parse_pair(crop, option="--crop", example=CROP) or (0, 0),
        seed=seed,
        truth=truth,
        prior=prior,
        prior_network=prior_network,
        without=tuple(without or ()),
        start=start,
        device=device,
        precision=precision,
        workers=workers,
    )
    run_training(order, as_json=as_json)


@app.command(name="prior")
def train_prior(
    datasets: Annotated[list[Path], typer.Argument(help="folders of pairs with truth, of `pairs`")],
    *,
    out: Annotated[Path, typer.Option(help="folder for checkpoint and curves; an existing one is resumed")],
    steps: Annotated[int, typer.Option(help="steps in all", min=1, max=10_000_000)] = 2000,
    batch: Annotated[int, typer.Option(help="crops a step", min=1, max=256)] = 4,
    crop: Annotated[str, typer.Option(help="width and height of a crop, px, multiples of 8")] = CROP,
    seed: Annotated[int, typer.Option(help="seed of all that is drawn at random", min=0)] = 0,
    as_json: JsonOption = False,
) -> None:
    """Train a monocular prior (relative inverse depth of one picture) for `learn train --prior-network`."""
    from foveacam_server.resources.studying.learning.run import PriorOrder, run_prior

    order = PriorOrder(
        datasets=tuple(datasets),
        out=out,
        steps=steps,
        batch=batch,
        crop_px=parse_pair(crop, option="--crop", example=CROP) or (0, 0),
        seed=seed,
    )
    run_prior(order, as_json=as_json)


@app.command()
def evaluate(
    checkpoint: CheckpointArgument,
    datasets: DatasetsArgument,
    *,
    cluster: ClusterOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compare a network with semi-global matching on datasets, by photometric error and truth."""
    from foveacam_server.resources.studying.learning.run import run_evaluation

    run_evaluation(checkpoint, datasets, cluster=cluster, as_json=as_json)


@app.command()
def export(
    checkpoint: CheckpointArgument,
    *,
    name: Annotated[str, typer.Option(help="name of the depth backend: small letters, digits, - and _")],
    out: Annotated[Path, typer.Option(help="folder for the ONNX file and its card")],
    licence: Annotated[str, typer.Option(help="licence of the weights")] = "own work",
) -> None:
    """Write a network as ONNX with its card, for `foveacam depth add`."""
    from foveacam_server.resources.studying.learning.run import run_export

    run_export(checkpoint, name=name, out=out, licence=licence)


@app.command()
def info(checkpoint: CheckpointArgument) -> None:
    """Print a checkpoint's record of its training as JSON."""
    from foveacam_server.resources.studying.learning.run import run_info

    run_info(checkpoint)
