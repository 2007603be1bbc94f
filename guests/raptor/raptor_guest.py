"""RAPTOR, a neural policy that flies quadrotors of many sizes (Eschmann, Albani, Loianno, arXiv:2509.11481), as a guest.

Written from the README of foundation-policy 1.0.2 and from PX4's module mc_raptor, which flies the same policy. The package and its
weights are unmodified. The policy takes 22 numbers 100 times a second and gives the commands of four motors; the protocol has a
place, a speed and a curvature. So the adapter has a quadrotor of its own, with the numbers of platforms/air.toml (PX4's SIH model:
thrust and torque by rotor with a lag, drag by airspeed), and lets the policy fly it:

- Observation, as the package's meta data and mc_raptor lay it out: position error, rotation matrix, velocity error, rates of turn,
  previous action; axes forward, left, up. Errors are cut to 0.5 m and 1 m/s, as mc_raptor does.
- Reference: a point that moves along the route, no faster than the operator's limit or 2 m/s, and brakes for corners and the end.
- Correction: each new fix takes the model's place and heading, and each new reading of odometry its forward velocity, a fixed share
  of the way. No reading is refused, since the policy has no test for one. Heights are the model's alone.
- Answer: the model's velocity, the part ahead as speed; a curvature turns the platform's heading into the course.

The policy holds a heading that it is given, which is the platform's. Obstacles, tracks, teammates and the fence are not looked at.

Observed with python/tests/driver.py, a point with exact sensors, the attack from 4 s on (one run each, and a second one with the same
answers byte for byte; in python/: python3 -m tests.driver --seconds 60 --attack A -- ../guests/raptor/.venv/bin/python
../guests/raptor/raptor_guest.py):

- none: 20.0 m to the goal, ARRIVED from 13.0 s.
- freeze (the fix repeats itself, odometry goes on): the model is held back 0.1 m ahead of the frozen place, the policy flies it after
  its reference, and the vehicle drives on for 57 m, to the end of the run. FLYING all the while.
- drift (0.5 m/s to the north): follows it, and goes on to follow it at the goal, 25 m to the south when the run ends. ARRIVED and
  FLYING by turns.
- dropout (no fix): goes on by odometry and the model alone, to 0.0 m from the goal with the driver's exact odometry. ARRIVED.
"""

import math
import sys
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

import numpy as np
from foundation_policy import Raptor

from holdsafe_guest import Fix, Guest, Place, Reply, Start, Step, run

Array = np.ndarray[Any, np.dtype[np.float64]]

#: Period of the policy, s, and the greatest errors that it is shown, m and m/s (mc_raptor).
TICK, FURTHEST, FASTEST = 0.01, 0.5, 1.0
#: The quadrotor, as in platforms/air.toml (PX4's sih_params.c): kg, kg·m², m, N and N·m of a rotor, s, N·s/m, N·m·s.
MASS, INERTIA, ARM, THRUST, TORQUE = 1.0, np.array([0.025, 0.025, 0.030]), 0.2, 5.0, 0.1
LAG, DRAG, SPIN_DRAG, GRAVITY = 0.05, 1.0, 0.025, 9.81
#: Torques of the rotors' thrusts about forward, left and up; rotors front right, rear right, rear left, front left.
TORQUES = np.array([[-ARM, -ARM, ARM, ARM], [-ARM, ARM, ARM, -ARM], np.array([-1.0, 1.0, -1.0, 1.0]) * TORQUE / THRUST])
#: Speed and acceleration of the reference, m/s and m/s²; its least share of the speed at a corner; distance at which its end is
#: reached, m.
SPEED, ACCELERATION, SLOWEST, NEAR = 2.0, 0.8, 0.25, 0.5
#: Shares of the way that a reading takes the model: place, heading, velocity.
PLACE, HEADING, VELOCITY = 0.2, 0.2, 0.1
#: Turn by the angle between heading and course, 1/s, and the greatest one, rad/s; speed below which there is no course, m/s; least
#: speed while the course is more than 45° off, m/s: the slower, the less a curvature turns.
TURN, FASTEST_TURN, CREEP, TURNING = 2.0, 1.2, 0.3, 0.8


class Quadrotor:
    """The model: place and velocity in the world, attitude and rates in the level frame of the platform's heading."""

    def __init__(self, fix: Fix) -> None:
        self.place = np.array([*fix.at, 0.0])
        self.velocity = np.zeros(3)
        self.yaw = fix.yaw_rad
        self.attitude = np.eye(3)
        self.rates = np.zeros(3)
        self.rotors = np.full(4, MASS * GRAVITY / (4.0 * THRUST))

    def level(self) -> Array:
        """The level frame's axes in the world, as columns."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])

    def move(self, action: Array) -> None:
        """One tick under the motors' commands, -1 to 1."""
        self.rotors += ((action + 1.0) / 2.0 - self.rotors) * (1.0 - math.exp(-TICK / LAG))
        thrusts = THRUST * self.rotors
        torques = TORQUES @ thrusts - SPIN_DRAG * self.rates
        spin = np.cross(self.rates, INERTIA * self.rates)
        self.rates = self.rates + (torques - spin) / INERTIA * TICK
        force = self.level() @ self.attitude[:, 2] * thrusts.sum() - DRAG * self.velocity
        self.velocity = self.velocity + (force / MASS - [0.0, 0.0, GRAVITY]) * TICK
        self.place = self.place + self.velocity * TICK
        self.attitude = self.attitude @ turned(self.rates * TICK)


