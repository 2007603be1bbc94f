"""The bridge's own part of the ROS 2 graph: its topics, their readers, and the base, which takes commands.

A graph belongs to one mission, or to several with `--keep-node`. When to publish and how long to wait is left to `bridge`.
"""

import time
from dataclasses import dataclass
from typing import Any, Callable, Optional

import rclpy
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix

import readings
from conversion import seconds
from holdsafe_guest import Fix, Start, Step

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

NAME = "holdsafe_bridge"
ODOMETRY, CLOCK, PLAN = "/odom", "/clock", "/plan"
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: Reliable and best effort writers match a reader that is best effort.
COMMANDS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
#: Time without a new reader after which a graph is complete, s.
SETTLED = 0.2
TYPES: dict[str, Any] = {"geometry_msgs/msg/Twist": Twist, "geometry_msgs/msg/TwistStamped": TwistStamped}
#: Bytes of a writer's identity that all writers of one participant share.
PREFIX = 12


@dataclass
class Base:
    """The vehicle's controller as it reads commands: the newest one is in force, whoever sent it."""

    command: Any = None
    #: True if the node has sent a command since the last step; as commands of the rogue are no answer, their number is kept apart.
    answered: bool = False
    #: Commands since the last step, of the node and of the rogue.
    honest: int = 0
    rogue: int = 0
    from_rogue: bool = False
    #: Sequence number of the newest command of the node.
    sequence: int = 0


