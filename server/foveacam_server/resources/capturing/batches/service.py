"""Makes batches of captures as jobs in a child process, one at a time, and serves their products."""

import hashlib
import json
import logging
import shutil
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from foveacam_hardware.contract import Busy, InvalidInput
from foveacam_pipeline.networks.card import StereoNetwork
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.datasets.collection import readable_dataset
from foveacam_server.datasets.derived_products import WAIT, DerivedProductTools, run_reporting
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext
from foveacam_server.foundation.whole_file import read_document, write_document
from foveacam_server.resources.capturing.batches.process import ChildOrder
from foveacam_server.resources.capturing.batches.schema import (
    BatchDocument,
    BatchFailureDocument,
    BatchRequest,
)

JOB = "batch"
PROCESS = "foveacam_server.resources.capturing.batches.process"
_log = logging.getLogger(__name__)

URL = "/api/v1/batches"
REQUEST, FORM, VERSION = "request.json", "foveacam-batch-request", 1


class _SummaryFile(BaseModel):
    """The part of KIND.json that is read."""

    planned: int
    done: int
    failed: list[BatchFailureDocument]


@dataclass(frozen=True, slots=True, kw_only=True)
class _StoredBatch:
    id: str
    folder: Path
    request: BatchRequest


class BatchService:
    """The batches of this data directory; callable from any thread."""

    def __init__(
        self,
        folder: Path,
        tools: DerivedProductTools,
        *,
        cluster: str | None,
        network_in_use: Callable[[], StereoNetwork | None],
    ) -> None:
        """`cluster`: the Dask scheduler of the server's settings.

        `network_in_use`: called when a batch begins.
        """
        self._folder, self._tools = folder, tools
        self.cluster, self._network_in_use = cluster or None, network_in_use
        self._lock = threading.Lock()
        self._live: tuple[str, str] | None = None
        """Ids of the batch that is being made, and of its job."""
        tools.jobs.handle(JOB, self._work, parallel=True)

    def start(self, request: BatchRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a batch, or the rest of an interrupted one; raise NotFound, InvalidInput or Busy."""
        jobs = self._tools.jobs
        if jobs.has_key(idempotency_key):
            return jobs.submit(JOB, request, idempotency_key=idempotency_key)
        self._datasets(request)
        if request.cluster and self.cluster is None:
            raise InvalidInput(
                "a batch on a cluster was asked for, and the server knows none",
                asked="a batch on a cluster",
                found="no FOVEACAM_CLUSTER",
                remedy="start it with FOVEACAM_CLUSTER=tcp://HOST:8786",
            )
        stored = self._stored(request)
        with self._lock:
            live = self._live_job()
            if live is not None:
                raise Busy(f"a batch is being made (job {live.id})", found=live.id, remedy=WAIT)
            document = {"format": FORM, "version": VERSION, "request": request.as_json()}
            write_document(stored.folder / REQUEST, document, what="a batch")
            job = jobs.submit(JOB, request, idempotency_key=idempotency_key)
            self._live = stored.id, job.id
        return job

    def every(self) -> list[BatchDocument]:
        """Return all batches, by id."""
        return [self.get(path.parent.name) for path in sorted(self._folder.glob(f"*/{REQUEST}"))]

    def get(self, batch_id: str) -> BatchDocument:
        """Return one batch; raise NotFound."""
        stored = self._require(batch_id)
        kind, url = stored.request.kind, f"{URL}/{batch_id}"
        job = self._live_job() if self._live is not None and self._live[0] == batch_id else None
        summary = _summary(stored.folder / f"{kind}.json")
        picture = stored.folder / f"{kind}.png"
        return BatchDocument(
            id=batch_id,
            kind=kind,
            capture_ids=list(stored.request.capture_ids),
            job_id=None if job is None else job.id,
            planned=None if summary is None else summary.planned,
            done=None if summary is None else summary.done,
            failed=[] if summary is None else summary.failed,
            url=url,
            picture_url=f"{url}/overview.png" if picture.is_file() else None,
            download_url=None if summary is None else f"{url}/download.zip",
        )

    def picture(self, batch_id: str) -> Path:
        """Return the path of a batch's picture; raise NotFound."""
        stored = self._require(batch_id)
        return self._existing(stored, f"{stored.request.kind}.png")

    def folder(self, batch_id: str) -> Path:
        """Return the folder of a batch that has been run; raise NotFound, Busy while it is being made."""
        stored = self._require(batch_id)
        self._existing(stored, f"{stored.request.kind}.json")
        self._check_idle(batch_id, "download it")
        return stored.folder

    def remove(self, batch_id: str) -> None:
        """Remove a batch and its products; raise NotFound, Busy while it is being made."""
        stored = self._require(batch_id)
        self._check_idle(batch_id, "remove it")
        with disk_errors("removing a batch", self._folder):
            shutil.rmtree(stored.folder)

    def _work(self, context: JobContext) -> str:
        request = context.job.parse_request(BatchRequest)
        stored, network = self._stored(request), self._network_in_use()
        order = ChildOrder(
            kind=request.kind,
            to=request.to,
            datasets=tuple(self._datasets(request)),
            out=stored.folder,
            cluster=self.cluster if request.cluster else None,
            card=None if network is None else network.path,
        )
        try:
            run_reporting(PROCESS, [order.model_dump_json()], context=context, clock=self._tools.clock)
        finally:
            with self._lock:
                self._live = None
        return f"{URL}/{stored.id}"

    def _datasets(self, request: BatchRequest) -> list[Path]:
        captures = [self._tools.captures.collection.get(capture_id) for capture_id in request.capture_ids]
        return [readable_dataset(capture).folder for capture in captures]

    def _stored(self, request: BatchRequest) -> _StoredBatch:
        asked = request.model_dump(mode="json", exclude={"cluster"}) | {
            "capture_ids": sorted(request.capture_ids)
        }
        digest = hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()
        batch_id = f"{request.kind}-{digest[:12]}"
        return _StoredBatch(id=batch_id, folder=self._folder / batch_id, request=request)

    def _require(self, batch_id: str) -> _StoredBatch:
        try:
            found = read_document(self._folder / batch_id / REQUEST, _RequestFile, form=FORM, version=VERSION)
        except (OSError, ValueError) as error:
            if not isinstance(error, FileNotFoundError):
                _log.warning("batch %s is passed over: %s", batch_id, error)
            raise NotFound(f"there is no batch {batch_id}; see {URL}", asked=batch_id) from None
        return _StoredBatch(id=batch_id, folder=self._folder / batch_id, request=found.request)

    def _existing(self, stored: _StoredBatch, name: str) -> Path:
        path = stored.folder / name
        if not path.is_file():
            raise NotFound(f"batch {stored.id} has not ended yet; its job shows its progress", asked=name)
        return path

    def _check_idle(self, batch_id: str, asked: str) -> None:
        live = self._live_job()
        if live is not None and self._live is not None and self._live[0] == batch_id:
            raise Busy(f"asked to {asked}: batch {batch_id} is being made", asked=asked, remedy=WAIT)

    def _live_job(self) -> Job | None:
        if self._live is None:
            return None
        job = self._tools.jobs.get(self._live[1])
        return None if job.state.ended else job


class _RequestFile(BaseModel):
    request: BatchRequest


def _summary(path: Path) -> _SummaryFile | None:
    try:
        return _SummaryFile.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        _log.warning("%s is passed over: %s", path, error)
        return None
