"""Follow people who walk in circles, in virtual time, judged by the truth (`foveacam bench track`).

Every look is charged `COMPUTE_S` of the rig's time, as measured for the pipeline on one busy core of two.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from foveacam_bench.figures import Figures
from foveacam_bench.judging import rms
from foveacam_bench.track.square import Walker, write_square
from foveacam_bench.verge.fixations import CERTIFICATE
from foveacam_hardware.contract import Binning, Role, Sighting
from foveacam_hardware.rig import Rig
from foveacam_hardware.sim.rig import open_simulated
from foveacam_hardware.sim.scenes.motion import pose
from foveacam_hardware.sim.truth import Truth
from foveacam_pipeline.models import Calibration, load_calibration
from foveacam_pipeline.stereo.match import gray
from foveacam_pipeline.stereo.rectify import to_uint8
from foveacam_pipeline.track.follow import Follower, FollowStep
from foveacam_pipeline.track.image_tracker import TrackerKind
from foveacam_pipeline.track.target import FollowedTarget, FollowState
from foveacam_pipeline.verge.fixate import fixate
from foveacam_pipeline.verge.values import Basis, PixelTarget
from foveacam_server.resources.studying.studies.click_truth import (
    EYES,
    Click,
    classify_click,
    clicked_point_at,
    truth_of,
    visible_from,
)
from foveacam_server.resources.studying.studies.simulated_rigs import bin_cameras

SECONDS, QUICK_SECONDS = 12.0, 1.5
COMPUTE_S = 0.04
CHEST_M = 1.15
"""Height above the foot of the point that is clicked."""
TRIES = 20
HIDDEN_NS = 200_000_000
"""Wait before the next try when a walker is hidden."""
FAST = (Walker(x_m=0.0, z_m=10.0, radius_m=1.0, speed_m_per_s=2.0),)
FOUR = (
    Walker(x_m=-0.9, z_m=9.0, radius_m=0.35, speed_m_per_s=0.8),
    Walker(x_m=0.2, z_m=11.0, radius_m=0.4, speed_m_per_s=0.7, start_s=1.0),
    Walker(x_m=1.0, z_m=10.0, radius_m=0.3, speed_m_per_s=0.9, start_s=2.0),
    Walker(x_m=-0.4, z_m=14.0, radius_m=0.5, speed_m_per_s=0.8, start_s=3.0),
)
CROSSING = (
    Walker(x_m=0.0, z_m=11.0, radius_m=0.3, speed_m_per_s=0.4),
    Walker(x_m=0.0, z_m=9.0, radius_m=1.1, speed_m_per_s=1.4, start_s=1.2),
)
"""The second one passes in front of the first."""


@dataclass(slots=True, kw_only=True)
class FollowRun:
    """Results of following: times of the looks, and errors of the looks at each target."""

    times_s: dict[str, list[float]] = field(default_factory=dict)
    in_fovea: dict[str, list[bool]] = field(default_factory=dict)
    """Of the looks in which both eyes could see the target: whether both foveae did."""
    offsets_px: list[float] = field(default_factory=list)
    """Of the same looks: the target's distance from the middle of the fovea in which it is farther."""
    relative_errors: list[float] = field(default_factory=list)
    sigmas: list[float] = field(default_factory=list)
    states: list[FollowState] = field(default_factory=list)
    """Of the target that was looked at, after every look; of the first where there was none."""
    lost_looks: int = 0
    look_s: float = 0.0

    @property
    def looks(self) -> int:
        """Number of looks."""
        return sum(len(times) for times in self.times_s.values())

    @property
    def rates_hz(self) -> list[float]:
        """Looks a second at each target."""
        return [(len(times) - 1) / (times[-1] - times[0]) for times in self.times_s.values()]

    @property
    def ages_s(self) -> list[float]:
        """Times between two looks at the same target."""
        return [float(age) for times in self.times_s.values() for age in np.diff(times)]


def run(*, quick: bool = False, binning: Binning = 1) -> Figures:
    """Follow one fast walker, four slower ones, and one in front of whom another passes."""
    seconds = QUICK_SECONDS if quick else SECONDS
    follow = partial(follow_walkers, adjust=partial(bin_cameras, binning=binning))
    one = follow(FAST, seconds=seconds)
    learning = follow(FAST, seconds=seconds / 2, tracker=TrackerKind.FILTER)
    four = follow(FOUR, seconds=seconds)
    crossed = follow(CROSSING, seconds=1.5 * seconds, followed=1)
    single_hz = one.rates_hz[0]
    fair_s = len(FOUR) * four.look_s
    return {
        "in_fovea_fraction": _share(one.in_fovea),
        "in_fovea_fraction_filter": _share(learning.in_fovea),
        "position_rel_rms": rms(np.array(one.relative_errors)),
        "position_within_3_sigma": float(np.mean(np.array(one.sigmas) <= 3.0)),
        "look_hz": single_hz,
        "multi_rate_ratio": min(four.rates_hz) / (single_hz / len(FOUR)),
        "age_p99_over_fair": float(np.quantile(four.ages_s, 0.99)) / fair_s,
        "multi_in_fovea_fraction": _share(four.in_fovea),
        "multi_lost_fraction": four.lost_looks / four.looks,
        "multi_position_rel_rms": rms(np.array(four.relative_errors)),
        "crossed_in_fovea_fraction": _share(crossed.in_fovea),
        "crossed_lost_looks": crossed.lost_looks,
        "looks": one.looks + learning.looks + four.looks + crossed.looks,
        "compute_charged_s": COMPUTE_S,
    }