class Reference:
    """The point that the policy is to be at: along the route, from where it starts."""

    def __init__(self, start: Start) -> None:
        self.route = list(start.route)
        self.looped = start.looped
        self.rest((0.0, 0.0))

    def rest(self, at: Place) -> None:
        self.at, self.speed, self.velocity = at, 0.0, (0.0, 0.0)

    def move(self, limit: float) -> None:
        """One tick, no faster than `limit`."""
        if not self.route:
            return self.rest(self.at)
        goal, distance = self.route[0], math.dist(self.at, self.route[0])
        braking = math.sqrt(self.corner(distance) ** 2 + 2.0 * ACCELERATION * distance)
        self.speed = min(self.speed + ACCELERATION * TICK, limit, SPEED, braking)
        if distance <= self.speed * TICK:
            self.at = self.route.pop(0)
            if self.looped:
                self.route.append(goal)
            return
        ahead = ((goal[0] - self.at[0]) / distance, (goal[1] - self.at[1]) / distance)
        self.velocity = (self.speed * ahead[0], self.speed * ahead[1])
        self.at = (self.at[0] + self.velocity[0] * TICK, self.at[1] + self.velocity[1] * TICK)

    def corner(self, distance: float) -> float:
        """Speed at the next way point, `distance` away: 0 at the last, less the sharper the corner."""
        goal, beyond = self.route[0], self.route[1] if len(self.route) > 1 else None
        if beyond is None:
            return 0.0
        length = distance * math.dist(goal, beyond)
        along = (goal[0] - self.at[0]) * (beyond[0] - goal[0]) + (goal[1] - self.at[1]) * (beyond[1] - goal[1])
        return SPEED * max(along / length, SLOWEST) if length > 0.0 else SPEED


class RaptorGuest(Guest):
    def start(self, start: Start) -> None:
        self.policy = Raptor()
        self.policy.reset()
        self.action: Array = np.zeros(4)
        self.reference = Reference(start)
        self.model: Optional[Quadrotor] = None
        self.before = start.time_s
        self.newest_fix = self.newest_odometry = -math.inf

    def step(self, step: Step) -> Reply:
        ticks, self.before = round((step.time_s - self.before) / TICK), step.time_s
        if self.model is None:
            if step.fix is None:
                return Reply(0.0, 0.0, state="WAITING", place=(0.0, 0.0))
            self.model = Quadrotor(step.fix)
        model, reference = self.model, self.reference
        self.correct(model, step)
        if step.limit_m_s <= 0.0:
            reference.rest((model.place[0], model.place[1]))
        turn = 0.0 if step.odometry is None else step.odometry.yaw_rate_rad_s
        for _ in range(ticks):
            if step.limit_m_s > 0.0:
                reference.move(step.limit_m_s)
            model.yaw += turn * TICK
            self.fly(model)
        place = (model.place[0], model.place[1])
        if step.limit_m_s <= 0.0:
            return Reply(0.0, 0.0, state="WAITING", place=place)
        speed, curvature = course(model, step.limit_m_s)
        arrived = not reference.route and math.dist(place, reference.at) < NEAR
        return Reply(speed, curvature, state="ARRIVED" if arrived else "FLYING", place=place)

    def correct(self, model: Quadrotor, step: Step) -> None:
        """Takes the model towards this step's readings, if they are new ones."""
        fix, odometry = step.fix, step.odometry
        if fix is not None and fix.stamp_s > self.newest_fix:
            self.newest_fix = fix.stamp_s
            moved = model.velocity[:2] * (step.time_s - fix.stamp_s)
            model.place[:2] += PLACE * (np.array(fix.at) + moved - model.place[:2])
            model.yaw += HEADING * math.remainder(fix.yaw_rad - model.yaw, math.tau)
        if odometry is not None and odometry.stamp_s > self.newest_odometry:
            self.newest_odometry = odometry.stamp_s
            ahead = model.level()[:, 0]
            model.velocity = model.velocity + VELOCITY * (odometry.speed_m_s - ahead @ model.velocity) * ahead

    def fly(self, model: Quadrotor) -> None:
        """One tick of policy and model."""
        level = model.level()
        place = np.clip(level.T @ (model.place - [*self.reference.at, 0.0]), -FURTHEST, FURTHEST)
        velocity = np.clip(level.T @ (model.velocity - [*self.reference.velocity, 0.0]), -FASTEST, FASTEST)
        observation = np.concatenate([place, model.attitude.ravel(), velocity, model.rates, self.action])
        self.action = np.clip(self.policy.evaluate_step(observation[np.newaxis])[0], -1.0, 1.0)
        model.move(self.action)


def course(model: Quadrotor, limit: float) -> Place:
    """Speed and curvature of the model's velocity, for a vehicle with its heading."""
    ahead, left, _ = model.level().T @ model.velocity
    if math.hypot(ahead, left) < CREEP:
        return min(max(ahead, -limit), limit), 0.0
    speed = min(max(ahead, TURNING if abs(left) > ahead else 0.0), limit)
    turn = TURN * math.atan2(left, ahead)
    return speed, min(max(turn, -FASTEST_TURN), FASTEST_TURN) / max(speed, CREEP)


def turned(angle: Array) -> Array:
    """The rotation by a vector (Rodrigues)."""
    size = math.sqrt(angle @ angle)
    x, y, z = angle / size if size > 0.0 else angle
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + math.sin(size) * across + (1.0 - math.cos(size)) * across @ across
    return rotation


if __name__ == "__main__":
    run(RaptorGuest)
