"""The files for containers and clusters: they parse, and every command in them is one that there is."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from foveacam_server.cli import app
from foveacam_server.foundation.settings import Settings

DOCKER = Path(__file__).parents[3] / "docker"
ADDRESS = "tcp://{host}:8786"


def services() -> dict[str, Any]:  # Any: YAML of unknown shape
    found: dict[str, Any] = yaml.safe_load((DOCKER / "compose.yaml").read_text())["services"]
    return found


def manifests() -> list[dict[str, Any]]:
    return list(yaml.safe_load_all((DOCKER / "cluster" / "kubernetes.yaml").read_text()))


def commands() -> Iterator[list[str]]:
    """Yield every command of our image, with its program."""
    for service in services().values():
        if service["image"] == "foveacam-duo":
            yield [*service.get("entrypoint", ["foveacam"]), *service["command"]]
    for manifest in manifests():
        for container in pods(manifest).get("containers", ()):
            yield container["command"]


def pods(manifest: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = manifest.get("spec", {}).get("template", {}).get("spec", {})
    return found


def parse(command: list[str]) -> None:
    """Parse a command by its program's own parser."""
    program, *rest = command
    if program == "foveacam":
        given: Any = typer.main.get_command(app)
        while hasattr(given, "commands"):
            given, rest = given.commands[rest[0]], rest[1:]
    else:
        from distributed.cli import dask_scheduler, dask_worker  # an extra, and slow to import

        given = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}[rest[0]]
        rest = rest[1:]
    known = {text for parameter in given.params for text in (*parameter.opts, *parameter.secondary_opts)}
    unknown = [word for word in rest if word.startswith("--") and word not in known]
    assert not unknown, f"No such option: {unknown}"  # Dask's own parser passes them on
    given.make_context(program, list(rest))


@pytest.mark.parametrize("command", list(commands()), ids=lambda command: " ".join(command[:3]))
def test_every_command_is_one_that_its_program_takes(command: list[str]) -> None:
    parse(command)


def test_what_no_program_takes_would_be_found() -> None:
    with pytest.raises(AssertionError, match="No such option"):
        parse(["dask", "worker", "--no-such-option"])


def test_the_cluster_of_compose_shares_the_data_and_has_no_port() -> None:
    scheduler, worker, server = (services()[name] for name in ("scheduler", "worker", "foveacam"))
    assert worker["volumes"] == server["volumes"]
    assert ADDRESS.format(host="scheduler") in worker["command"]
    assert "ports" not in scheduler
    assert scheduler["profiles"] == worker["profiles"] == ["cluster"]
    keys = {
        name.removeprefix("FOVEACAM_").lower()
        for name in server["environment"]
        if name.startswith("FOVEACAM_")
    }
    assert "cluster" in keys
    assert keys <= set(Settings.model_fields)


def test_the_pods_of_kubernetes_share_the_data_and_find_the_scheduler() -> None:
    by_kind = {(manifest["kind"], manifest["metadata"]["name"]): manifest for manifest in manifests()}
    assert ("Service", "foveacam-scheduler") in by_kind
    address = ADDRESS.format(host="foveacam-scheduler")
    for kind, name in (("Deployment", "foveacam-worker"), ("Job", "foveacam-batch")):
        (container,) = pods(by_kind[kind, name])["containers"]
        assert address in container["command"]
        assert container["volumeMounts"] == [{"name": "data", "mountPath": "/data"}]
        labels = by_kind[kind, name]["spec"]["template"]["metadata"]["labels"]
        assert labels["foveacam-batch"] == "true"