def follow_walkers(
    walkers: Sequence[Walker],
    *,
    seconds: float,
    followed: int | None = None,
    tracker: TrackerKind = TrackerKind.TEMPLATE,
    adjust: Callable[[Rig], None] | None = None,
) -> FollowRun:
    """Follow the first `followed` walkers, None for all, and judge every look; `adjust` the rig first."""
    calibration, result = load_calibration(CERTIFICATE), FollowRun()
    with TemporaryDirectory() as folder:
        scene = write_square(Path(folder) / "square.toml", walkers)
        with open_simulated(scene=str(scene), inline=True) as rig:
            if adjust is not None:
                adjust(rig)
            follower = Follower(calibration, clock=rig.clock)
            clicks: dict[str, Click] = {}
            for number in range(len(walkers) if followed is None else followed):
                target, click = _begin(rig, calibration, number, follower, tracker)
                clicks[target.target_id] = click
                follower.add(target)
            end_ns = rig.clock.now_ns() + round(1e9 * seconds)
            while rig.clock.now_ns() < end_ns:
                step = follower.step(rig.head)
                rig.clock.sleep_until_ns(rig.clock.now_ns() + round(1e9 * COMPUTE_S))
                _judge(truth_of(rig), follower, step, clicks, result)
    result.look_s = follower.look_s
    return result


def _begin(
    rig: Rig, calibration: Calibration, number: int, follower: Follower, tracker: TrackerKind
) -> tuple[FollowedTarget, Click]:
    """Click on the chest of a walker until both foveae have verged on it."""
    truth = truth_of(rig)
    for _ in range(TRIES):
        click = click_chest(truth, calibration, number, rig.clock.now_ns())
        if click is None:
            rig.clock.sleep_until_ns(rig.clock.now_ns() + HIDDEN_NS)
            continue
        found = fixate(
            follower.watching(rig.head),
            calibration,
            PixelTarget(x_px=click.x_px, y_px=click.y_px),
            clicked=rig.head.wide(),
            clock=rig.clock,
        )
        sighting, point = found.sighting, found.point_rig_m
        if found.basis is Basis.BOTH_FOVEAE and sighting is not None and point is not None:
            target = FollowedTarget(
                f"walker {number}",
                sighting,
                point,
                calibration=calibration,
                wide=gray(to_uint8(sighting.wide)),
                tracker=tracker,
            )
            return target, click
    raise RuntimeError(f"walker {number} was not verged on in {TRIES} clicks")


def click_chest(truth: Truth, calibration: Calibration, number: int, t_ns: int) -> Click | None:
    """Return a click on a walker's chest; None where something else is in front of it."""
    name = f"walker {number}"
    placed = next(one for one in truth.world.animated_scene.file.objects if one.name == name)
    x_m, y_m, z_m = pose(placed, truth.world.scene_s(t_ns))[:3, 3].tolist()
    x_px, y_px = truth.wide_pixels(np.array([[x_m, y_m - CHEST_M, z_m]]))[0].tolist()
    if not calibration.wide.contains(x_px, y_px):
        return None
    click = classify_click(truth, calibration, scene="square", pixel=(x_px, y_px), t_ns=t_ns)
    return click if click is not None and click.name == name else None


def _judge(
    truth: Truth, follower: Follower, step: FollowStep, clicks: dict[str, Click], result: FollowRun
) -> None:
    if step.target_id is None or step.sighting is None:
        result.states.append(follower.reports()[0].state)
        return
    target = follower.targets[step.target_id]
    state = target.report(step.t_ns).state
    result.states.append(state)
    click = clicks[step.target_id]
    point = clicked_point_at(truth, click, step.t_ns)
    result.times_s.setdefault(step.target_id, []).append(step.t_ns / 1e9)
    if all(visible_from(truth, role, click, t_ns=step.t_ns) for role in EYES):
        seen, offset_px = _in_both(truth, step.sighting, point)
        result.in_fovea.setdefault(step.target_id, []).append(seen)
        result.offsets_px.append(offset_px)
    if state is not FollowState.FOLLOWED:
        result.lost_looks += 1
        return
    estimate = target.at(step.t_ns)
    error = estimate.position_rig_m - point
    result.relative_errors.append(float(np.linalg.norm(error) / np.linalg.norm(point)))
    distance_error_m = estimate.distance_m - float(np.linalg.norm(point))
    result.sigmas.append(abs(distance_error_m) / estimate.distance_sigma_m)


def _in_both(truth: Truth, sighting: Sighting, point_rig_m: NDArray[np.float64]) -> tuple[bool, float]:
    """Return whether a point lies within both foveae's pictures, and its largest offset from a middle, px."""
    seen, offset_px = True, 0.0
    for role, frame in ((Role.LEFT, sighting.left), (Role.RIGHT, sighting.right)):
        view = truth.projection(role, frame.t_ns)
        x, y, w = view.M @ (point_rig_m - view.C)
        if w <= 0.0:
            return False, np.inf
        seen &= bool(0.0 <= x / w < view.width and 0.0 <= y / w < view.height)
        offset_px = max(offset_px, float(np.hypot(x / w - view.width / 2, y / w - view.height / 2)))
    return seen, offset_px


def _share(flags: dict[str, list[bool]]) -> float:
    return float(np.mean([flag for found in flags.values() for flag in found]))
