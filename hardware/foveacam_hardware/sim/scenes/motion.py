"""Poses of moving objects as pure functions of the scene time."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from foveacam_hardware.sim.scenes.format import Motion, PathMotion, SceneObject, ShowMotion, SwayMotion

PoseAtTime = Callable[[float], NDArray[np.float64]]
"""Returns world_from_object (4, 4) float64 of an object at a scene time, s."""


def pose(entry: SceneObject, t_s: float) -> NDArray[np.float64]:
    """Return world_from_object (4, 4) float64 of an object at scene time `t_s`."""
    return pose_function(entry)(t_s)


def pose_function(entry: SceneObject) -> PoseAtTime:
    """Return the pose of an object by time; what does not depend on time is worked out once."""
    rotation, position = _rotation(entry.rotation_deg), np.array(entry.position_m)
    moved = _motion_function(entry.motion, position, rotation)
    start_s = 0.0 if entry.motion is None else entry.motion.start_s

    def at(t_s: float) -> NDArray[np.float64]:
        world_from_object = np.eye(4)
        world_from_object[:3, 3], world_from_object[:3, :3] = moved(t_s + start_s)
        return world_from_object

    return at


def _motion_function(
    motion: Motion | None, position: NDArray[np.float64], rotation: NDArray[np.float64]
) -> Callable[[float], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return position (3,) and rotation (3, 3) by the time since the motion began."""
    if motion is None:
        return lambda _t_s: (position, rotation)
    if isinstance(motion, PathMotion):
        along = _path_function(motion)
        return lambda t_s: (along(t_s), rotation)
    if isinstance(motion, SwayMotion):
        amplitude, period_s = np.array(motion.amplitude_m), motion.period_s
        return lambda t_s: (position + np.sin(2.0 * np.pi * t_s / period_s) * amplitude, rotation)
    if isinstance(motion, ShowMotion):
        return partial(_shown_from, motion, position, rotation)
    turn_s = motion.period_s
    return lambda t_s: (position, _about_y(360.0 * t_s / turn_s) @ rotation)


def _path_function(motion: PathMotion) -> Callable[[float], NDArray[np.float64]]:
    points = np.array(motion.points_m)
    if motion.closed:
        points = np.vstack([points, points[:1]])
    marks_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    length_m = float(marks_m[-1])

    def at(t_s: float) -> NDArray[np.float64]:
        if length_m == 0.0:
            return np.asarray(points[0], dtype=np.float64)
        walked_m = motion.speed_m_per_s * t_s
        if motion.closed:
            walked_m %= length_m
        else:  # there and back
            walked_m = length_m - abs(walked_m % (2.0 * length_m) - length_m)
        return np.array([np.interp(walked_m, marks_m, points[:, axis]) for axis in range(3)])

    return at


def _shown_from(
    motion: ShowMotion, position: NDArray[np.float64], rotation: NDArray[np.float64], t_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    at_m, turn = _shown(motion, t_s)
    return position + rotation @ at_m, rotation @ turn


def _shown(motion: ShowMotion, t_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position (3,) and rotation (3, 3) relative to the object's own pose; constant while held."""
    each_s = motion.hold_s + motion.move_s
    number, spent_s = divmod(t_s, each_s)
    now = motion.poses[int(number) % len(motion.poses)]
    following = motion.poses[(int(number) + 1) % len(motion.poses)]
    if spent_s <= motion.hold_s:
        return np.array(now.at_m), _rotation(now.turn_deg)
    share = (spent_s - motion.hold_s) / motion.move_s
    share *= share * (3.0 - 2.0 * share)  # smooth start and stop
    at_m = (1.0 - share) * np.array(now.at_m) + share * np.array(following.at_m)
    x, y, z = ((1.0 - share) * np.array(now.turn_deg) + share * np.array(following.turn_deg)).tolist()
    return at_m, _rotation((x, y, z))


def _rotation(rotation_deg: tuple[float, float, float]) -> NDArray[np.float64]:
    x, y, z = np.deg2rad(rotation_deg)
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    return np.asarray(about_z @ _about_y(float(np.rad2deg(y))) @ about_x, dtype=np.float64)


def _about_y(angle_deg: float) -> NDArray[np.float64]:
    a = np.deg2rad(angle_deg)
    return np.array([[np.cos(a), 0.0, np.sin(a)], [0.0, 1.0, 0.0], [-np.sin(a), 0.0, np.cos(a)]])
