"""How the eyes' mounts drifted while they were calibrated, in a sentence."""

from foveacam_pipeline.calibrate.report.facts import ClosingFacts, MountDriftFacts, SessionFacts
from foveacam_pipeline.calibrate.report.markup import paragraph

DRIFT_NOT_MEASURED = (
    "No node was visited again during the sweeps: thermal drift of the mounts stays in, and the standard "
    "errors hold what is usual."
)


def mount_drift(session: SessionFacts | None) -> str:
    """Return a line on the drift during the sweeps, and after them."""
    if session is None or session.fit is None:
        return ""
    if not session.fit.drift:
        return paragraph(DRIFT_NOT_MEASURED)
    return paragraph(f"{drift_sentence(session.fit.drift)}{closing_sentence(session.closing)}")


def drift_sentence(drift: dict[str, MountDriftFacts]) -> str:
    """Return how fast and how far each mount drifted."""
    eyes = "; ".join(
        f"{eye} eye {found.px_per_minute:.2f} fovea px a minute, {found.moved_px:.2f} ± "
        f"{found.sigma_px:.2f} px in all, over {found.minutes:.1f} min of measuring"
        for eye, found in drift.items()
    )
    return (
        "How the mounts moved during the sweeps and between them, seen at nodes visited again, taken out: "
        f"{eyes}.{knock_sentence(drift)}"
    )


def knock_sentence(drift: dict[str, MountDriftFacts]) -> str:
    """Return which mounts were knocked amid a sweep, and by how much; nothing where none was."""
    eyes = " and ".join(
        f"the {eye} eye's by {', then '.join(f'{size_px:.1f}' for size_px in found.knocks_px)} fovea px"
        for eye, found in drift.items()
        if found.knocks_px
    )
    return f" Mounts were knocked amid the sweeps, taken out too: {eyes}." if eyes else ""


def closing_sentence(closing: ClosingFacts | None) -> str:
    """Return what was found, and done, between the sweeps and the check."""
    if closing is None:
        return ""
    done = "taken out too" if closing.corrected else "within its own error, left in"
    return f" From then to the check the eyes' rows came {closing.rows_px:.2f} px apart: {done}."
