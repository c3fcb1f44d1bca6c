"""Follows what was clicked from the wide frame of the click to the newest one, before the foveae look."""

from foveacam_hardware.contract import Frame
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.image_tracker import TrackBox
from foveacam_pipeline.track.template_tracker import TemplateTracker


class ClickTrack:
    """The place of a click in newer wide frames, px; it moves on at its speed where it is not found."""

    def __init__(self, frame: Frame, box: TrackBox) -> None:
        """`frame`: the one that was clicked. Raise `OutOfRange` where the box shows nothing to follow."""
        self._tracker = TemplateTracker()
        self._tracker.start(gray(to_uint8(frame)), box)
        self.frame = frame
        """The newest frame in which it was found."""
        self.place_px = (box.x_px, box.y_px)
        """Where it is in that frame."""
        self.speed_px_s = (0.0, 0.0)
        """How it moves in the wide view, px/s along x and y."""

    def see(self, frame: Frame) -> None:
        """Take a frame; one that is not newer than the last in which it was found is left out."""
        passed_s = (frame.t_ns - self.frame.t_ns) / 1e9
        if passed_s <= 0.0:
            return
        near = tuple(at + passed_s * speed for at, speed in zip(self.place_px, self.speed_px_s, strict=True))
        match = self._tracker.update(gray(to_uint8(frame)), (near[0], near[1]))
        if match is None:
            return
        found = (match.x_px, match.y_px)
        self.speed_px_s = (
            (found[0] - self.place_px[0]) / passed_s,
            (found[1] - self.place_px[1]) / passed_s,
        )
        self.place_px, self.frame = found, frame
