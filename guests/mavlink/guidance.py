"""From a goal to a motion: the vehicle's own guidance, for a body that hovers and for one on wheels.

A motion is in the level frame of the body: forward, left, up, and a turn to the left. It is the set-point of the platform, which has
the controllers below it. Modes are left to `vehicle`.
"""

import math
from dataclasses import dataclass
from typing import Optional

from holdsafe_guest import Body, Place
from pose import Pose

#: Turn for a difference of headings, 1/s, and the greatest turn, rad/s.
TURN, FASTEST_TURN = 1.5, 1.0
#: Climb for a difference of heights, 1/s.
CLIMB = 1.0
#: Share of the certain deceleration by which the guidance brakes: the rest is for delays.
BRAKING = 0.6
#: Distance from a goal below which a body on wheels stands: it cannot turn on the spot, m.
NEAR = 0.3
#: Difference between heading and course above which wheels go slowly, rad, and that speed, m/s.
ASIDE, SLOW = 1.0, 0.8


@dataclass(frozen=True)
class Motion:
    """A set-point in the level frame of the body, m/s and rad/s."""

    forward: float = 0.0
    left: float = 0.0
    up: float = 0.0
    turn: float = 0.0

    def curvature(self) -> float:
        """Of wheels that roll."""
        return self.turn / self.forward if abs(self.forward) > 0.01 else 0.0


STAND = Motion()


@dataclass(frozen=True)
class Limits:
    """Limits of the body, and of the operator's permission."""

    body: Body
    braking_m_s2: float
    speed_m_s: float

    @property
    def wheels(self) -> bool:
        return self.body.medium == "ground"


def between(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)


def difference(to_rad: float, from_rad: float) -> float:
    """From one angle to the other by the shorter way."""
    return math.remainder(to_rad - from_rad, math.tau)


def towards(pose: Pose, at: Place, height_m: Optional[float], limits: Limits, yaw_rad: Optional[float] = None) -> Motion:
    """The motion to a goal at which the vehicle stands; it faces its course where no heading is asked for."""
    east, north = at[0] - pose.at[0], at[1] - pose.at[1]
    distance = math.hypot(east, north)
    speed = min(limits.speed_m_s, math.sqrt(2.0 * BRAKING * limits.braking_m_s2 * distance), distance)
    if limits.wheels:
        return rolled(pose, math.atan2(north, east), distance, speed, limits)
    share = speed / distance if distance > 0.0 else 0.0
    # Near the goal the course is the noise of the position.
    facing = yaw_rad if yaw_rad is not None else math.atan2(north, east) if distance > 1.0 else None
    return flown(pose, (share * east, share * north), climb(pose, height_m, limits), turn_to(pose, facing), limits)


def flown(pose: Pose, velocity: Place, up: float, turn: float, limits: Limits) -> Motion:
    """The motion with a velocity east and north, no faster than the limits."""
    speed = math.hypot(*velocity)
    share = min(1.0, limits.speed_m_s / speed) if speed > 0.0 else 0.0
    east, north = share * velocity[0], share * velocity[1]
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    up = between(up, -limits.body.max_climb_m_s, limits.body.max_climb_m_s)
    return Motion(cos * east + sin * north, cos * north - sin * east, up, between(turn, -FASTEST_TURN, FASTEST_TURN))


def rolled(pose: Pose, course_rad: float, distance: float, speed: float, limits: Limits) -> Motion:
    """The motion of wheels on the arc that meets the goal."""
    if distance < NEAR:
        return STAND
    aside = difference(course_rad, pose.yaw_rad)
    most = limits.body.max_curvature_per_m
    if abs(aside) > ASIDE:
        forward, curvature = min(speed, SLOW), math.copysign(most, aside)
    else:
        forward, curvature = speed, between(2.0 * math.sin(aside) / max(distance, 1.0), -most, most)
    return Motion(forward=forward, turn=forward * curvature)


def driven(forward: float, turn: float, limits: Limits) -> Motion:
    """The motion of wheels that are asked for a speed and a turn."""
    forward = between(forward, -limits.body.max_reverse_m_s, limits.speed_m_s)
    most = abs(forward) * limits.body.max_curvature_per_m
    return Motion(forward=forward, turn=between(turn, -most, most))


def climb(pose: Pose, height_m: Optional[float], limits: Limits) -> float:
    if height_m is None or pose.height_m is None:
        return 0.0
    most = limits.body.max_climb_m_s
    return between(CLIMB * (height_m - pose.height_m), -most, most)


def turn_to(pose: Pose, yaw_rad: Optional[float]) -> float:
    return 0.0 if yaw_rad is None else between(TURN * difference(yaw_rad, pose.yaw_rad), -FASTEST_TURN, FASTEST_TURN)
