"""Computes references of captures (depth over the rail's long baselines) as jobs, in the datasets' folder."""

import json
from dataclasses import asdict
from typing import Literal

from pydantic import ValidationError

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset.reference_folder import (
    remove_reference,
    remove_unfinished_reference,
)
from foveacam_pipeline.capture.rail_stops import reference_basis
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.datasets.collection import StoredCapture, brackets_of
from foveacam_server.datasets.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.foundation.errors import problem_of
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.schema import Problem
from foveacam_server.foundation.store import Document
from foveacam_server.resources.references.documents import (
    is_outdated,
    made_document,
    reference_url,
    stops_document,
)
from foveacam_server.resources.references.process import ReferenceSpec
from foveacam_server.resources.references.schema import MadeReference, ReferenceDocument, ReferenceStop

NOUN = "reference"
PROCESS = "foveacam_server.resources.references.process"


class ReferenceService:
    """All that REST offers of the references of this data directory's captures."""

    def __init__(self, tools: DerivedProductTools) -> None:
        self._captures = tools.captures
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, spec: ReferenceSpec, *, idempotency_key: str | None = None) -> Job:
        """Queue a reference; raise at once when the dataset's index shows that it cannot be computed."""
        return self._making.start(
            capture_id,
            asdict(spec),
            check=lambda kept: self._check(kept, spec),
            idempotency_key=idempotency_key,
        )

    def get(self, capture_id: str) -> ReferenceDocument:
        """Return a capture's reference, its progress, or why there can be none; raise NotFound."""
        kept = self._captures.collection.get(capture_id)
        job, document = self._making.running_job(capture_id), made_document(kept)
        made = _made(document)
        complete: Literal["none", "complete"] = "none" if made is None else "complete"
        return ReferenceDocument(
            capture_id=capture_id,
            name=kept.name,
            state=complete if job is None else "building",
            outdated=document is not None and is_outdated(kept.dataset, document),
            job_id=None if job is None else job.id,
            progress=None if job is None else job.progress,
            refusal=self._refusal(kept),
            stops=[ReferenceStop.model_validate(stop) for stop in stops_document(kept.dataset)],
            brackets=brackets_of(kept.dataset),
            made=made,
            url=reference_url(capture_id),
        )

    def get_by_url(self, url: str) -> ReferenceDocument:
        """Return the reference that a job's result URL names."""
        return self.get(url.split("/")[-2])

    def remove(self, capture_id: str) -> None:
        """Remove a capture's reference; raise `Busy` while one is being computed."""
        kept = self._captures.collection.get(capture_id)
        self.check_idle(capture_id, "remove its reference")
        with disk_errors("removing the reference", kept.folder):
            remove_reference(kept.folder)
        self._making.emit("removed", "a reference was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while a reference of this capture is being computed."""
        self._making.check_idle(capture_id, asked)

    def _make(self, kept: StoredCapture, spec: Document, run: Run) -> str:
        try:
            run([str(kept.folder), json.dumps(spec)])
        finally:
            with disk_errors("the reference", kept.folder):
                remove_unfinished_reference(kept.folder)
        return reference_url(kept.id)

    def _check(self, kept: StoredCapture, spec: ReferenceSpec) -> None:
        reference_basis(self._making.ended_dataset(kept), scan=spec.scan, bracket=spec.bracket)

    def _refusal(self, kept: StoredCapture) -> Problem | None:
        """Return why the capture can have no reference at all."""
        try:
            self._check(kept, ReferenceSpec())
        except FoveaError as error:
            return Problem.model_validate(problem_of(error).document())
        return None


def _made(document: Document | None) -> MadeReference | None:
    """Return the finished reference; None without one, or when its file was edited by hand."""
    try:
        return None if document is None else MadeReference.model_validate(document)
    except ValidationError:
        return None
