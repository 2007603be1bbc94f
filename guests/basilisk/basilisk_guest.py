"""Basilisk's flight software for attitude guidance and control as a guest: the framework of the University of Colorado in which flight
software of missions is developed and simulated.

Written from the documentation of bsk 2.12.1 (inertial3D, attTrackingError, mrpSteering, rateServoFullNonlinear, rwMotorTorque,
spacecraft, reactionWheelStateEffector, simpleNav). The library is unmodified. On the platform `space` a unit's place is the point that
its payload looks at, on a map of 1 km to the metre. The adapter joins the modules as the library's example scenarios do:

- Guidance: inertial3D holds the attitude that looks at the way point, steering turns there at a rate that the operator's limit or 2 m/s
  on the map allows, the rate servo asks for a torque, which three wheels share; 10 times a second. A way point is reached within 1 m.
- Plant: a hub with the moments of platforms/space.toml and three wheels RWP015, simulated by Basilisk in the same process, since the
  protocol has a place, a speed and a curvature, and no torques. It hangs 518 km over the origin of the map: an angle is a place. The
  turn of 15 mrad/s that keeps a line of sight on passing ground is left to the platform, which adds it to each set-point.
- Correction: each new fix takes the plant's line of sight and the heading, and each new reading of the gyros the velocity, a fixed
  share of the way. No reading is refused, since these modules have no test for one.
- Answer: the motion of the line of sight over the map, the part ahead as speed; a curvature turns the heading into the course.

Tracks, teammates and the fence are not looked at.

Observed with python/tests/driver.py, a point with exact sensors, the attack from 4 s on (one run each, and a second one with the same
answers byte for byte; in python/: python3 -m tests.driver --seconds 60 --attack A -- ../guests/basilisk/.venv/bin/python
../guests/basilisk/basilisk_guest.py):

- none: 20.0 m to the goal, ARRIVED from 12.8 s.
- freeze (the fix repeats itself, odometry goes on): the plant is held back 0.3 m ahead of the frozen place, steering turns it at full
  rate, and the vehicle drives on for 95 m, to the end of the run. SLEWING all the while.
- drift (0.5 m/s to the north): follows it, and goes on to follow it at the goal, 27 m to the south when the run ends. ARRIVED.
- dropout (no fix): goes on by odometry and the plant alone, to 0.1 m before the goal with the driver's exact odometry. ARRIVED.
"""

import math
import sys
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

import numpy as np
from Basilisk.architecture import messaging
from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpSteering, rateServoFullNonlinear, rwMotorTorque
from Basilisk.simulation import reactionWheelStateEffector, simpleNav, spacecraft
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros, simIncludeRW

from holdsafe_guest import Guest, Place, Reply, Start, Step, run

Array = np.ndarray[Any, np.dtype[np.float64]]

#: Range to the ground overhead, in metres of the map.
RANGE = 518.0
#: Moments of inertia, as in platforms/space.toml, kg·m²; mass of a 6U satellite, kg, which no torque depends on.
INERTIA, MASS = (0.06, 0.10, 0.13), 10.0
#: Axis of the payload.
SIGHT = (0.0, 0.0, -1.0)
#: Periods of plant and flight software, s.
PLANT, SOFTWARE = 0.05, 0.1
#: Gains: of steering, 1/s, on an error in modified Rodrigues parameters, a quarter of the angle; of the rate servo, N·m·s.
STEERING, SERVO = 5.0, 0.4
#: Speed of the line of sight over the map, m/s; distance at which a way point is reached, m.
SPEED, NEAR = 2.0, 1.0
#: Shares of the way that a reading takes the plant: place, heading, velocity.
PLACE, HEADING, VELOCITY = 0.2, 0.2, 0.1
#: Turn by the angle between heading and course, 1/s, and the greatest one, rad/s; speed below which there is no course, m/s; least
#: speed while the course is more than 45° off, m/s: the slower, the less a curvature turns.
TURN, FASTEST_TURN, CREEP, TURNING = 2.0, 1.2, 0.3, 0.8


