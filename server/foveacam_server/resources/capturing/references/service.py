"""Computes references of captures (depth over the rail's long baselines) as jobs, in the datasets' folder."""

import json
from datetime import UTC, datetime
from typing import Literal

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.reference_folder import (
    REFERENCE,
    REFERENCE_DOCUMENT,
    REFERENCE_PICTURE,
    REFERENCE_SAMPLES,
    reference_files,
    remove_reference,
    remove_unfinished_reference,
)
from foveacam_pipeline.capture.rail_stops import rail_positions_m, reference_basis
from foveacam_pipeline.diagrams import check_figures
from foveacam_pipeline.storage.disk import disk_errors
from foveacam_server.datasets.collection import CAPTURES_URL, StoredCapture, brackets_of
from foveacam_server.datasets.derived_products import (
    DerivedProduct,
    DerivedProductJobs,
    DerivedProductTools,
    Run,
)
from foveacam_server.foundation.errors import NotFound, problem_of
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.schema import Problem
from foveacam_server.resources.capturing.references.schema import (
    MadeReference,
    ReferenceDocument,
    ReferenceRequest,
    ReferenceStop,
)

NOUN = "reference"
PROCESS = "foveacam_server.resources.capturing.references.process"


class ReferenceService:
    """The references of this data directory's captures: compute, describe, remove."""

    def __init__(self, tools: DerivedProductTools) -> None:
        self._captures = tools.captures
        self._making = DerivedProductJobs(DerivedProduct(noun=NOUN, process=PROCESS, make=self._make), tools)

    def start(self, capture_id: str, request: ReferenceRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a reference; raise at once when the dataset's index shows that it cannot be computed."""
        return self._making.start(
            capture_id,
            request,
            check=lambda kept: self._check(kept, request),
            idempotency_key=idempotency_key,
        )

    def get(self, capture_id: str) -> ReferenceDocument:
        """Return a capture's reference, its progress, or why none is possible; raise NotFound."""
        kept = self._captures.collection.get(capture_id)
        job, made = self._making.running_job(capture_id), _read_made(kept)
        places_m = {} if kept.dataset is None else rail_positions_m(kept.dataset)
        complete: Literal["none", "complete"] = "none" if made is None else "complete"
        return ReferenceDocument(
            capture_id=capture_id,
            name=kept.name,
            state=complete if job is None else "building",
            outdated=made is not None and _is_outdated(kept.dataset, made),
            job_id=None if job is None else job.id,
            progress=None if job is None else job.progress,
            refusal=self._refusal(kept),
            stops=[ReferenceStop(scan=scan, rail_m=rail_m) for scan, rail_m in places_m.items()],
            brackets=brackets_of(kept.dataset),
            made=made,
            url=reference_url(capture_id),
        )

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

    def _make(self, kept: StoredCapture, request: str, run: Run) -> str:
        try:
            run([str(kept.folder), request])
        finally:
            with disk_errors("the reference", kept.folder):
                remove_unfinished_reference(kept.folder)
        return reference_url(kept.id)

    def _check(self, kept: StoredCapture, request: ReferenceRequest) -> None:
        check_figures("a reference with its diagram")
        reference_basis(self._making.ended_dataset(kept), scan=request.scan, bracket=request.bracket)

    def _refusal(self, kept: StoredCapture) -> Problem | None:
        """Return why no reference of the capture is possible at all."""
        try:
            self._check(kept, ReferenceRequest())
        except FoveaError as error:
            return problem_of(error).document()
        return None


def reference_url(capture_id: str) -> str:
    """Return the URL of a capture's reference."""
    return f"{CAPTURES_URL}/{capture_id}/reference"


def reference_file(stored: StoredCapture, name: str) -> bytes:
    """Return one file of a capture's reference or raise `NotFound`; `name` must not come from a request."""
    try:
        return (stored.folder / REFERENCE / name).read_bytes()  # whole now: it may be removed at any moment
    except FileNotFoundError:
        raise NotFound(
            f"capture {stored.id} has no reference",
            asked=f"{name} of the reference of {stored.id}",
            found="none was made",
            remedy=f"make one: POST {reference_url(stored.id)}",
        ) from None


def _read_made(stored: StoredCapture) -> MadeReference | None:
    """Return the finished reference; None without one, or when its file was edited by hand."""
    path, url = stored.folder / REFERENCE / REFERENCE_DOCUMENT, reference_url(stored.id)
    try:
        if not reference_files(stored.folder):
            return None
        made_ns = path.stat().st_mtime_ns
        file = json.loads(path.read_text(encoding="utf-8"))
        settings = file["recipe"]["settings"]
        return MadeReference(
            **file["figures"],
            bracket=settings["bracket"],
            across=settings["across"],
            rail_sigma_m=settings["rail"]["along_m"],
            made_utc=datetime.fromtimestamp(made_ns / 1e9, tz=UTC).isoformat(timespec="seconds"),
            svg_url=f"{url}/{REFERENCE_PICTURE}.svg?made={made_ns:x}",
            png_url=f"{url}/{REFERENCE_PICTURE}.png?made={made_ns:x}",
            samples_url=f"{url}/{REFERENCE_SAMPLES}?made={made_ns:x}",
        )
    except (OSError, ValueError, KeyError, TypeError, FoveaError):
        return None


def _is_outdated(dataset: Dataset | None, made: MadeReference) -> bool:
    """Return whether points were added to the capture since; they are never changed."""
    if dataset is None:
        return False
    try:
        basis = reference_basis(dataset, scan=made.scan, bracket=made.bracket)
    except FoveaError:
        return False
    return basis.pairs != made.points or len(basis.stops) != len(made.stops)
