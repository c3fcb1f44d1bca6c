"""REST documents of references over long baselines: their rail stops, figures and files."""

import json
from datetime import UTC, datetime

from foveacam_hardware.contract import FoveaError
from foveacam_pipeline.capture.dataset import Dataset
from foveacam_pipeline.capture.dataset.reference_folder import (
    REFERENCE,
    REFERENCE_DOCUMENT,
    REFERENCE_PICTURE,
    REFERENCE_SAMPLES,
    reference_files,
)
from foveacam_pipeline.capture.rail_stops import rail_positions_m, reference_basis
from foveacam_server.datasets.collection import CAPTURES_URL, StoredCapture
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.store import Document


def reference_url(capture_id: str) -> str:
    """Return the URL of a capture's reference."""
    return f"{CAPTURES_URL}/{capture_id}/reference"


def made_document(stored: StoredCapture) -> Document | None:
    """Return the reference of a capture; None without a readable one."""
    path = stored.folder / REFERENCE / REFERENCE_DOCUMENT
    try:
        if not reference_files(stored.folder):
            return None
        made_ns = path.stat().st_mtime_ns
        document = json.loads(path.read_text(encoding="utf-8"))
        settings = document["recipe"]["settings"]
        found = {
            **document["figures"],
            "bracket": settings["bracket"],
            "across": settings["across"],
            "rail_sigma_m": settings["rail"]["along_m"],
        }
    except (OSError, ValueError, KeyError, TypeError, FoveaError):
        return None
    url = reference_url(stored.id)
    return {
        **found,
        "made_utc": datetime.fromtimestamp(made_ns / 1e9, tz=UTC).isoformat(timespec="seconds"),
        "svg_url": f"{url}/{REFERENCE_PICTURE}.svg?made={made_ns:x}",
        "png_url": f"{url}/{REFERENCE_PICTURE}.png?made={made_ns:x}",
        "samples_url": f"{url}/{REFERENCE_SAMPLES}?made={made_ns:x}",
    }


def is_outdated(dataset: Dataset | None, made: Document) -> bool:
    """Tell whether points were added to the capture since; they are never changed."""
    if dataset is None:
        return False
    try:
        basis = reference_basis(dataset, scan=made["scan"], bracket=made["bracket"])
        return basis.pairs != made["points"] or len(basis.stops) != len(made["stops"])
    except (FoveaError, KeyError, TypeError):
        return False


def stops_document(dataset: Dataset | None) -> list[Document]:
    """Return the scans whose rail position is known."""
    places_m = {} if dataset is None else rail_positions_m(dataset)
    return [{"scan": scan, "rail_m": rail_m} for scan, rail_m in places_m.items()]


def reference_file(stored: StoredCapture, name: str) -> bytes:
    """Return one file of a capture's reference or raise `NotFound`; `name` must not come from a request."""
    try:
        return (stored.folder / REFERENCE / name).read_bytes()  # whole: it may be removed at any moment
    except FileNotFoundError:
        order = f"make one: POST {reference_url(stored.id)}"
        raise NotFound(
            f"capture {stored.id} has no reference; {order}",
            asked=f"{name} of the reference of {stored.id}",
            found="none was made",
            remedy=order,
        ) from None
