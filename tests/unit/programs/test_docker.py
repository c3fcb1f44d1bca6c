"""The compose file and the image, as far as they can be examined without a container engine."""

import json
import re
from collections.abc import Mapping
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any

import pytest
import yaml

from foveacam_server.foundation.settings import Settings

DOCKER = Path(__file__).parents[3] / "docker"
Service = Mapping[str, Any]  # Any: YAML


@pytest.fixture
def services() -> Mapping[str, Service]:
    found: Mapping[str, Service] = yaml.safe_load((DOCKER / "compose.yaml").read_text())["services"]
    return found


def test_only_the_proxy_is_reached_from_other_machines(services: Mapping[str, Service]) -> None:
    published = {
        name: [port.startswith("127.0.0.1:") for port in service["ports"]]
        for name, service in services.items()
        if "ports" in service
    }
    assert published.pop("proxy") == [False, False]
    assert list(published.values()) == [[True]] * 3


def test_the_server_believes_the_proxy_alone(services: Mapping[str, Service]) -> None:
    proxies = json.loads(services["foveacam"]["environment"]["FOVEACAM_TRUSTED_PROXIES"])
    assert proxies == [services["proxy"]["networks"]["default"]["ipv4_address"]]
    text = (DOCKER / "compose.yaml").read_text()
    subnet = yaml.safe_load(text)["networks"]["default"]["ipam"]["config"][0]["subnet"]
    assert ip_address(proxies[0]) in ip_network(subnet)


def test_only_the_server_starts_without_a_profile(services: Mapping[str, Service]) -> None:
    assert [name for name, service in services.items() if "profiles" not in service] == ["foveacam"]
    profiles = {profile for service in services.values() for profile in service.get("profiles", [])}
    assert profiles == {"proxy", "watching", "traces", "cluster"}


def test_the_files_that_are_mounted_are_there(services: Mapping[str, Service]) -> None:
    mounted = [
        volume.partition(":")[0]
        for service in services.values()
        for volume in service.get("volumes", [])
        if volume.startswith("./")
    ]
    assert len(mounted) == 6
    assert all((DOCKER / path).is_file() for path in mounted)


def test_the_command_for_traces_names_the_service_that_takes_them(services: Mapping[str, Service]) -> None:
    text = (DOCKER / "README.md").read_text()
    command = re.search(r"OTEL_EXPORTER_OTLP_ENDPOINT=(\S+) docker compose .* --profile (\S+) up", text)
    assert command is not None
    endpoint = Settings(otlp_endpoint=command[1]).otlp_endpoint
    host = (endpoint or "").removeprefix("http://").partition(":")[0]
    assert command[2] in services[host]["profiles"]
    assert command[0] in (DOCKER / "compose.yaml").read_text()
    assert "OTEL_EXPORTER_OTLP_ENDPOINT" in services["foveacam"]["environment"]
    assert re.search(r"'\.\[\S*\btelemetry\b", (DOCKER / "Dockerfile").read_text())


def test_without_a_collector_there_are_no_traces() -> None:
    assert Settings(otlp_endpoint="").otlp_endpoint is None


def test_what_the_image_runs_while_it_is_built_can_be_imported() -> None:
    text = (DOCKER / "Dockerfile").read_text()
    imported = re.findall(r"from (foveacam\S+) import (\w+)", text)
    assert imported
    assert all(hasattr(import_module(module), name) for module, name in imported)


def test_the_replay_reads_every_instruction_of_the_image() -> None:
    spec = spec_from_file_location("replay", DOCKER / "replay.py")
    assert spec is not None and spec.loader is not None
    replay = module_from_spec(spec)
    spec.loader.exec_module(replay)
    found = list(replay.instructions((DOCKER / "Dockerfile").read_text()))
    names = [name for name, _ in found]
    assert set(names) <= {
        *("FROM", "WORKDIR", "COPY", "RUN", "ENV", "USER", "VOLUME", "EXPOSE"),
        *("HEALTHCHECK", "ENTRYPOINT", "CMD"),
    }
    assert names[-1] == "CMD"
    assert replay.arguments_of(dict(found)["HEALTHCHECK"])[:2] == ["python", "-c"]
    assert replay.arguments_of(dict(found)["ENTRYPOINT"]) == ["foveacam"]
