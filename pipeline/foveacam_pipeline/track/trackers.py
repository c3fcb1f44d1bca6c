"""Makes the image trackers by their kinds."""

from foveacam_pipeline.track.correlation_filter import CorrelationFilterTracker
from foveacam_pipeline.track.image_tracker import GreyImage, ImageTracker, TrackBox, TrackerKind
from foveacam_pipeline.track.template_tracker import TemplateTracker


def start_tracker(kind: TrackerKind, image: GreyImage, box: TrackBox) -> ImageTracker:
    """Return a tracker that has learnt what is in the box; raise `OutOfRange` where that is nothing."""
    tracker: ImageTracker = TemplateTracker() if kind is TrackerKind.TEMPLATE else CorrelationFilterTracker()
    tracker.start(image, box)
    return tracker
