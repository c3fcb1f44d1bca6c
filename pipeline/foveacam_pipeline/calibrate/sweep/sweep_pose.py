"""Measurement of one pose: the markers in the wide view at rest, and each eye's own marker centred.

Both eyes share every exposure; each is accepted or refused by itself.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.contract import (
    Clock,
    Head,
    InvalidInput,
    MirrorVolts,
    PanTiltPose,
    Role,
    Sighting,
    Station,
    StereoVolts,
)
from foveacam_pipeline.calibrate.sweep.centring import BEYOND, EyeCentring
from foveacam_pipeline.calibrate.sweep.eye_prediction import EyePrediction, clamp_volts
from foveacam_pipeline.calibrate.sweep.marker_observation import (
    EyeObservation,
    centre_px,
    direction_rad,
    gaze_from_wide,
    gaze_on_target,
    observe_eye,
    turn_between,
    view_rejection_reason,
)
from foveacam_pipeline.calibrate.sweep.marker_target import TargetPose, locate_target
from foveacam_pipeline.calibrate.sweep.marker_view import draw_markers
from foveacam_pipeline.calibrate.sweep.sweep import SweepPose
from foveacam_pipeline.calibrate.sweep.sweep_settings import SweepSettings
from foveacam_pipeline.calibrate.sweep.sweep_wide import WideMarkersAtRest
from foveacam_pipeline.calibrate.watcher import ProcedureWatcher, raise_if_cancelled
from foveacam_pipeline.models.intrinsics import Intrinsics

EYES = (Role.LEFT, Role.RIGHT)
MARKER_HALF_SIZE = 0.62
"""Half the size of a marker that may be rotated by some degrees, over its side."""
LARGEST_RETREAT_RAD = math.radians(2.5)
MARGIN_SHARE = 0.8
"""Share of the margin beside a marker that a pose beyond the mirrors' volts may use."""


