"""Verify suggested targets by looking at them: those are kept on which both foveae verge."""

from collections.abc import Callable, Iterable

from foveacam_hardware.contract import Cancelled, Clock, Head
from foveacam_pipeline.models.calibration import Calibration
from foveacam_pipeline.verge.closed_loop import ClosedLoop
from foveacam_pipeline.verge.looking.fixation_head import FixationEnded, FixationHead
from foveacam_pipeline.verge.resolved_target import resolve
from foveacam_pipeline.verge.settings import VergeSettings
from foveacam_pipeline.verge.suggest import Suggestion
from foveacam_pipeline.verge.values import PixelTarget

DEFAULT = VergeSettings()


def verified_targets(
    head: Head,
    calibration: Calibration,
    suggested: Iterable[Suggestion],
    *,
    clock: Clock,
    count: int,
    until_ns: int,
    cancelled: Callable[[], bool] | None = None,
) -> tuple[Suggestion, ...]:
    """Return the first `count` suggestions on which both foveae verge, in their order.

    Fewer where there are fewer, when `clock` reaches `until_ns`, or when `cancelled()` returns True. Raise a
    device's error.
    """
    found: list[Suggestion] = []
    for suggestion in suggested:
        if len(found) == count or clock.now_ns() >= until_ns:
            break
        target = PixelTarget(x_px=suggestion.x_px, y_px=suggestion.y_px)
        fixation_head = FixationHead(
            head, calibration, clock=clock, limits=DEFAULT, on_step=None, cancelled=cancelled
        )
        loop = ClosedLoop(fixation_head, calibration, DEFAULT, expected_per_m=None)
        try:
            loop.run(resolve(target, calibration.wide, DEFAULT), clicked=None)
        except FixationEnded:
            continue
        except Cancelled:
            break
        found.append(suggestion)
    return tuple(found)
