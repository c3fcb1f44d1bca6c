"""References of captures over the rail's long baselines: made as jobs, kept in the datasets' own folders."""

import json
from dataclasses import asdict

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset.reference_folder import remove_reference, remove_unfinished_reference
from foveacam_pipeline.capture.rail_stops import reference_basis
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.capturing.capture_collection import StoredCapture
from foveacam_server.capturing.points import brackets_of
from foveacam_server.capturing.reference_documents import (
    is_outdated,
    made_document,
    reference_url,
    stops_document,
)
from foveacam_server.capturing.reference_process import ReferenceSpec
from foveacam_server.errors import problem_of
from foveacam_server.runtime.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.runtime.job_table import Job
from foveacam_server.runtime.store import Document

NOUN = "reference"
PROCESS = "foveacam_server.capturing.reference_process"


class ReferenceService:
    """One door to the references of this data directory's captures."""

    def __init__(self, tools: DerivedProductTools) -> None:
        self._captures = tools.captures
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, wish: ReferenceSpec, *, idempotency_key: str | None = None) -> Job:
        """Queue a reference; refuse at once what the dataset's index tells cannot be made."""
        return self._making.start(
            capture_id,
            asdict(wish),
            check=lambda kept: self._check(kept, wish),
            idempotency_key=idempotency_key,
        )

    def document(self, capture_id: str) -> Document:
        """Return a capture's reference, how its making goes, or why there can be none; raise NotFound."""
        kept = self._captures.shelf.get(capture_id)
        making, made = self._making.document(capture_id), made_document(kept)
        whole = "none" if made is None else "complete"
        return {
            "capture_id": capture_id,
            "name": kept.name,
            "state": whole if making["job_id"] is None else "building",
            "outdated": made is not None and is_outdated(kept.dataset, made),
            **making,
            "refusal": self._refusal(kept),
            "stops": stops_document(kept.dataset),
            "brackets": brackets_of(kept.dataset),
            "made": made,
            "url": reference_url(capture_id),
        }

    def at_url(self, url: str) -> Document:
        """Return the document that a job's result URL names."""
        return self.document(url.split("/")[-2])

    def remove(self, capture_id: str) -> None:
        """Remove a capture's reference; refused while one is being made."""
        kept = self._captures.shelf.get(capture_id)
        self.check_idle(capture_id, "remove its reference")
        with disk_errors("removing the reference", kept.folder):
            remove_reference(kept.folder)
        self._making.tell("removed", "a reference was removed", capture_id)

    def check_idle(self, capture_id: str, asked: str) -> None:
        """Raise Busy while a reference of this capture is being made."""
        self._making.check_idle(capture_id, asked)

    def _make(self, kept: StoredCapture, wish: Document, run: Run) -> str:
        try:
            run([str(kept.folder), json.dumps(wish)])
        finally:
            with disk_errors("the reference", kept.folder):
                remove_unfinished_reference(kept.folder)
        return reference_url(kept.id)

    def _check(self, kept: StoredCapture, wish: ReferenceSpec) -> None:
        reference_basis(self._making.ended_dataset(kept), scan=wish.scan, bracket=wish.bracket)

    def _refusal(self, kept: StoredCapture) -> Document | None:
        """Return why there can be none, whatever is asked for."""
        try:
            self._check(kept, ReferenceSpec())
        except FoveaError as error:
            return problem_of(error).document()
        return None
