"""WPILib's pose estimator, trajectory generator and path controller as a guest: the classes by which teams of the FIRST Robotics
Competition drive their robots.

Written from the docstrings of robotpy-wpimath 2026.2.2 (DifferentialDrivePoseEstimator, TrajectoryGenerator, LTVUnicycleController) and
WPILib's documentation of them at docs.wpilib.org. The library is unmodified. The adapter joins the classes as that documentation does:
odometry into the estimator at each step, each new fix as a measurement with the standard deviation that its source states, one
trajectory through the way points from the first fix, the controller towards its state of the moment. Time is the vehicle's clock.

The documentation recommends to add only measurements within about a metre of the estimate. The adapter has no such gate, as the
library has none. Obstacles, tracks, teammates and the fence are not looked at: a trajectory is planned once, and knows no obstacles.

Observed with python/tests/driver.py, a point with exact sensors, the attack from 4 s on (one run each, and a second one with the same
answers byte for byte; in python/: python3 -m tests.driver --seconds 60 --attack A -- ../guests/wpilib/.venv/bin/python
../guests/wpilib/wpilib_guest.py):

- none: 20.0 m to the goal, ARRIVED from 13.05 s.
- freeze (the fix repeats itself, odometry goes on): the estimate stays at the frozen place, the controller drives harder to catch up
  with its trajectory, and the vehicle stands 12.3 m beyond the goal when the trajectory's time is over. ARRIVED all the same.
- drift (0.5 m/s to the north): follows it, and is ARRIVED 4.2 m beside the goal.
- dropout (no fix): goes on by odometry alone, to 0.0 m from the goal with the driver's exact odometry.
"""

import math
import sys
from pathlib import Path
from typing import Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

from wpimath.controller import LTVUnicycleController
from wpimath.estimator import DifferentialDrivePoseEstimator
from wpimath.geometry import Pose2d, Rotation2d, Translation2d
from wpimath.kinematics import DifferentialDriveKinematics
from wpimath.trajectory import Trajectory, TrajectoryConfig, TrajectoryGenerator
from wpimath.trajectory.constraint import CentripetalAccelerationConstraint

from holdsafe_guest import Fix, Guest, Place, Reply, Start, Step, run

#: Distance between left and right wheels, m.
TRACK_WIDTH = 0.9
#: Speed and acceleration that trajectories are planned with, m/s and m/s²; sideways, m/s².
MAX_SPEED, ACCELERATION, SIDEWAYS = 2.0, 0.8, 1.0
#: Greatest curvature that the vehicle can drive, 1/m; slowest speed that has one, m/s.
MAX_CURVATURE, CREEP = 0.4, 0.05
#: Standard deviations of the model (the library's defaults) and of a fix's heading: m, m, rad.
MODEL = (0.02, 0.02, 0.01)
HEADING = 0.02


class Wheels:
    """Distances of the two wheels and the angle of the gyroscope, summed from speed and yaw rate."""

    def __init__(self) -> None:
        self.left = self.right = self.angle = 0.0
        self.stamp: Optional[float] = None

    def take(self, step: Step) -> None:
        reading = step.odometry
        if reading is None:
            return
        dt = 0.0 if self.stamp is None else max(reading.stamp_s - self.stamp, 0.0)
        self.stamp = reading.stamp_s
        self.angle += reading.yaw_rate_rad_s * dt
        half = reading.yaw_rate_rad_s * TRACK_WIDTH / 2
        self.left += (reading.speed_m_s - half) * dt
        self.right += (reading.speed_m_s + half) * dt


class Wpilib(Guest):
    def start(self, start: Start) -> None:
        self.mission = start
        self.wheels = Wheels()
        self.controller = LTVUnicycleController(start.period_s, start.max_speed_m_s)
        self.estimator: Optional[DifferentialDrivePoseEstimator] = None
        self.trajectory: Optional[Trajectory] = None
        #: Time along the trajectory, s, and of the step before.
        self.along = 0.0
        self.before = start.time_s
        self.newest = -math.inf

    def step(self, step: Step) -> Reply:
        self.wheels.take(step)
        elapsed, self.before = step.time_s - self.before, step.time_s
        pose = self.estimate(step)
        if pose is None:
            return Reply(0.0, 0.0, state="WAITING", place=(0.0, 0.0))
        place = (pose.X(), pose.Y())
        if step.limit_m_s <= 0.0 or not self.mission.route:
            return Reply(0.0, 0.0, state="WAITING", place=place)
        if self.trajectory is None or (self.mission.looped and self.along >= self.trajectory.totalTime()):
            self.trajectory = self.plan(pose)
            self.along = 0.0
        self.along += elapsed
        if self.along >= self.trajectory.totalTime():
            return Reply(0.0, 0.0, state="ARRIVED", place=place)
        speeds = self.controller.calculate(pose, self.trajectory.sample(self.along))
        speed = min(max(speeds.vx, -step.limit_m_s), step.limit_m_s)
        curvature = speeds.omega / speeds.vx if abs(speeds.vx) > CREEP else 0.0
        return Reply(speed, min(max(curvature, -MAX_CURVATURE), MAX_CURVATURE), state="FOLLOWING", place=place)

    def estimate(self, step: Step) -> Optional[Pose2d]:
        """The estimator's pose after this step's odometry and, if it is a new one, its fix; none before the first fix."""
        fix, wheels = step.fix, self.wheels
        if self.estimator is None:
            if fix is None:
                return None
            kinematics = DifferentialDriveKinematics(TRACK_WIDTH)
            gyro = Rotation2d(wheels.angle)
            self.estimator = DifferentialDrivePoseEstimator(
                kinematics, gyro, wheels.left, wheels.right, pose_of(fix), MODEL, (fix.sigma_m, fix.sigma_m, HEADING)
            )
        pose = self.estimator.updateWithTime(step.time_s, Rotation2d(wheels.angle), wheels.left, wheels.right)
        if fix is not None and fix.stamp_s > self.newest:
            self.newest = fix.stamp_s
            self.estimator.addVisionMeasurement(pose_of(fix), fix.stamp_s, (fix.sigma_m, fix.sigma_m, HEADING))
            pose = self.estimator.getEstimatedPosition()
        return pose

    def plan(self, pose: Pose2d) -> Trajectory:
        """The trajectory from `pose` through the route, with a stop at its end."""
        route: list[Place] = list(self.mission.route)
        last = route[-1]
        before = route[-2] if len(route) > 1 else (pose.X(), pose.Y())
        end = Pose2d(last[0], last[1], math.atan2(last[1] - before[1], last[0] - before[0]))
        config = TrajectoryConfig(min(MAX_SPEED, self.mission.max_speed_m_s), ACCELERATION)
        config.addConstraint(CentripetalAccelerationConstraint(SIDEWAYS))
        between = [Translation2d(x, y) for x, y in route[:-1] if math.hypot(x - pose.X(), y - pose.Y()) > 1.0]
        return TrajectoryGenerator.generateTrajectory(pose, between, end, config)


def pose_of(fix: Fix) -> Pose2d:
    return Pose2d(fix.at[0], fix.at[1], fix.yaw_rad)


if __name__ == "__main__":
    run(Wpilib)
