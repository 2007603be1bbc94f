"""The vehicle's pose, from the surveyed one at the start and from the readings of each step."""

import math
from dataclasses import dataclass, replace
from typing import Optional

from holdsafe_guest import Place, Start, Step

#: Age of a fix at which the position counts as lost, s.
STALE = 1.0


@dataclass(frozen=True)
class Pose:
    """Place, heading and motion by the vehicle's own sensors, at `stamp_s` of its clock."""

    at: Place
    yaw_rad: float
    #: None on the ground.
    height_m: Optional[float]
    stamp_s: float
    speed_m_s: float = 0.0
    turn_rad_s: float = 0.0
    #: Velocity east and north, m/s.
    velocity: Place = (0.0, 0.0)
    climb_m_s: float = 0.0


def pose_at(start: Start) -> Optional[Pose]:
    pose = start.pose
    return None if pose is None else Pose(pose.at, pose.yaw_rad, pose.height_m, -math.inf)


def home_at(start: Start) -> Optional[Pose]:
    pose = start.pose
    return None if pose is None else Pose(pose.at, pose.yaw_rad, 0.0, start.time_s)


def posed(before: Optional[Pose], step: Step) -> Optional[Pose]:
    """The pose with a step's readings. Without a fix the place stays as it was: odometry alone is no position."""
    height = step.height_m if step.height_m is not None else step.fix.height_m if step.fix else before.height_m if before else None
    speed, turn = (step.odometry.speed_m_s, step.odometry.yaw_rate_rad_s) if step.odometry else (0.0, 0.0)
    if step.fix is None:
        return before and replace(before, height_m=height, speed_m_s=speed, turn_rad_s=turn)
    at, yaw, stamp = step.fix.at, step.fix.yaw_rad, step.fix.stamp_s
    velocity, rise = (speed * math.cos(yaw), speed * math.sin(yaw)), 0.0
    if before and 0.0 < stamp - before.stamp_s <= STALE:
        passed = stamp - before.stamp_s
        velocity = ((at[0] - before.at[0]) / passed, (at[1] - before.at[1]) / passed)
        rise = (height - before.height_m) / passed if height is not None and before.height_m is not None else 0.0
    elif before and stamp == before.stamp_s:
        velocity, rise = before.velocity, before.climb_m_s
    return Pose(at, yaw, height, stamp, speed, turn, velocity, rise)
