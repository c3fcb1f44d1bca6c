"""S3-compatible storage for benches and tests: moto's server in a process of its own, on loopback."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import Any

from foveacam_hardware.contract import DeviceFault
from foveacam_pipeline.storage.archive.store import ENDPOINT

BUCKET = "rig"
START_S = 30.0
SMALLEST_PART_BYTES = 1 << 16
"""Smallest part of a large file that the server takes; Amazon's takes 5 MiB."""
CREDENTIALS = {
    "AWS_ACCESS_KEY_ID": "bench",
    "AWS_SECRET_ACCESS_KEY": "bench",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class StorageServer:
    """A running server with one empty bucket."""

    port: int

    @property
    def endpoint(self) -> str:
        """Its address."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def environment(self) -> Mapping[str, str]:
        """Variables by which a program reaches it."""
        return {**CREDENTIALS, ENDPOINT: self.endpoint}

    def client(self) -> Any:  # noqa: ANN401 - boto ships no types
        """Return a plain client of boto."""
        import boto3
        from botocore.config import Config

        return boto3.client(
            "s3",
            endpoint_url=self.endpoint,
            aws_access_key_id=CREDENTIALS["AWS_ACCESS_KEY_ID"],
            aws_secret_access_key=CREDENTIALS["AWS_SECRET_ACCESS_KEY"],
            region_name=CREDENTIALS["AWS_DEFAULT_REGION"],
            config=Config(connect_timeout=2, retries={"max_attempts": 0}),
        )


@contextmanager
def storage_server() -> Iterator[StorageServer]:
    """Start a server and yield it with its bucket; stop it afterwards."""
    server = StorageServer(port=free_port())
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(server.port)]
    environment = {**os.environ, **CREDENTIALS, "S3_UPLOAD_PART_MIN_SIZE": str(SMALLEST_PART_BYTES)}
    with subprocess.Popen(  # noqa: S603 - the project's own bench
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        try:
            _wait(server, process)
            with closing(server.client()) as client:
                client.create_bucket(Bucket=BUCKET)
            yield server
        finally:
            process.kill()


def free_port() -> int:
    """Return a free port of loopback."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def _wait(server: StorageServer, process: "subprocess.Popen[bytes]") -> None:
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s and process.poll() is None:
        try:
            socket.create_connection(("127.0.0.1", server.port), timeout=1.0).close()
        except OSError:
            time.sleep(0.05)
        else:
            return
    raise DeviceFault("moto's server did not start; install it: pip install 'foveacam-duo[dev]'")