class Graph:
    """The bridge's participant. `ended` gives the sentence of a node that has ended, or None."""

    def __init__(self, command_topic: str, best_effort: bool, ended: Callable[[], Optional[str]]) -> None:
        self.command_topic, self.ended = command_topic, ended
        self.context = Context()
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(NAME, context=self.context, enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.base = Base()
        #: The rogue's participant, once it is known.
        self.rogue: Optional[bytes] = None
        self.command_name = ""
        self.command_type: Any = None
        #: Time of the step before this one.
        self.before_s = float("-inf")
        self.mission: list[Any] = []
        self._create_publishers(ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE)
        #: This participant, the only one that it knows at once.
        self.prefix = bytes(self.node.get_publishers_info_by_topic(CLOCK)[0].endpoint_gid)[:PREFIX]
        #: Messages published by topic, which are the sequence numbers of their writers.
        self.published = {CLOCK: 0, ODOMETRY: 0, PLAN: 0}

    def _create_publishers(self, reliability: ReliabilityPolicy) -> None:
        quality = QoSProfile(depth=5, reliability=reliability)
        made = self.node.create_publisher
        self.clock = made(Clock, CLOCK, 10)
        self.odometry = made(Odometry, ODOMETRY, quality)
        self.imu, self.fix = made(Imu, "/imu", quality), made(NavSatFix, "/fix", quality)
        self.tracks = made(PoseArray, "/tracks", quality)
        self.latched = [made(OccupancyGrid, "/map", LATCHED), made(Path, PLAN, LATCHED)]
        self.initial = made(PoseWithCovarianceStamped, "/initialpose", LATCHED)
        if TFMessage:
            self.transforms = made(TFMessage, "/tf", quality)
            self.static = made(TFMessage, "/tf_static", LATCHED)

    def find_commands(self, limit_s: float) -> None:
        """Subscribes to the node's commands, once a publisher of them is there."""
        found: list[str] = []

        def seen() -> bool:
            found[:] = sorted({info.topic_type for info in self.node.get_publishers_info_by_topic(self.command_topic)})
            return bool(found)

        if not self.until(seen, limit_s):
            raise TimeoutError(f"no publisher of {self.command_topic} within {limit_s:g} s of real time")
        if len(found) > 1 or found[0] not in TYPES:
            raise TypeError(f"{self.command_topic}: one of {' or '.join(TYPES)} expected, got {' and '.join(found)}")
        self.command_name, self.command_type = found[0], TYPES[found[0]]
        self.node.create_subscription(self.command_type, self.command_topic, self._take, COMMANDS)

    def set_mission(self, start: Start, plan_frame: str) -> None:
        self.before_s, self.origin = start.time_s, start.origin
        self.mission = [(self.latched[0], readings.map_of(start)), (self.latched[1], readings.path_of(start, plan_frame))]
        if start.pose is not None:
            self.mission.append((self.initial, readings.initial_of(start.pose, start.time_s)))
        if TFMessage:
            still = readings.transform(readings.MAP, readings.ODOM, start.time_s, (0.0, 0.0), 0.0)
            self.mission.append((self.static, TFMessage(transforms=[still])))
        self.readers = [-1] * len(self.mission)

    def settle(self, limit_s: float) -> None:
        """Waits until no reader has come for a while: which of them the first step meets must not be chance."""
        seen, since = [-1], time.monotonic()

        def settled() -> bool:
            nonlocal seen, since
            now = [publisher.get_subscription_count() for publisher in self.node.publishers]
            if now != seen:
                seen, since = now, time.monotonic()
            return time.monotonic() - since >= SETTLED

        self.until(settled, limit_s)

    def until(self, true: Callable[[], bool], limit_s: float) -> bool:
        """Serves the graph until something is true, or for `limit_s` of real time."""
        end = time.monotonic() + limit_s
        while not true():
            if sentence := self.ended():
                raise RuntimeError(sentence)
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            self.executor.spin_once(timeout_sec=min(left, 0.01))
        return True

    def _take(self, message: Any, info: Any) -> None:
        """A command of the node or of the rogue. One of the node with a stamp from before the last step answers that one, and is late."""
        stamped = isinstance(message, TwistStamped)
        base = self.base
        base.command = message.twist if stamped else message
        base.from_rogue = self.rogue is not None and bytes(info["publisher_gid"]["data"])[:PREFIX] == self.rogue
        if base.from_rogue:
            base.rogue += 1
            return
        base.honest += 1
        base.sequence = info["publication_sequence_number"]
        late = stamped and seconds(message.header.stamp.sec, message.header.stamp.nanosec) < self.before_s - 1e-6
        base.answered = base.answered or not late

    def drain(self) -> None:
        """Takes commands that came after the last answer, so that none is taken for this step's."""
        for _ in range(COMMANDS.depth):
            taken = self.base.honest + self.base.rogue
            self.executor.spin_once(timeout_sec=0.0)
            if self.base.honest + self.base.rogue == taken:
                break
        self.base.answered = False
        self.base.honest = self.base.rogue = 0

    def is_heard_by(self, participant: Optional[bytes]) -> bool:
        """True once this participant sends poses and times to another."""
        readers = [self.node.get_subscriptions_info_by_topic(topic) for topic in (ODOMETRY, CLOCK)]
        return all(any(bytes(info.endpoint_gid)[:PREFIX] == participant for info in infos) for infos in readers)

    def publish_mission(self) -> None:
        """Map and plan, again for each new reader: one that is not latched gets nothing from before it was there."""
        for at, (publisher, message) in enumerate(self.mission):
            count = publisher.get_subscription_count()
            if count > self.readers[at]:
                publisher.publish(message)
                self._note(publisher.topic_name)
            self.readers[at] = count

    def know_readers(self) -> None:
        """Takes the readers there are for known: those of the witness and the rogue need no mission again."""
        self.readers = [publisher.get_subscription_count() for publisher, _ in self.mission]

    def wait_for_mission(self) -> None:
        """Waits until reliable readers have map and plan, so that the node has them before the first step."""
        for publisher, _ in self.mission:
            publisher.wait_for_all_acked(Duration(seconds=SETTLED))

    def publish_readings(self, step: Step) -> None:
        if step.fix is not None:
            self.odometry.publish(readings.odometry_of(step, step.fix))
            self._note(ODOMETRY)
            if TFMessage:
                moved = readings.transform(readings.ODOM, readings.BASE, step.fix.stamp_s, step.fix.at, step.fix.yaw_rad)
                self.transforms.publish(TFMessage(transforms=[moved]))
            self._publish_satellite_fix(step.fix)
        if step.odometry is not None:
            self.imu.publish(readings.imu_of(step.odometry))
        self.tracks.publish(readings.tracks_of(step))

    def _publish_satellite_fix(self, fix: Fix) -> None:
        if self.origin is not None:
            self.fix.publish(readings.satellite_fix_of(fix, self.origin))

    def publish_clock(self, time_s: float) -> None:
        """The time, after the readings of its step: what a timer of the node reads is of this step."""
        self.clock.publish(readings.clock_of(time_s))
        self._note(CLOCK)

    def _note(self, topic: str) -> None:
        if topic in self.published:
            self.published[topic] += 1

    def end(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)