class PoseMeter:
    """Measures poses of one station; every look improves the prediction of the mirrors for the next ones."""

    def __init__(
        self,
        head: Head,
        wide: Intrinsics,
        station: Station,
        *,
        clock: Clock,
        watch: ProcedureWatcher,
        settings: SweepSettings,
    ) -> None:
        self.predictions = {role: EyePrediction(settings.rad_per_v) for role in EYES}
        self.fovea_size: tuple[int, int] | None = None
        self._head = head
        self._wide = wide
        self._station = station
        self._clock = clock
        self._watch = watch
        self._settings = settings
        self._eyes_m = {role: np.array([settings.eye_x_m(role), 0.0, 0.0]) for role in EYES}
        self._turns_rad = dict.fromkeys(EYES, 0.0)
        self._before: dict[Role, NDArray[np.uint8]] = {}

    def look_wide(self) -> WideMarkersAtRest:
        """Return the markers in a wide frame exposed after this call."""
        return WideMarkersAtRest(
            self._head, self._clock, self._settings.layout, since_ns=self._clock.now_ns()
        )

    def locate(self, at_rest: WideMarkersAtRest) -> TargetPose:
        """Return the pose of the target, at the station's distance by tape if there is one."""
        return locate_target(
            at_rest.views, self._settings.layout, self._wide, distance_m=self._station.distance_m
        )

    def measure(self, index: int, node_rad: tuple[float, float], base: PanTiltPose | None) -> SweepPose:
        """Measure a pose; repeat it when the rig moved meanwhile."""
        for _ in range(self._settings.most_restarts):
            pose, moved_px = self._measure_once(index, node_rad, base)
            if moved_px <= self._settings.still_px:
                return pose
        strayed = f"strayed by {moved_px:.2f} wide px" if math.isfinite(moved_px) else "left their places"
        reason = (
            f"the rig was not at rest: the markers {strayed}, at most {self._settings.still_px:g} px are "
            "allowed; wait longer after a move, and do not touch the rig"
        )
        return SweepPose(
            index=index,
            node_rad=node_rad,
            pan_tilt=base,
            t_ns=pose.t_ns,
            wide=pose.wide,
            left=None,
            right=None,
            left_refusal=reason,
            right_refusal=reason,
        )

    def _measure_once(
        self, index: int, node_rad: tuple[float, float], base: PanTiltPose | None
    ) -> tuple[SweepPose, float]:
        at_rest = self.look_wide()
        eyes, target = self.aim_eyes(at_rest)
        if target is not None:
            self.centre_eyes(eyes, at_rest, target)
        at_rest.fill(self._settings.wide_frames)
        left, right = eyes[Role.LEFT], eyes[Role.RIGHT]
        self._show_wide(at_rest, accepted=left.result is not None and right.result is not None)
        pose = SweepPose(
            index=index,
            node_rad=node_rad,
            pan_tilt=base,
            t_ns=at_rest.frame.t_ns,
            wide=at_rest.mean_views(),
            left=left.result,
            right=right.result,
            left_refusal=left.refusal,
            right_refusal=right.refusal,
            binning=at_rest.frame.binning,
        )
        return pose, at_rest.moved_px()

    def aim_eyes(self, at_rest: WideMarkersAtRest) -> tuple[dict[Role, EyeCentring], TargetPose | None]:
        """Return the eyes aimed at their markers; those whose marker is not in the wide view are refused."""
        try:
            target = self.locate(at_rest)
        except InvalidInput as error:
            refused = {role: self._aimed(role, np.zeros(2)) for role in EYES}
            for eye in refused.values():
                eye.refuse(str(error))
            return refused, None
        eyes = {}
        for role in EYES:
            wanted = direction_rad(target.marker_rig_m(role), self._eyes_m[role])
            eyes[role] = self._aimed(role, wanted)
            own = self._settings.layout.id_of(role)
            reason = self._wide_doubt(at_rest, own)
            if reason is not None:
                eyes[role].refuse(reason)
        return eyes, target

    def centre_eyes(
        self,
        eyes: Mapping[Role, EyeCentring],
        at_rest: WideMarkersAtRest,
        target: TargetPose,
        *,
        enough: Callable[[], bool] | None = None,
    ) -> None:
        """Look and steer until both eyes are done, or `enough` returns True."""
        while not all(eye.done for eye in eyes.values()):
            if enough is not None and enough():
                return
            raise_if_cancelled(self._watch, doing="the sweep")
            asked_ns = self._clock.now_ns()
            sighting = self.look({role: eye.command_v for role, eye in eyes.items()})
            at_rest.add(sighting.wide)
            for role, eye in eyes.items():
                if eye.done:
                    continue
                observation = self.observe(sighting, role)
                if self._is_frozen(observation):
                    eye.refuse("frozen: its camera repeats a picture; power the camera up again")
                    continue
                eye.add_observation(
                    observation, self.find_gaze(observation, at_rest, target), asked_ns=asked_ns
                )
                self._show_eye(observation, accepted=eye.result is not None)

    def look(self, commands_v: Mapping[Role, NDArray[np.float64]]) -> Sighting:
        """Return a look under commands, (2,) V for each eye."""
        left, right = (commands_v[role].tolist() for role in EYES)
        return self._head.look(
            StereoVolts(
                left=MirrorVolts(x_v=left[0], y_v=left[1]), right=MirrorVolts(x_v=right[0], y_v=right[1])
            )
        )

    def observe(self, sighting: Sighting, role: Role) -> EyeObservation:
        """Return an eye's observation of its marker in a look."""
        frame = sighting.left if role is Role.LEFT else sighting.right
        layout = self._settings.layout
        observation = observe_eye(frame, layout)
        self.fovea_size = observation.size
        return observation

    def find_gaze(
        self, observation: EyeObservation, at_rest: WideMarkersAtRest, target: TargetPose
    ) -> NDArray[np.float64] | None:
        """Return the gaze of an eye, (2,) rad, by a marker of the target, else by the wide view, or None."""
        layout = self._settings.layout
        seen = [view for view in (observation.view, *observation.others.values()) if view is not None]
        for view in seen:
            whose = layout.role_of(view.id)
            if whose is not None:
                if view.id in at_rest.views:
                    self._turns_rad[observation.role] = turn_between(view, at_rest.views[view.id])
                point = gaze_on_target(view, observation.size, target, whose)
                return direction_rad(point, self._eyes_m[observation.role])
        turn_rad = self._turns_rad[observation.role]
        found = gaze_from_wide(
            observation, at_rest.gray, self._wide, target, zoom=self._settings.zoom, turn_rad=turn_rad
        )
        return None if found is None else direction_rad(found, self._eyes_m[observation.role])

    def reachable_gaze(self, node_rad: NDArray[np.float64], target: TargetPose) -> NDArray[np.float64]:
        """Return the gaze nearest to a node, (2,) rad, at which both eyes keep their markers in view."""
        known = [
            role
            for role in EYES
            if self.predictions[role].nearest_rad(node_rad) < self._settings.approach_rad
        ]
        margin_rad = self._margin_rad(target)
        return node_rad + self._inward_shift(node_rad, dict.fromkeys(known, margin_rad))

    def retreat_gaze(self, pose: SweepPose, target: TargetPose) -> NDArray[np.float64] | None:
        """Return the nearest gaze that eyes refused beyond their volts can reach, (2,) rad, or None."""
        node_rad, margin_rad = np.array(pose.node_rad), self._margin_rad(target)
        beyond = [role for role in EYES if (pose.refusal(role) or "").startswith(BEYOND)]
        margins = {role: np.zeros(2) if role in beyond else margin_rad for role in EYES}
        return node_rad + self._inward_shift(node_rad, margins) if beyond else None

    def _margin_rad(self, target: TargetPose) -> NDArray[np.float64]:
        """Return the distance from an eye's middle at which its marker is still whole in view, (2,) rad."""
        if self.fovea_size is None:
            return np.zeros(2)
        half_field = np.array(self.fovea_size) / (2.0 * self._settings.zoom * self._wide.fx_px)
        half_marker = MARKER_HALF_SIZE * self._settings.layout.side_m / target.distance_m
        return np.asarray(MARGIN_SHARE * np.maximum(half_field - half_marker, 0.0))

    def _inward_shift(
        self, node_rad: NDArray[np.float64], margins_rad: Mapping[Role, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """Return the inward shift of a gaze that brings eyes within their margins of it, (2,) rad."""
        shift_rad = np.zeros(2)
        for role, margin_rad in margins_rad.items():
            prediction = self.predictions[role]
            wanted_v = prediction.volts(node_rad)
            over_v = wanted_v - clamp_volts(wanted_v, self._settings.max_v)
            own_rad = -np.linalg.solve(prediction.slope(node_rad), over_v)
            own_rad -= np.clip(own_rad, -margin_rad, margin_rad)
            shift_rad = np.where(np.abs(own_rad) > np.abs(shift_rad), own_rad, shift_rad)
        inward = np.clip(-np.sign(node_rad) * shift_rad, 0.0, LARGEST_RETREAT_RAD)
        return np.asarray(-np.sign(node_rad) * inward)

    def learn(self, pose: SweepPose) -> None:
        """Improve the predictions with a pose that was measured before."""
        if self.fovea_size is None:
            return
        for role in EYES:
            eye = pose.eye(role)
            if eye is None:
                continue
            try:
                target = locate_target(
                    pose.wide, self._settings.layout, self._wide, distance_m=self._station.distance_m
                )
            except InvalidInput:
                return  # its gaze is not known
            point = gaze_on_target(eye.corners, self.fovea_size, target, role)
            self.predictions[role].learn(direction_rad(point, self._eyes_m[role]), np.array(eye.volts_v))

    def _aimed(self, role: Role, wanted_rad: NDArray[np.float64]) -> EyeCentring:
        settings = self._settings
        return EyeCentring(role, wanted_rad, self.predictions[role], settings.centring, max_v=settings.max_v)

    def _wide_doubt(self, at_rest: WideMarkersAtRest, marker_id: int) -> str | None:
        if marker_id not in at_rest.views:
            return f"marker {marker_id} is not in the wide view; uncover it and light it"
        most_px = self._settings.centring.limits.blur_wide_px
        doubt = view_rejection_reason(at_rest.views[marker_id], most_px=most_px)
        return None if doubt is None else f"wide view: {doubt}"

    def _is_frozen(self, observation: EyeObservation) -> bool:
        """Return whether an image is identical to the one before, noise included."""
        before = self._before.get(observation.role)
        self._before[observation.role] = observation.image
        return before is not None and bool(np.array_equal(before, observation.image))

    def _show_wide(self, at_rest: WideMarkersAtRest, *, accepted: bool) -> None:
        views = list(at_rest.views.values())
        drawn = draw_markers(
            at_rest.image, views, accepted=accepted, aim_px=None, binning=at_rest.frame.binning
        )
        self._watch.show("wide", drawn)

    def _show_eye(self, observation: EyeObservation, *, accepted: bool) -> None:
        views = [] if observation.view is None else [observation.view]
        aim_px = centre_px(observation.size)
        drawn = draw_markers(
            observation.image, views, accepted=accepted, aim_px=aim_px, binning=observation.binning
        )
        self._watch.show(str(observation.role), drawn)
