"""The bridge between `jsonl/1` and a ROS 2 graph: each step as messages, the node's next command as the answer.

A step's readings go out first and `/clock` last; then the bridge waits for a command, so that node and vehicle move in lock-step. It
changes no command, but lets none through until an operator has enabled driving, as the motors' enable of a base does. Conversions are
left to `conversion`, the node's process and the environment to `ros2_guest`.

The wheels have no `tf2_msgs`, so `/tf` and `/tf_static` are published only where that package is installed.
"""

import array
import math
import sys
import time
from dataclasses import dataclass
from typing import Any, Callable, Optional

import rclpy
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, TransformStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from conversion import Place, drive, grid, lost, plan, quaternion, seconds, stamp
from holdsafe_guest import Fix, Guest, Reply, Start, Step

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

#: Frames of REP-105.
MAP, ODOM, BASE = "map", "odom", "base_link"
LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: Reliable and best effort writers match a reader that is best effort.
COMMANDS = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
#: A step is sent again after this time until the node has answered for the first time: it may not have discovered each topic yet, s.
AGAIN = 0.05
#: Wall time for an answer where none is expected, s: between two commands of a node with a timer, whose phase drifts against the
#: vehicle's clock, and without a pose.
BETWEEN = 0.02
#: Time without a new reader after which a graph is complete, s.
SETTLED = 0.2
TYPES: dict[str, Any] = {"geometry_msgs/msg/Twist": Twist, "geometry_msgs/msg/TwistStamped": TwistStamped}


@dataclass(frozen=True)
class Options:
    """What the user of the bridge chooses."""

    #: Topic of the node's commands.
    command_topic: str = "/cmd_vel"
    #: Wall time for an answer to a step, s.
    answer_s: float = 0.2
    #: Wall time until a publisher of commands is found, s.
    ready_s: float = 30.0
    #: Vehicle time between the node's commands, s: 0 for one a step.
    command_period_s: float = 0.0
    #: True if readings are best effort, which a reliable reader does not match.
    best_effort: bool = False
    #: True if commands go through while the operator has not enabled driving.
    unlocked: bool = False
    #: True if replies state the place last given on `/odom`.
    place: bool = True


@dataclass
class Counts:
    """Steps of a run, by their answers."""

    steps: int = 0
    answered: int = 0
    #: Steps without an answer in time, in which the last command stood.
    missed: int = 0
    #: Commands to turn on the spot, or more sharply than the protocol has.
    lost_turns: int = 0


