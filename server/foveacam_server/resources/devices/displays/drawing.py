"""Draws the pattern of a request: its size, its description and its SVG."""

from dataclasses import dataclass

from foveacam_pipeline.calibrate.pattern import (
    Pattern,
    board_pattern,
    marker_pattern,
    pattern_svg,
    target_pattern,
)
from foveacam_pipeline.calibrate.sweep.marker_view import MarkerLayout
from foveacam_pipeline.calibrate.wide.boards import board_from
from foveacam_server.resources.devices.displays.schema import (
    BlankPattern,
    CharucoPattern,
    MarkerPattern,
    MarkersPattern,
    PatternDocument,
    ShownPattern,
)

MARKER_DICTIONARY = "4X4_50"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PatternDrawing:
    """A request, its pattern (None: blank) and its description in words."""

    asked: ShownPattern
    pattern: Pattern | None
    description: str

    def describe(self) -> PatternDocument:
        """Return its document."""
        pattern = self.pattern
        return PatternDocument(
            pattern=self.asked,
            description=self.description,
            width_mm=None if pattern is None else round(1e3 * pattern.width_m, 4),
            height_mm=None if pattern is None else round(1e3 * pattern.height_m, 4),
        )

    def svg(self) -> str | None:
        """Return it as SVG in millimetres; None when it is blank."""
        return None if self.pattern is None else pattern_svg(self.pattern, title=self.description)


def draw(asked: ShownPattern, *, dictionary: str = MARKER_DICTIONARY) -> PatternDrawing:
    """Return the drawing of a request; raise `InvalidInput` for an impossible board.

    `dictionary`: of a ChArUco board's markers.
    """
    if isinstance(asked, BlankPattern):
        return PatternDrawing(asked=asked, pattern=None, description="blank")
    if isinstance(asked, MarkerPattern):
        words = f"marker {asked.id} of 4X4_50, side {asked.side_mm:g} mm"
        return PatternDrawing(
            asked=asked, pattern=marker_pattern(asked.id, side_m=asked.side_mm / 1e3), description=words
        )
    if isinstance(asked, MarkersPattern):
        layout = MarkerLayout(side_m=asked.side_mm / 1e3, spacing_m=asked.spacing_mm / 1e3)
        words = f"markers 1, 0, 2 of 4X4_50, side {asked.side_mm:g} mm, {asked.spacing_mm:g} mm apart"
        return PatternDrawing(asked=asked, pattern=target_pattern(layout), description=words)
    marker_m = asked.marker_mm / 1e3 if isinstance(asked, CharucoPattern) else None
    board = board_from(
        asked.kind,
        columns=asked.columns,
        rows=asked.rows,
        square_m=asked.square_mm / 1e3,
        marker_m=marker_m,
        dictionary=dictionary,
    )
    return PatternDrawing(
        asked=asked, pattern=board_pattern(board), description=f"{board}, squares of {asked.square_mm:g} mm"
    )
