"""A typed client of a FoveaCam Duo server, synchronous and asynchronous.

    with foveacam_client.connect("http://127.0.0.1:8000") as rig:
        fixation = rig.fixate(700, 520)
        print(fixation.distance_m, fixation.distance_sigma_m)

README.md beside it has all of it on a page, with recipes.
"""

import os
from pathlib import Path

from foveacam_client.async_following import AsyncFollowing
from foveacam_client.async_remote_dataset import AsyncRemoteDataset
from foveacam_client.async_rig import AsyncRig
from foveacam_client.call import StartedJob
from foveacam_client.clouds import PointCloud
from foveacam_client.connection import DEFAULT_URL, URL_VARIABLE, Connection, token_of
from foveacam_client.dataset_values import RemotePoint
from foveacam_client.fixation_result import FixationResult
from foveacam_client.generated import models
from foveacam_client.generated.following import Following
from foveacam_client.generated.remote_dataset import RemoteDataset
from foveacam_client.generated.rig import Rig
from foveacam_client.pictures import decode_picture
from foveacam_client.problems import (
    ClientError,
    Conflict,
    DeviceFailed,
    DeviceMissing,
    DeviceTimeout,
    DiskFull,
    InvalidRequest,
    JobCancelled,
    JobInterrupted,
    LeaseLost,
    NotAllowed,
    NotFound,
    NotSignedIn,
    ProblemError,
    RigBusy,
    RigNotCalibrated,
    RigStopped,
    ServerFault,
    TargetOutOfRange,
    TooManyRequests,
    UnexpectedAnswer,
    Unreachable,
    WaitTimeout,
)
from foveacam_client.retries import RetryPolicy

__all__ = [
    "AsyncFollowing",
    "AsyncRemoteDataset",
    "AsyncRig",
    "ClientError",
    "Conflict",
    "Connection",
    "DeviceFailed",
    "DeviceMissing",
    "DeviceTimeout",
    "DiskFull",
    "FixationResult",
    "Following",
    "InvalidRequest",
    "JobCancelled",
    "JobInterrupted",
    "LeaseLost",
    "NotAllowed",
    "NotFound",
    "NotSignedIn",
    "PointCloud",
    "ProblemError",
    "RemoteDataset",
    "RemotePoint",
    "RetryPolicy",
    "Rig",
    "RigBusy",
    "RigNotCalibrated",
    "RigStopped",
    "ServerFault",
    "StartedJob",
    "TargetOutOfRange",
    "TooManyRequests",
    "UnexpectedAnswer",
    "Unreachable",
    "WaitTimeout",
    "connect",
    "connect_async",
    "decode_picture",
    "models",
]


def connect(
    url: str | None = None,
    *,
    token: str | None = None,
    token_file: Path | str | None = None,
    ca_file: Path | str | None = None,
    timeout_s: float = 30.0,
) -> Rig:
    """Return the rig of a server.

    `url`: else that of the variable FOVEACAM_URL, else http://127.0.0.1:8000. `token`: of a service; else
    that of `token_file`, else that of the variable FOVEACAM_TOKEN. `ca_file`: PEM of the authority of the
    server's certificate.
    """
    return Rig(_connection(url, token, token_file, ca_file, timeout_s))


def connect_async(
    url: str | None = None,
    *,
    token: str | None = None,
    token_file: Path | str | None = None,
    ca_file: Path | str | None = None,
    timeout_s: float = 30.0,
) -> AsyncRig:
    """Return the rig of a server for asyncio; arguments as of `connect`."""
    return AsyncRig(_connection(url, token, token_file, ca_file, timeout_s))


def _connection(
    url: str | None,
    token: str | None,
    token_file: Path | str | None,
    ca_file: Path | str | None,
    timeout_s: float,
) -> Connection:
    return Connection(
        url=url or os.environ.get(URL_VARIABLE) or DEFAULT_URL,
        token=token_of(token, token_file),
        ca_file=None if ca_file is None else Path(ca_file),
        timeout_s=timeout_s,
    )
