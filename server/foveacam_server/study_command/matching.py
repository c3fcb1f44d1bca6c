"""How well the simulated rig matches its two foveae: the error that the curves of Sec. 4.1 are drawn with."""

from statistics import median

from foveacam_hardware.contract import InvalidInput
from foveacam_pipeline.capture.progress_steps import ProgressSteps, ProgressWatcher
from foveacam_pipeline.study.tradeoff.depth_error import MatchingError, measured_error
from foveacam_server.bench.verge import fixations
from foveacam_server.bench.verge_truth import ClickKind
from foveacam_server.study_command.matching_given import VERGE, VERGED

SCENE = "bench"


def verge_error(clicks: int, *, watch: ProgressWatcher) -> MatchingError:
    """Return the median true left-right residual of verged foveae, fovea px, over clicks on texture.

    Raise Cancelled when the watcher asks, InvalidInput where no click verged.
    """
    steps = ProgressSteps(watch, clicks, ended="the clicks were not all made; run it again")
    found: list[float] = []
    for result in fixations(SCENE, {ClickKind.TEXTURED: clicks, ClickKind.PLAIN: 0, ClickKind.AWKWARD: 0}):
        steps.step("the rig verges on what it sees")
        if result.verged:
            found.append(result.residual_px)
    if not found:
        raise InvalidInput(
            f"none of {clicks} clicks verged, so that no matching error is known; allow more clicks"
        )
    source = f"measured for this study: median true residual of {len(found)} clicks, simulated rig"
    return measured_error(VERGE, median(found), whose=VERGED, source=source)
