"""Two calibrations of one rig beside each other, as a document and as a picture."""

from foveacam_pipeline.calibrate.records.compare import DifferenceSpread, compare, comparison_picture
from foveacam_pipeline.models.calibration import Calibration
from foveacam_server.runtime.store import Document


def compared(a: Calibration, b: Calibration) -> tuple[Document, bytes]:
    """Return how far b differs from a, and the same as a PNG."""
    found = compare(a, b)
    document: Document = {
        "a": found.a,
        "b": found.b,
        "distance_m": found.distance_m,
        "pointing_difference_px": _spread(found.pointing),
        "epipolar_difference_px": _spread(found.epipolar),
        "disparity_difference_px": _spread(found.disparity),
        "wide_px": _spread(found.wide),
        "baseline_m": round(found.baseline_m, 7),
    }
    return document, comparison_picture(found)


def _spread(spread: DifferenceSpread) -> Document:
    return {"rms": round(spread.rms_px, 4), "max": round(spread.max_px, 4)}
