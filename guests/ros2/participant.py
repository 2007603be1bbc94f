"""The rogue's participant of the ROS 2 graph: what it hears, and the publishers that it forges with.

It offers reliable and transient local, which matches each reader. What to forge is left to `rogue`.
"""

import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Callable, Optional

import rclpy
from nav_msgs.msg import Odometry, Path
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosgraph_msgs.msg import Clock

from topics import CLOCK, COMMANDS, ODOMETRY, PLAN, PREFIX

NAME = "stranger"
#: Heard messages that are kept of each topic: 200 s at 20 Hz.
KEPT = 4000
#: Messages that a reader holds until they are taken.
QUEUE = 1000
#: Wall time for an honest message to be heard, and for readers to be matched, s.
HEARS, MATCHES = 0.1, 1.0
#: Most messages of an attack in a step.
MOST = 2000


class Ear:
    """Messages of one topic as they were heard from others, by their sequence number."""

    def __init__(self, kind: Any) -> None:
        self.kind = kind
        self.heard: "OrderedDict[int, bytes]" = OrderedDict()
        #: Messages since a listener was last asked.
        self.count = 0

    def newest(self) -> int:
        return next(reversed(self.heard), 0)

    def message(self) -> Any:
        """The newest message, to be altered; None before the first."""
        return deserialize_message(self.heard[self.newest()], self.kind) if self.heard else None


@dataclass
class Done:
    """What an attack did in a step."""

    sent: int = 0
    #: Answers of a service, or messages that a listener heard.
    answered: int = 0
    why: Optional[str] = None


class Rogue:
    """The participant, for one trial."""

    def __init__(self, told: dict[str, Any]) -> None:
        self.command_topic, self.best_effort = told["command_topic"], told["best_effort"]
        #: Nodes that are not the target: those of the bridge and the witness.
        self.ours = [*told["ours"], NAME]
        self.context = Context()
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(NAME, context=self.context, enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        # By this topic the witness knows which participant the rogue is.
        self.mark = self.node.create_publisher(Clock, told["mark"], 1)
        self.prefix = bytes(self.node.get_publishers_info_by_topic(told["mark"])[0].endpoint_gid)[:PREFIX]
        self.publishers: dict[str, Any] = {}
        self.twin: Optional[Node] = None
        self.ears: dict[str, Ear] = {}
        types = {ODOMETRY: Odometry, CLOCK: Clock, PLAN: Path, self.command_topic: COMMANDS[told["command_type"]]}
        self.until(lambda: all(map(self.honest_writer, types)), MATCHES)
        for topic, kind in types.items():
            self.listen_to(topic, kind)

    def listen_to(self, topic: str, kind: Any) -> None:
        """A reader with the quality of service that the writer of a topic offers, so that what is to be replayed is not lost by chance."""
        ear = self.ears[topic] = Ear(kind)
        offers = [info.qos_profile for info in self.node.get_publishers_info_by_topic(topic)]
        reliable = bool(offers) and all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
        latched = bool(offers) and all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        profile = QoSProfile(
            depth=QUEUE,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        self.node.create_subscription(kind, topic, lambda message, info: self._hear(ear, message, info), profile, raw=True)

    def _hear(self, ear: Ear, message: bytes, info: Any) -> None:
        writer = bytes(info["publisher_gid"]["data"])
        if writer[:PREFIX] == self.prefix:
            return
        ear.count += 1
        ear.heard[info["publication_sequence_number"]] = message
        if len(ear.heard) > KEPT:
            ear.heard.popitem(last=False)

    def until(self, true: Callable[[], bool], limit_s: float) -> bool:
        end = time.monotonic() + limit_s
        while not true():
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            # A change of the graph is no message, and ends no wait.
            self.executor.spin_once(timeout_sec=min(left, 0.01))
        return True

    def empty(self) -> None:
        """Takes what has been heard, a queue's length at most."""
        for _ in range(QUEUE):
            heard = sum(ear.count for ear in self.ears.values())
            self.executor.spin_once(timeout_sec=0.0)
            if sum(ear.count for ear in self.ears.values()) == heard:
                break

    def hear(self, newest: dict[str, int]) -> None:
        """Waits until the honest messages of the step have been heard: a real rogue would act on them as they come."""
        self.until(lambda: all(self.ears[topic].newest() >= number for topic, number in newest.items()), HEARS)

    def publisher(self, topic: str) -> Any:
        """The publisher of a topic, made at its first use. Reliable and transient local matches each reader."""
        if topic not in self.publishers:
            reliability = ReliabilityPolicy.BEST_EFFORT if self.best_effort else ReliabilityPolicy.RELIABLE
            depth = 1 if topic == PLAN else MOST
            profile = QoSProfile(depth=depth, reliability=reliability, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            made = self.publishers[topic] = self.node.create_publisher(self.ears[topic].kind, topic, profile)
            readers = len(self.node.get_subscriptions_info_by_topic(topic))
            if not self.best_effort:
                self.until(lambda: made.get_subscription_count() >= readers, MATCHES)
        return self.publishers[topic]

    def publish(self, topic: str, message: Any, count: int) -> Done:
        if message is None:
            return Done(why=f"nothing heard on {topic} yet")
        publisher, count = self.publisher(topic), min(count, MOST)
        for _ in range(count):
            publisher.publish(message)
        return Done(sent=count)

    def replay(self, topic: str, number: int, count: int) -> Done:
        """A message of before, byte for byte."""
        message = self.ears[topic].heard.get(number)
        return Done(why="nothing so old was recorded") if message is None else self.publish(topic, message, count)

    def honest_writer(self, topic: str) -> Optional[bytes]:
        """Identity of a writer, as the bus announces it to each participant."""
        gids = (bytes(info.endpoint_gid) for info in self.node.get_publishers_info_by_topic(topic))
        return next((gid for gid in gids if gid[:PREFIX] != self.prefix), None)

    def target(self) -> Optional[TopicEndpointInfo]:
        """The node that sends commands."""
        infos = self.node.get_publishers_info_by_topic(self.command_topic)
        return next((info for info in infos if info.node_name not in self.ours and bytes(info.endpoint_gid)[:PREFIX] != self.prefix), None)

    def end(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)
