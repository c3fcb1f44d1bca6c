"""The commands `foveacam depth card|check|add|list|remove`: networks as depth backends."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from foveacam_server.commands.options import DataOption, JsonOption
from foveacam_server.foundation.settings import checked_settings

if TYPE_CHECKING:
    from foveacam_pipeline.networks.check import NetworkCheck
    from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder

app = typer.Typer(
    name="depth",
    help="Stereo networks of your own as depth backends.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

CardArgument = Annotated[Path, typer.Argument(help="card of the network (YAML), beside its ONNX file")]
NameArgument = Annotated[str, typer.Argument(help="name of the network, as in its card")]


@app.command()
def card() -> None:
    """Print a template of a card with every key explained."""
    from foveacam_pipeline.networks.card import example_card

    typer.echo(example_card(), nl=False)


@app.command()
def check(path: CardArgument, *, as_json: JsonOption = False) -> None:
    """Run a network on a pair with known disparities, and report faults of the network or its card."""
    found = _checked(path)
    if as_json:
        from foveacam_server.resources.looking.depth_backends.documents import check_document

        typer.echo(check_document(found).model_dump_json())
    else:
        _print(found)
    if not found.passed:
        raise typer.Exit(1)


@app.command()
def add(path: CardArgument, *, data: DataOption = None) -> None:
    """Check a network and copy it into the data directory; a running server lists it at once."""
    found = _checked(path)
    _print(found)
    if not found.passed:
        raise typer.Exit(1)
    network = _folder(data).add(path)
    typer.echo(f"added {network.name} ({network.card.licence}); choose it in the console, or by REST:")
    typer.echo(
        "  curl -X PUT localhost:8000/api/v1/depth/backend -H 'Content-Type: application/json' "
        f'-d \'{{"name": "{network.name}"}}\''
    )


@app.command(name="list")
def list_networks(*, data: DataOption = None) -> None:
    """List the networks of the data directory."""
    networks = _folder(data).every()
    if not networks:
        typer.echo("no networks; `foveacam depth card` prints a card to begin with")
    for name, network in networks.items():
        if isinstance(network, str):
            typer.echo(f"{name}: cannot be used: {network}")
        else:
            research = ", research only" if network.card.research_only else ""
            typer.echo(f"{name}: {network.card.licence}{research}, {network.card.file}")


@app.command()
def remove(name: NameArgument, *, data: DataOption = None) -> None:
    """Delete a network from the data directory."""
    _folder(data).remove(name)
    typer.echo(f"removed {name}")


def _checked(path: Path) -> "NetworkCheck":
    from foveacam_pipeline.networks.card import load_network
    from foveacam_pipeline.networks.check import check_network

    return check_network(load_network(path))


def _folder(data: Path | None) -> "NetworkFolder":
    from foveacam_server.resources.looking.depth_backends.networks import NetworkFolder

    return NetworkFolder(checked_settings({"data": data}).data / "networks")


def _print(found: "NetworkCheck") -> None:
    for finding in found.findings:
        typer.echo(f"{'ok ' if finding.passed else 'NO '} {finding.what}: {finding.found}")
        if not finding.passed and finding.remedy:
            typer.echo(f"    {finding.remedy}")
    if found.compute_ms is not None and found.sgbm_ms is not None:
        typer.echo(f"    {found.compute_ms:.0f} ms a pair, semi-global matching {found.sgbm_ms:.0f} ms")
