"""Pure pursuit of /plan by /odom: an ordinary node, which knows nothing of holdsafe. Naive by intention: the newest pose is the place."""

import math

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry, Path
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data


class PurePursuit(Node):
    def __init__(self) -> None:
        super().__init__("pure_pursuit")
        self.speed: float = self.declare_parameter("speed", 1.5).value
        self.reached: float = self.declare_parameter("reached", 1.0).value
        self.plan: list[tuple[float, float]] = []
        self.points: list[tuple[float, float]] = []
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Path, "/plan", self.on_plan, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
        self.create_subscription(Odometry, "/odom", self.on_odometry, qos_profile_sensor_data)
        backward = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False)
        # The clock has no callback without this handle.
        self.jumps = self.get_clock().create_jump_callback(backward, post_callback=self.on_jump)

    def on_jump(self, _: object) -> None:
        """A simulation has begun again."""
        self.plan, self.points = [], []

    def on_plan(self, plan: Path) -> None:
        points = [(pose.pose.position.x, pose.pose.position.y) for pose in plan.poses]
        # The same plan again is not a new mission.
        if points != self.plan:
            self.plan, self.points = points, list(points)

    def on_odometry(self, odometry: Odometry) -> None:
        at, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
        if self.points and math.dist((at.x, at.y), self.points[0]) < self.reached:
            passed = self.points.pop(0)
            closed = len(self.plan) > 2 and self.plan[0] == self.plan[-1]
            if closed and passed != self.points[-1]:
                self.points.append(passed)
        command = Twist()
        if self.points:
            east, north = self.points[0][0] - at.x, self.points[0][1] - at.y
            bearing = math.atan2(north, east) - 2.0 * math.atan2(turn.z, turn.w)
            arc = 2.0 * math.sin(bearing) / math.hypot(east, north)
            arc = math.copysign(0.4, arc) if math.cos(bearing) < 0.0 else max(-0.4, min(0.4, arc))
            command.linear.x, command.angular.z = self.speed, self.speed * arc
        self.commands.publish(command)


def main() -> None:
    rclpy.init()
    rclpy.spin(PurePursuit())


if __name__ == "__main__":
    main()
