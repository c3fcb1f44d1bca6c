"""Whether the calibration in force still holds, from what ordinary fixations leave: told all the time."""

from foveacam_server.runtime.store import Document


class CalibrationHealth:
    """Collects fixations; starts anew when another calibration comes into force."""

    def document(self) -> Document:
        """Return the verdict so far."""
        return {
            "score": None,
            "verdict": "unknown",
            "fixations": 0,
            "vertical_px": None,
            "horizontal_px": None,
            "detail": "No fixation has been made with this calibration yet.",
        }