class Bridge(Guest):
    """The guest. `ended` gives the sentence of a node that has ended, or None."""

    def __init__(self, options: Options, ended: Callable[[], Optional[str]]) -> None:
        self.options, self.ended = options, ended
        self.counts = Counts()
        self.place: Place = (0.0, 0.0)
        #: Time of the last step that was answered; time of the step before this one.
        self.answered_s = self.before_s = float("-inf")
        #: True once two commands have come the stated period apart: then steps between are waited for by `BETWEEN` alone.
        self.in_phase = False
        #: True once a step went by without a command: further ones without a pose are then not waited for as long.
        self.silent = False
        self.command: Any = None
        self.fresh: Any = None
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node("holdsafe_bridge", enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        reliability = ReliabilityPolicy.BEST_EFFORT if options.best_effort else ReliabilityPolicy.RELIABLE
        readings = QoSProfile(depth=5, reliability=reliability)
        self.clock = self.node.create_publisher(Clock, "/clock", 10)
        self.odometry = self.node.create_publisher(Odometry, "/odom", readings)
        self.tracks = self.node.create_publisher(PoseArray, "/tracks", readings)
        self.latched = [self.node.create_publisher(OccupancyGrid, "/map", LATCHED), self.node.create_publisher(Path, "/plan", LATCHED)]
        if TFMessage:
            self.transforms = self.node.create_publisher(TFMessage, "/tf", readings)
            self.latched.append(self.node.create_publisher(TFMessage, "/tf_static", LATCHED))

    def start(self, start: Start) -> None:
        self.before_s, self.period_s = start.time_s, start.period_s
        self.mission = [map_of(start), path_of(start)]
        if TFMessage:
            self.mission.append(TFMessage(transforms=[transform(MAP, ODOM, start.time_s, (0.0, 0.0), 0.0)]))
        self.readers = [-1] * len(self.latched)
        self.node.create_subscription(self.discovered(), self.options.command_topic, self.take, COMMANDS)
        self.settle()
        self.publish_latched()
        for publisher in self.latched:
            # So that the node has map and plan before the first step.
            publisher.wait_for_all_acked(Duration(seconds=SETTLED))

    def discovered(self) -> Any:
        """The type of the node's commands, once a publisher of them is there."""
        topic = self.options.command_topic
        found: list[str] = []

        def seen() -> bool:
            found[:] = sorted({info.topic_type for info in self.node.get_publishers_info_by_topic(topic)})
            return bool(found)

        if not self.until(seen, self.options.ready_s):
            raise TimeoutError(f"no publisher of {topic} within {self.options.ready_s:g} s of real time")
        if len(found) > 1 or found[0] not in TYPES:
            raise TypeError(f"{topic}: one of {' or '.join(TYPES)} expected, got {' and '.join(found)}")
        return TYPES[found[0]]

    def settle(self) -> None:
        """Waits until no reader or writer has come for a while: which of them the first step meets must not be chance."""
        seen, since = [-1], time.monotonic()

        def settled() -> bool:
            nonlocal seen, since
            now = [publisher.get_subscription_count() for publisher in self.publishers()]
            if now != seen:
                seen, since = now, time.monotonic()
            return time.monotonic() - since >= SETTLED

        self.until(settled, self.options.ready_s)

    def publishers(self) -> list[Any]:
        return [self.clock, self.odometry, self.tracks, *self.latched]

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

    def step(self, step: Step) -> Reply:
        self.drain()
        self.publish_latched()
        self.publish(step)
        self.counts.steps += 1
        overdue = step.time_s >= self.answered_s + self.options.command_period_s - self.period_s / 2.0
        whole = (overdue or not self.in_phase) and not (self.silent and step.fix is None)
        answered = self.answer(step, self.options.answer_s if whole else BETWEEN)
        self.silent = not answered and (whole or self.silent)
        if answered:
            # A timer that sees its first /clock fires at once, out of its phase.
            self.in_phase = overdue and self.answered_s > float("-inf")
            self.answered_s = step.time_s
            self.counts.answered += 1
        elif overdue:
            self.in_phase = False
            self.counts.missed += 1
        self.before_s = step.time_s
        place = self.place if self.options.place else None
        if self.command is None or (step.limit_m_s <= 0.0 and not self.options.unlocked):
            return Reply(0.0, 0.0, state="WAITING", place=place)
        forward, turn = float(self.command.linear.x), float(self.command.angular.z)
        self.counts.lost_turns += lost(forward, turn)
        speed, curvature = drive(forward, turn)
        return Reply(speed, curvature, state="HOLDING" if overdue and not answered else "DRIVING", place=place)

    def answer(self, step: Step, limit_s: float) -> bool:
        """Waits for the first command after the step; false if none came within `limit_s`."""
        end = time.monotonic() + limit_s
        while self.fresh is None:
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            if not self.until(lambda: self.fresh is not None, min(left, AGAIN)) and self.command is None:
                self.publish_latched()
                self.publish(step)
        return True

    def take(self, message: Any) -> None:
        """A command of the node. One with a stamp from before the last step answers that one, and is late."""
        stamped = isinstance(message, TwistStamped)
        self.command = message.twist if stamped else message
        late = stamped and seconds(message.header.stamp.sec, message.header.stamp.nanosec) < self.before_s - 1e-6
        if self.fresh is None and not late:
            self.fresh = self.command

    def drain(self) -> None:
        """Takes commands that came after the last answer, so that none is taken for this step's."""
        for _ in range(COMMANDS.depth):
            self.executor.spin_once(timeout_sec=0.0)
            if self.fresh is None:
                break
            self.fresh = None

    def publish_latched(self) -> None:
        """Map and plan, again for each new reader: one that is not latched gets nothing from before it was there."""
        for at, (publisher, message) in enumerate(zip(self.latched, self.mission)):
            readers = publisher.get_subscription_count()
            if readers > self.readers[at]:
                publisher.publish(message)
            self.readers[at] = readers

    def publish(self, step: Step) -> None:
        """A step's readings, and its time last: what a timer of the node reads is of this step."""
        if step.fix is not None:
            self.place = step.fix.at
            self.odometry.publish(odometry_of(step, step.fix))
            if TFMessage:
                moved = transform(ODOM, BASE, step.fix.stamp_s, step.fix.at, step.fix.yaw_rad)
                self.transforms.publish(TFMessage(transforms=[moved]))
        self.tracks.publish(tracks_of(step))
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = stamp(step.time_s)
        self.clock.publish(clock)

    def end(self) -> None:
        counts = self.counts
        print(
            f"ros2: {counts.steps} steps, {counts.answered} answered, {counts.missed} missed, {counts.lost_turns} turns lost",
            file=sys.stderr,
        )
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()


def header(message: Any, frame: str, at_s: float) -> Any:
    """The message, with its header set."""
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = stamp(at_s)
    return message


def turned(turn: Any, yaw_rad: float) -> None:
    turn.x, turn.y, turn.z, turn.w = quaternion(yaw_rad)


def pose(at: Place, yaw_rad: float) -> Pose:
    made = Pose()
    made.position.x, made.position.y = at
    turned(made.orientation, yaw_rad)
    return made


def transform(parent: str, child: str, at_s: float, at: Place, yaw_rad: float) -> TransformStamped:
    made = header(TransformStamped(child_frame_id=child), parent, at_s)
    made.transform.translation.x, made.transform.translation.y = at
    turned(made.transform.rotation, yaw_rad)
    return made


def map_of(start: Start) -> OccupancyGrid:
    cells = grid(start.fence, [(block.at, block.half_m, block.heading_rad) for block in start.blocks])
    made = header(OccupancyGrid(), MAP, start.time_s)
    made.info.resolution, made.info.width, made.info.height = cells.cell_m, cells.width, cells.height
    made.info.origin = pose(cells.origin, 0.0)
    made.data = array.array("b", cells.cells)
    return made


def path_of(start: Start) -> Path:
    made = header(Path(), MAP, start.time_s)
    for at, course in plan(start.route, start.looped):
        made.poses.append(header(PoseStamped(pose=pose(at, course)), MAP, start.time_s))
    return made


def odometry_of(step: Step, fix: Fix) -> Odometry:
    """The pose of the fix, at its time, and the twist of the wheels."""
    made = header(Odometry(child_frame_id=BASE), ODOM, fix.stamp_s)
    made.pose.pose = pose(fix.at, fix.yaw_rad)
    made.pose.covariance[0] = made.pose.covariance[7] = fix.sigma_m**2
    if step.odometry is not None:
        made.twist.twist.linear.x = step.odometry.speed_m_s
        made.twist.twist.angular.z = step.odometry.yaw_rate_rad_s
    return made


def tracks_of(step: Step) -> PoseArray:
    """Places of the tracks with their courses; classes, speeds and confidence have no field."""
    made = header(PoseArray(), MAP, step.time_s)
    for track in step.tracks:
        made.poses.append(pose(track.at, math.atan2(track.velocity[1], track.velocity[0])))
    return made
