"""Nodes for the tests of the bridge to ROS 2, by name; each drives ahead at 1 m/s. Run by the interpreter of guests/ros2."""

import math
import sys
from typing import Any, Callable

import rclpy
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Imu, NavSatFix


class Ahead(Node):
    """Answers each pose; a default reader, which is reliable."""

    def __init__(self, kind: Any = Twist) -> None:
        super().__init__("ahead", allow_undeclared_parameters=True)
        self.kind, self.answered = kind, 0
        self.commands = self.create_publisher(kind, "/cmd_vel", 10)
        self.watch()

    def watch(self) -> None:
        self.create_subscription(Odometry, "/odom", lambda _: self.answer(), 10)

    def answer(self) -> None:
        self.answered += 1
        command = self.kind()
        if isinstance(command, TwistStamped):
            command.header.stamp = self.get_clock().now().to_msg()
            command.twist.linear.x = 1.0
        else:
            command.linear.x = 1.0
        self.commands.publish(command)


class Timed(Ahead):
    """A command each tenth of a second of its own clock, with a stamp."""

    def __init__(self) -> None:
        super().__init__(TwistStamped)

    def watch(self) -> None:
        self.create_timer(0.1, self.answer)


class Tired(Ahead):
    """Answers forty poses and no more."""

    def answer(self) -> None:
        if self.answered < 40:
            super().answer()


class Planned(Ahead):
    """Drives only with a plan, by a reader that gets nothing from before it was there."""

    def watch(self) -> None:
        super().watch()
        self.plan = False
        self.create_subscription(Path, "/plan", self.on_plan, 10)

    def on_plan(self, plan: Path) -> None:
        self.plan = bool(plan.poses)

    def answer(self) -> None:
        if self.plan:
            super().answer()


class Mapped(Ahead):
    """Drives only with a map that has free and occupied cells, and once tracks have come."""

    def watch(self) -> None:
        super().watch()
        self.seen: set[str] = set()
        self.create_subscription(OccupancyGrid, "/map", self.on_map, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.create_subscription(PoseArray, "/tracks", lambda _: self.seen.add("tracks"), qos_profile_sensor_data)

    def on_map(self, grid: OccupancyGrid) -> None:
        if set(grid.data) == {0, 100} and len(grid.data) == grid.info.width * grid.info.height and grid.header.frame_id == "map":
            self.seen.add("map")

    def answer(self) -> None:
        if self.seen == {"map", "tracks"}:
            super().answer()


class Navigated(Ahead):
    """Drives only with a pose at the start, a fix in degrees and a rate of turn whose other quantities are marked as unknown."""

    def watch(self) -> None:
        super().watch()
        self.seen: set[str] = set()
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(PoseWithCovarianceStamped, "/initialpose", lambda _: self.seen.add("pose"), latched)
        self.create_subscription(NavSatFix, "/fix", self.on_fix, 10)
        self.create_subscription(Imu, "/imu", self.on_imu, qos_profile_sensor_data)

    def on_fix(self, fix: NavSatFix) -> None:
        # The driver's origin; without a height there is no altitude.
        if abs(fix.latitude - 47.0) < 0.001 and abs(fix.longitude - 8.0) < 0.001 and math.isnan(fix.altitude):
            self.seen.add("fix")

    def on_imu(self, imu: Imu) -> None:
        if imu.orientation_covariance[0] == imu.linear_acceleration_covariance[0] == -1.0 != imu.angular_velocity_covariance[0]:
            self.seen.add("imu")

    def answer(self) -> None:
        if self.seen == {"pose", "fix", "imu"}:
            super().answer()


NODES: dict[str, Callable[[], Node]] = {
    "ahead": Ahead,
    "stamped": lambda: Ahead(TwistStamped),
    "timed": Timed,
    "tired": Tired,
    "planned": Planned,
    "mapped": Mapped,
    "navigated": Navigated,
    "mute": lambda: Node("mute"),
}

if __name__ == "__main__":
    if sys.argv[1] == "ends":
        sys.exit(7)
    rclpy.init()
    rclpy.spin(NODES[sys.argv[1]]())