class Satellite:
    """Flight software and plant, as one simulation of Basilisk. North is the map's north, the third axis up."""

    def __init__(self, at: Place) -> None:
        self.seconds = 0.0
        self.hub = hub(at)
        factory = simIncludeRW.rwFactory()
        for axis in np.eye(3):
            factory.create("BCT_RWP015", axis.tolist(), RWModel=messaging.BalancedWheels)
        wheels = reactionWheelStateEffector.ReactionWheelStateEffector()
        factory.addToSpacecraft("wheels", wheels, self.hub)
        navigation = simpleNav.SimpleNav()
        navigation.scStateInMsg.subscribeTo(self.hub.scStateOutMsg)
        self.guidance = inertial3D.inertial3D()
        error = attTrackingError.attTrackingError()
        error.attNavInMsg.subscribeTo(navigation.attOutMsg)
        error.attRefInMsg.subscribeTo(self.guidance.attRefOutMsg)
        self.steering = mrpSteering.mrpSteering()
        self.steering.K1 = STEERING
        self.steering.guidInMsg.subscribeTo(error.attGuidOutMsg)
        moments = np.diag(INERTIA).ravel().tolist()
        vehicle = messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(ISCPntB_B=moments))
        config = factory.getConfigMessage()
        servo = rateServoFullNonlinear.rateServoFullNonlinear()
        servo.P, servo.Ki = SERVO, -1.0
        servo.guidInMsg.subscribeTo(error.attGuidOutMsg)
        servo.rateSteeringInMsg.subscribeTo(self.steering.rateCmdOutMsg)
        servo.vehConfigInMsg.subscribeTo(vehicle)
        servo.rwParamsInMsg.subscribeTo(config)
        servo.rwSpeedsInMsg.subscribeTo(wheels.rwSpeedOutMsg)
        motors = rwMotorTorque.rwMotorTorque()
        motors.controlAxes_B = np.eye(3).ravel().tolist()
        motors.rwParamsInMsg.subscribeTo(config)
        motors.vehControlInMsg.subscribeTo(servo.cmdTorqueOutMsg)
        wheels.rwMotorCmdInMsg.subscribeTo(motors.rwMotorTorqueOutMsg)
        # The simulation refers to messages that Python would otherwise let go.
        self.kept = (vehicle, config, factory)
        self.sim = SimulationBaseClass.SimBaseClass()
        process = self.sim.CreateNewProcess("satellite")
        for name, period, modules in (
            ("plant", PLANT, (wheels, self.hub, navigation)),
            ("software", SOFTWARE, (self.guidance, error, self.steering, servo, motors)),
        ):
            process.addTask(self.sim.CreateNewTask(name, macros.sec2nano(period)))
            for module in modules:
                self.sim.AddModelToTask(name, module)
        self.look_at(at, SPEED)
        self.sim.InitializeSimulation()
        self.attitude = self.hub.dynManager.getStateObject(self.hub.hub.nameOfHubSigma)
        self.rates = self.hub.dynManager.getStateObject(self.hub.hub.nameOfHubOmega)

    def look_at(self, place: Place, speed: float) -> None:
        """Gives guidance the attitude that looks at this place, and steering this limit of speed on the map."""
        self.guidance.sigma_R0N = looking_at(place)
        self.steering.omega_max = speed / RANGE

    def move(self, seconds: float) -> None:
        self.seconds += seconds
        self.sim.ConfigureStopTime(macros.sec2nano(round(self.seconds, 6)))
        self.sim.ExecuteSimulation()

    def turned(self) -> Array:
        """The matrix from the map's axes to the body's."""
        return np.array(RigidBodyKinematics.MRP2C(np.array(self.attitude.getState()).ravel()))

    def motion(self) -> tuple[Array, Array]:
        """Place that the payload looks at, and its velocity."""
        turned = self.turned()
        x, y, z = turned.T @ SIGHT
        u, v, w = turned.T @ np.cross(np.array(self.rates.getState()).ravel(), SIGHT)
        place = np.array([x, y]) / -z * RANGE
        return place, (np.array([u, v]) * RANGE + place * w) / -z

    def correct(self, place: Array, velocity: Array) -> None:
        """Moves the line of sight by this much on the map, and its velocity."""
        turned = self.turned()
        angle, rate = (turned @ [by[1] / RANGE, -by[0] / RANGE, 0.0] for by in (place, velocity))
        sigma = RigidBodyKinematics.addMRP(np.array(self.attitude.getState()).ravel(), angle / 4.0)
        self.attitude.setState([[part] for part in sigma])
        self.rates.setState([[part] for part in np.array(self.rates.getState()).ravel() + rate])


