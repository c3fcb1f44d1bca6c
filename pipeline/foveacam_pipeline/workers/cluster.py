"""Workers of a Dask cluster. The sole importer of Dask."""

import socket
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.metadata import version
from importlib.util import find_spec
from typing import TYPE_CHECKING, ParamSpec, TypeVar
from urllib.parse import urlsplit

import cv2

from foveacam_hardware.contract import InvalidInput, NotConnected, install_command
from foveacam_pipeline.workers.pool import AHEAD, Part, PartLost, WorkersLost, WorkPool

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
P = ParamSpec("P")

PACKAGE = "foveacam-duo"
CONNECT_S = 10.0
"""Timeout of the scheduler's answer."""
WORKER_S = 10.0
"""Timeout of the scheduler's first worker."""
ONE_A_CORE = "--nworkers -1 --nthreads 1"
"""Options of `dask worker`: as many workers as the machine has cores, of one thread each."""
START_ONE = (
    "start one with `dask scheduler`, workers that have foveacam-duo with `dask worker ADDRESS "
    f"{ONE_A_CORE}`, and give its address, tcp://HOST:8786"
)
_turn = threading.Lock()


@contextmanager
def cluster_client(cluster: str) -> Generator["Client", None, None]:
    """Connect to the scheduler at an address, `tcp://HOST:PORT`, which has workers.

    Raise InvalidInput for what is no address and without the extra `cluster`, NotConnected where no scheduler
    answers, or one without workers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InvalidInput(
            f"the cluster {cluster} was asked for, and Dask is not installed; {install_command('cluster')}"
        ) from error
    _probe(cluster)
    try:
        client = Client(  # type: ignore[no-untyped-call]  # Dask ships no types
            cluster, timeout=CONNECT_S, set_as_default=False
        )
    except (OSError, ValueError) as error:
        raise NotConnected(f"what answers at {cluster} is no Dask scheduler; {START_ONE}") from error
    with client:
        _await_worker(client, cluster)
        yield client


@contextmanager
def cluster_workers(cluster: str, *, modules: Sequence[str] = ()) -> Generator[WorkPool, None, None]:
    """Use a cluster's workers as a pool; each computes one part at a time.

    `modules`: what a worker must be able to import beside the package. Raise as `cluster_client`, and
    InvalidInput for workers of another version, or without a module.
    """
    with cluster_client(cluster) as client:
        check_workers(client.run(_installed, modules, on_error="return"), modules)
        yield _Cluster(client, cluster)


def check_workers(installed: dict[str, object], modules: Sequence[str]) -> None:
    """Raise InvalidInput unless all workers have our version and the modules.

    `installed`: by the worker's address its version, and which of the modules it lacks; or an exception.
    """
    ours = version(PACKAGE)
    for worker, answer in installed.items():
        if not isinstance(answer, tuple):
            found, lacks = f"none ({answer})", []
        else:
            found, lacks = answer
        if found != ours:
            raise InvalidInput(
                f"the worker {worker} has another {PACKAGE} than this program: {found} instead of {ours}",
                asked=ours,
                found=found,
                remedy="install the same version there",
            )
        if lacks:
            raise InvalidInput(
                f"the worker {worker} cannot import {', '.join(lacks)}; start it where a checkout of "
                f"{PACKAGE} is installed with all that this needs",
                asked=", ".join(modules),
                found=", ".join(lacks),
            )


def _installed(modules: Sequence[str]) -> tuple[str, list[str]]:
    return version(PACKAGE), [name for name in modules if find_spec(name) is None]


class _Cluster:
    def __init__(self, client: "Client", address: str) -> None:
        self._client, self._address = client, address

    @property
    def most_under_way(self) -> int:
        """Number of parts to submit at a time, for the current workers."""
        with self._scheduler_within_reach():
            workers = self._client.scheduler_info(n_workers=-1)["workers"]
        return (1 + AHEAD) * max(1, len(workers))

    def submit(self, work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> Part[T]:
        """Submit a part to the scheduler; if a worker dies, another one computes the part."""
        with self._scheduler_within_reach():
            part: Part[T] = self._client.submit(_in_turn, work, *arguments, pure=False, **named)
        return part

    def result(self, part: Part[T]) -> T:
        """Wait for the result of a part."""
        from distributed import KilledWorker

        try:
            with self._scheduler_within_reach():
                return part.result()
        except KilledWorker as error:
            raise PartLost(
                f"workers of the cluster {self._address} ended again and again in one part of the work, "
                "perhaps for their memory",
                remedy="give the workers more memory, then start it again",
            ) from error

    @contextmanager
    def _scheduler_within_reach(self) -> Generator[None, None, None]:
        """Translate the errors of a lost scheduler into WorkersLost."""
        from distributed.comm.core import CommClosedError

        try:
            yield
        except Exception as error:
            lost = isinstance(error, CommClosedError | CancelledError)  # nobody cancels what is waited for
            if lost or self._client.status != "running":
                raise WorkersLost(
                    f"the scheduler at {self._address} is gone", remedy=f"{START_ONE}, then start it again"
                ) from error
            raise


def _in_turn(work: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T:
    """Compute one part at a time in a process: compiled code with threads of its own is not made for more.

    OpenCV uses as many threads as the worker was started with, not as many as the machine has cores.
    """
    from distributed import get_worker

    with _turn:
        cv2.setNumThreads(get_worker().state.nthreads)
        return work(*arguments, **named)


def _await_worker(client: "Client", cluster: str) -> None:
    """Raise NotConnected where a scheduler has no workers."""
    try:
        client.wait_for_workers(1, timeout=WORKER_S)
    except TimeoutError as error:
        raise NotConnected(
            f"the Dask scheduler at {cluster} has no workers; start some with `dask worker {cluster} "
            f"{ONE_A_CORE}` where foveacam-duo is installed"
        ) from error


def _probe(cluster: str) -> None:
    """Raise NotConnected where nothing listens; Dask's own client would retry for a long time."""
    found = urlsplit(cluster)
    try:
        host, port = found.hostname, found.port
    except ValueError:
        host, port = None, None
    if found.scheme not in ("tcp", "tls") or host is None or port is None:
        raise InvalidInput(f"{cluster!r} is no address of a Dask scheduler; {START_ONE}")
    try:
        socket.create_connection((host, port), timeout=CONNECT_S).close()
    except OSError as error:
        raise NotConnected(f"no Dask scheduler answers at {cluster}; {START_ONE}") from error
