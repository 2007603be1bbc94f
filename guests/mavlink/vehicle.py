"""The vehicle behind MAVLink: armed or not, on the ground or not, its mode, its failsafes, and the motion that follows.

All of its knowledge is from the steps: position, height, odometry, and whether an operator has enabled driving. Time is the vehicle's
clock, so a pause of the core is no silence of the program. MAVLink itself is left to `autopilot` and the files around it: this file
does not need its library.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Callable, Optional

from guidance import STAND, Limits, Motion, climb, driven, flown, rolled, towards, turn_to
from holdsafe_guest import Body, Place, Start, Step
from modes import Asked, Mode
from parameters import Parameters
from plan import LAND, LOITER, RETURN, TAKE_OFF, Plan
from pose import STALE, Pose, home_at, pose_at, posed

#: Height by which a take-off may fall short of its goal, and below which the vehicle is on the ground, m.
SHORT, GROUND = 0.3, 0.25
#: Time without a change of height after which a climb or a descent is over, s, and the least change that counts, m.
STALLED, CHANGE = 3.0, 0.05
#: Largest speed of a descent to the ground, m/s.
DESCENT = 0.5
#: Distance of the point that wheels roll towards with a velocity east and north, m.
AHEAD = 5.0


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


@dataclass(frozen=True)
class SetPoint:
    """An order of a program in OFFBOARD: a place or a velocity, and a heading or a turn."""

    stamp_s: float
    at: Optional[Place] = None
    height_m: Optional[float] = None
    #: Velocity east and north, or forward and left if `of_body`, m/s.
    velocity: Optional[Place] = None
    up_m_s: float = 0.0
    of_body: bool = False
    yaw_rad: Optional[float] = None
    turn_rad_s: Optional[float] = None


class Vehicle:
    """The state. `say` passes on a text for the operator of the link."""

    def __init__(self, start: Start, parameters: Parameters, ardupilot: bool, say: Callable[[str], None]) -> None:
        self.body = start.body or Body("ground", (1.0, 1.0), 0.4, 0.0, 0.0, 0.0)
        self.parameters, self.ardupilot, self.say = parameters, ardupilot, say
        self.braking, self.max_speed = start.braking_m_s2, start.max_speed_m_s
        self.now_s, self.limit, self.pose, self.home = start.time_s, 0.0, pose_at(start), home_at(start)
        self.armed, self.mode, self.guided, self.failsafe = False, Mode.HOLD, False, False
        #: A body that leaves the ground counts as landed until a program has it take off: the platform is at height already.
        self.flies = self.body.medium == "air"
        self.landed = self.flies
        # ArduPilot's item 0 is home, and is not flown.
        self.plan = Plan(first=int(ardupilot))
        self.goal: tuple[Place, Optional[float], Optional[float]] = ((0.0, 0.0), None, None)
        self.set_point: Optional[SetPoint] = None
        self.climb_goal = 0.0
        self.height_since: tuple[float, float] = (0.0, math.inf)
        self.heard_s = start.time_s

    # Inputs of the steps.

    def read(self, step: Step) -> None:
        """Takes a step's readings and carries on: arrivals, failsafes."""
        enabled, self.now_s, self.limit = self.limit > 0.0, step.time_s, step.limit_m_s
        self.pose = posed(self.pose, step)
        if self.home is None and self.pose:
            self.home = replace(self.pose, height_m=0.0)
        if not enabled and self.limit > 0.0:
            self.say("Ready to arm: driving is enabled")
        if enabled and self.limit <= 0.0 and self.armed:
            self.enter(Mode.HOLD)
            self.say("Driving is not enabled: HOLD")
        self.fail_safe()
        if self.armed and self.pose:
            self.arrive(self.pose)

    def located(self) -> bool:
        return self.pose is not None and self.now_s - self.pose.stamp_s <= STALE

    def armable(self) -> bool:
        return self.limit > 0.0 and self.located()

    def state(self) -> str:
        """The state by name: a failsafe first, which holds while the vehicle stands by it."""
        if self.failsafe:
            return "FAILSAFE"
        if not self.armed:
            return "DISARMED"
        return "LANDED" if self.landed else self.mode.value

    # Orders of a program.

    def arm(self) -> Result:
        if not self.armed and not self.armable():
            self.say("Arming denied: " + ("no position" if self.limit > 0.0 else "driving is not enabled"))
            return Result.DENIED
        self.armed, self.failsafe = True, False
        return Result.ACCEPTED

    def disarm(self, forced: bool) -> Result:
        if self.armed and self.flies and not self.landed and not forced:
            return Result.DENIED
        self.armed, self.landed = False, self.flies
        self.enter(Mode.HOLD)
        return Result.ACCEPTED

    def take_off(self, height_m: Optional[float]) -> Result:
        """Leaves the ground, to a height above it; the parameter's where none is given."""
        if not self.flies:
            return Result.UNSUPPORTED
        if not self.armed:
            return Result.DENIED
        self.climb_goal = height_m if height_m is not None else self.parameters["take_off_height"]
        self.enter(Mode.TAKEOFF, guided=self.guided)
        return Result.ACCEPTED

    def go_to(self, at: Place, height_m: Optional[float], yaw_rad: Optional[float]) -> Result:
        if not self.armed:
            return Result.DENIED
        height = height_m if height_m is not None else self.pose.height_m if self.pose else None
        self.goal = (at, height, yaw_rad)
        self.enter(Mode.GOTO, guided=self.guided)
        return Result.ACCEPTED

    def change_mode(self, asked: Asked) -> Result:
        """Enters a mode. A mode that moves the vehicle may be chosen before it is armed, as on an autopilot."""
        if asked.mode is Mode.MISSION and not self.plan.items:
            return Result.DENIED
        if asked.mode is Mode.OFFBOARD and not self.hears_set_points():
            return Result.DENIED
        if asked.mode is Mode.TAKEOFF:
            return self.take_off(None)
        if asked.mode is Mode.MISSION:
            self.plan.restart_if_finished()
        if asked.mode is Mode.LAND and not self.flies:
            return Result.UNSUPPORTED
        self.enter(asked.mode, asked.guided)
        return Result.ACCEPTED

    def take_set_point(self, asked: SetPoint) -> None:
        self.set_point = asked
        # GUIDED needs no command for it.
        if self.ardupilot and self.guided and self.armed and self.mode is not Mode.TAKEOFF:
            self.mode, self.failsafe = Mode.OFFBOARD, False

    def hears_set_points(self) -> bool:
        return self.set_point is not None and self.now_s - self.set_point.stamp_s <= self.parameters["off_board_limit"]

    def move_home(self, at: Place) -> None:
        assert self.home is not None  # as its caller checks
        self.home = replace(self.home, at=at)

    def hear(self) -> None:
        """Notes that the program is there."""
        self.heard_s = self.now_s

    def enter(self, mode: Mode, guided: bool = False, failsafe: bool = False) -> None:
        self.mode, self.guided, self.failsafe = mode, guided, failsafe
        self.height_since = (0.0, math.inf)

    # Consequences.

    def fail_safe(self) -> None:
        if not self.armed:
            return
        if self.mode is not Mode.HOLD and not self.located():
            self.enter(Mode.HOLD, failsafe=True)
            self.say("Failsafe: no position, HOLD")
        if self.mode is Mode.OFFBOARD and not self.hears_set_points():
            # ArduPilot stays in GUIDED and stands.
            self.enter(Mode.HOLD, guided=self.guided, failsafe=not self.ardupilot)
            self.say("No set-points: HOLD")
        act = self.parameters["data_link_act"]
        if act > 0.0 and not self.failsafe and self.now_s - self.heard_s > self.parameters["data_link_limit"]:
            self.enter({1.0: Mode.HOLD, 2.0: Mode.RTL, 3.0: Mode.LAND}[act], failsafe=True)
            self.say(f"Failsafe: no data link, {self.mode.value}")

    def arrive(self, pose: Pose) -> None:
        if self.flies and self.landed and self.mode in (Mode.MISSION, Mode.GOTO, Mode.OFFBOARD, Mode.RTL):
            self.landed = False
        if self.mode is Mode.TAKEOFF:
            self.landed = False
            if self.level(pose, self.climb_goal - SHORT, above=True):
                self.enter(Mode.HOLD, guided=self.guided)
        elif self.mode is Mode.LAND and self.level(pose, GROUND, above=False):
            self.landed, self.armed = self.flies, False
            self.enter(Mode.HOLD)
        elif self.mode is Mode.RTL and self.home and math.dist(pose.at, self.home.at) <= self.parameters["radius"]:
            self.enter(Mode.LAND if self.flies else Mode.HOLD, failsafe=self.failsafe)
        elif self.mode is Mode.MISSION:
            self.follow_plan(pose)

    def follow_plan(self, pose: Pose) -> None:
        self.plan.arrive(pose, self.now_s, self.parameters["radius"])
        item = self.plan.item()
        if item is None:
            self.enter(Mode.HOLD)
        elif item.command == TAKE_OFF:
            if not self.flies or self.level(pose, (item.height_m or self.parameters["take_off_height"]) - SHORT, above=True):
                self.plan.complete()
        elif item.command in (LAND, RETURN):
            self.plan.complete()
            self.enter(Mode.RTL if item.command == RETURN else Mode.LAND if self.flies else Mode.HOLD)

    def level(self, pose: Pose, height_m: float, above: bool) -> bool:
        """True once the height is reached, or has not changed for a while: the platform has floors and ceilings of its own."""
        if pose.height_m is None or (pose.height_m >= height_m if above else pose.height_m <= height_m):
            return True
        if self.limit <= 0.0 or abs(pose.height_m - self.height_since[0]) > CHANGE or self.height_since[1] == math.inf:
            self.height_since = (pose.height_m, self.now_s)
        return self.now_s - self.height_since[1] > STALLED

    def speed(self) -> float:
        asked = self.plan.speed_m_s if self.mode is Mode.MISSION and self.plan.speed_m_s else self.parameters["cruise"]
        return min(self.limit, self.max_speed, asked if self.mode is not Mode.OFFBOARD else self.max_speed)

    def motion(self) -> Motion:
        """The set-point of the platform. A vehicle that is not armed, is landed, or may not drive, stands."""
        if not self.armed or self.limit <= 0.0 or self.landed or not self.located() or self.pose is None:
            return STAND
        pose, limits = self.pose, Limits(self.body, self.braking, self.speed())
        if self.mode is Mode.TAKEOFF:
            return Motion(up=climb(pose, self.climb_goal, limits))
        if self.mode is Mode.LAND:
            return Motion(up=-min(DESCENT, self.body.max_climb_m_s))
        if self.mode is Mode.RTL and self.home:
            return towards(pose, self.home.at, max(self.parameters["return_height"], GROUND), limits)
        if self.mode is Mode.GOTO:
            at, height, yaw = self.goal
            return towards(pose, at, height, limits, yaw)
        if self.mode is Mode.MISSION:
            return self.along_plan(pose, limits)
        if self.mode is Mode.OFFBOARD and self.set_point:
            return moved(pose, self.set_point, limits)
        return STAND

    def along_plan(self, pose: Pose, limits: Limits) -> Motion:
        item = self.plan.item()
        if item is None:
            return STAND
        if item.command == TAKE_OFF:
            return Motion(up=climb(pose, item.height_m or self.parameters["take_off_height"], limits))
        if item.at is None or item.command == LOITER and self.plan.there_since_s is not None:
            return STAND
        yaw = math.pi / 2.0 - math.radians(item.values[3]) if math.isfinite(item.values[3]) and item.values[3] else None
        return towards(pose, item.at, item.height_m, limits, yaw)


def moved(pose: Pose, asked: SetPoint, limits: Limits) -> Motion:
    """The motion that a set-point asks for."""
    if asked.at is not None:
        return towards(pose, asked.at, asked.height_m, limits, asked.yaw_rad)
    first, second = asked.velocity or (0.0, 0.0)
    turn = asked.turn_rad_s if asked.turn_rad_s is not None else turn_to(pose, asked.yaw_rad)
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    if limits.wheels and asked.of_body:
        return driven(first, turn, limits)
    if limits.wheels:
        speed = min(math.hypot(first, second), limits.speed_m_s)
        return rolled(pose, math.atan2(second, first), AHEAD, speed, limits)
    velocity = (cos * first - sin * second, sin * first + cos * second) if asked.of_body else (first, second)
    return flown(pose, velocity, asked.up_m_s, turn, limits)
