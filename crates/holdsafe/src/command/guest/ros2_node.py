"""A node of your own: drives at each way point of /plan in turn, by the newest pose on /odom."""

import math

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.points = []
        self.command = self.create_publisher(Twist, "/cmd_vel", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(Path, "/plan", self.take_plan, latched)
        self.create_subscription(Odometry, "/odom", self.drive, 1)

    def take_plan(self, plan):
        self.points = [(pose.pose.position.x, pose.pose.position.y) for pose in plan.poses]

    def drive(self, odometry):
        at, turn = odometry.pose.pose.position, odometry.pose.pose.orientation
        while self.points and math.dist((at.x, at.y), self.points[0]) < 1.0:
            self.points.pop(0)
        twist = Twist()
        if self.points:
            east, north = self.points[0][0] - at.x, self.points[0][1] - at.y
            error = math.atan2(north, east) - 2.0 * math.atan2(turn.z, turn.w)
            twist.linear.x = 1.5
            twist.angular.z = max(-0.6, min(0.6, 1.5 * math.sin(error)))
        self.command.publish(twist)


rclpy.init()
rclpy.spin(Driver())