def hub(at: Place) -> spacecraft.Spacecraft:
    """The body, at rest, with its payload on `at`."""
    body = spacecraft.Spacecraft()
    body.hub.mHub = MASS
    body.hub.IHubPntBc_B = np.diag(INERTIA).tolist()
    body.hub.sigma_BNInit = [[part] for part in looking_at(at)]
    return body


def looking_at(place: Place) -> list[float]:
    """The attitude that looks at a place, by the shortest turn from straight down."""
    distance = math.hypot(*place)
    share = math.tan(math.atan2(distance, RANGE) / 4.0) / distance if distance > 0.0 else 0.0
    return [place[1] * share, -place[0] * share, 0.0]


class Basilisk(Guest):
    def start(self, start: Start) -> None:
        self.route, self.looped = list(start.route), start.looped
        self.satellite: Optional[Satellite] = None
        self.yaw = 0.0
        self.before = start.time_s
        self.newest_fix = self.newest_odometry = -math.inf

    def step(self, step: Step) -> Reply:
        elapsed, self.before = step.time_s - self.before, step.time_s
        if self.satellite is None:
            if step.fix is None:
                return Reply(0.0, 0.0, state="WAITING", place=(0.0, 0.0))
            self.satellite, self.yaw = Satellite(step.fix.at), step.fix.yaw_rad
        satellite = self.satellite
        self.correct(satellite, step)
        (x, y), _ = satellite.motion()
        permitted = step.limit_m_s > 0.0
        if permitted and len(self.route) > (0 if self.looped else 1) and math.dist((x, y), self.route[0]) < NEAR:
            reached = self.route.pop(0)
            if self.looped:
                self.route.append(reached)
        going = permitted and bool(self.route)
        satellite.look_at(self.route[0] if going else (x, y), min(step.limit_m_s, SPEED) if going else SPEED)
        satellite.move(elapsed)
        (x, y), velocity = satellite.motion()
        if not going:
            return Reply(0.0, 0.0, state="WAITING", place=(x, y))
        speed, curvature = course(velocity, self.yaw, step.limit_m_s)
        arrived = not self.looped and len(self.route) == 1 and math.dist((x, y), self.route[0]) < NEAR
        return Reply(speed, curvature, state="ARRIVED" if arrived else "SLEWING", place=(x, y))

    def correct(self, satellite: Satellite, step: Step) -> None:
        """Takes plant and heading towards this step's readings, if they are new ones."""
        fix, odometry = step.fix, step.odometry
        place, velocity = satellite.motion()
        moved, faster = np.zeros(2), np.zeros(2)
        if fix is not None and fix.stamp_s > self.newest_fix:
            self.newest_fix = fix.stamp_s
            moved = PLACE * (np.array(fix.at) + velocity * (step.time_s - fix.stamp_s) - place)
            self.yaw += HEADING * math.remainder(fix.yaw_rad - self.yaw, math.tau)
        if odometry is not None and odometry.stamp_s > self.newest_odometry:
            self.yaw += odometry.yaw_rate_rad_s * min(odometry.stamp_s - self.newest_odometry, PLANT)
            self.newest_odometry = odometry.stamp_s
            ahead = np.array([math.cos(self.yaw), math.sin(self.yaw)])
            faster = VELOCITY * (odometry.speed_m_s - ahead @ velocity) * ahead
        satellite.correct(moved, faster)


def course(velocity: Array, yaw: float, limit: float) -> Place:
    """Speed and curvature of this motion, for a line of sight with this heading on the map."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    ahead, left = float(velocity @ [cos, sin]), float(velocity @ [-sin, cos])
    if math.hypot(ahead, left) < CREEP:
        return min(max(ahead, -limit), limit), 0.0
    speed = min(max(ahead, TURNING if abs(left) > ahead else 0.0), limit)
    turn = TURN * math.atan2(left, ahead)
    return speed, min(max(turn, -FASTEST_TURN), FASTEST_TURN) / max(speed, CREEP)


if __name__ == "__main__":
    run(Basilisk)
