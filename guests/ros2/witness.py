"""The witness: a participant of its own, whose readers have the quality of service of the node's, and count what arrives by its sender.

A sender is known by its participant (the first 12 bytes of the publisher's GID), never by what it sends. A packet made by hand can have
the GID of another writer, so the witness also compares sequence numbers: one that the bridge has not sent yet is the rogue's, and where
those of an honest writer stand still, that writer has been ended.
"""

import math
import time
from collections import deque
from dataclasses import dataclass
from typing import Any, Callable, Iterable, Optional

import rclpy
from nav_msgs.msg import Odometry, Path
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosgraph_msgs.msg import Clock

from conversion import Place
from graph import NEWEST, Graph
from topics import CLOCK, ODOMETRY, PLAN, PREFIX

#: So that a flood is counted and not overwritten; the depth of the node's reader is not announced on the bus.
DEPTH = 5000
#: Time without a new message after which no further one is expected, s.
QUIET = 0.1
#: Range of a place in the protocol, m.
FARTHEST = 10_000.0
#: Times of honest messages are kept for this many steps.
MARKS = 20_000


@dataclass
class Count:
    """One topic's messages: those of this step, and the newest."""

    rogue: int = 0
    honest: int = 0
    #: Sequence number of the newest honest message, 0 without one.
    sequence: int = 0
    #: True if the newest message is the rogue's.
    from_rogue: bool = False


class Witness:
    """The readers, from the moment when the rogue may begin. `rogue` is its participant, once it is known."""

    NAME = "holdsafe_witness"

    def __init__(self, graph: Graph) -> None:
        self.context = Context()
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(self.NAME, context=self.context, enable_rosout=False, start_parameter_services=False)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.rogue: Optional[bytes] = None
        self.published = graph.published
        #: The newest pose that has arrived, as bytes.
        self.pose: Optional[bytes] = None
        self.command_topic = graph.command_topic
        types = {ODOMETRY: Odometry, CLOCK: Clock, PLAN: Path, self.command_topic: graph.command_type}
        # The number of each honest message so far, so that none is waited for.
        sent = {**graph.published, self.command_topic: graph.base.sequence}
        self.counts = {topic: Count(sequence=sent[topic]) for topic in types}
        #: Quality of service of the node's readers, None where it has none.
        self.readers = {topic: self._quality(graph, topic) for topic in types}
        for topic, kind in types.items():
            self._subscribe(topic, kind)
        infos = self.node.get_subscriptions_info_by_topic(self.command_topic)
        #: This participant; no rogue is there yet that could have taken its name.
        self.prefix = next(bytes(info.endpoint_gid)[:PREFIX] for info in infos if info.node_name == self.NAME)
        self.marks: "deque[tuple[float, dict[str, int]]]" = deque(maxlen=MARKS)

    def _quality(self, graph: Graph, topic: str) -> Optional[QoSProfile]:
        """That of the node's reader, or the base's for commands."""
        if topic == self.command_topic:
            return NEWEST
        infos = graph.node.get_subscriptions_info_by_topic(topic)
        return next((info.qos_profile for info in infos if bytes(info.endpoint_gid)[:PREFIX] != graph.prefix), None)

    def _subscribe(self, topic: str, kind: Any) -> None:
        quality = self.readers[topic]
        reliability = quality.reliability if quality else ReliabilityPolicy.RELIABLE
        durability = quality.durability if quality else DurabilityPolicy.VOLATILE
        profile = QoSProfile(depth=DEPTH, reliability=reliability, durability=durability)
        # As bytes, which need not be decoded.
        self.node.create_subscription(kind, topic, lambda message, info: self._count(topic, message, info), profile, raw=True)

    def _count(self, topic: str, message: bytes, info: Any) -> None:
        if "publisher_gid" not in info:
            raise RuntimeError("attacks need rclpy of Kilted or later: earlier ones do not say who sent a message")
        count, number = self.counts[topic], info["publication_sequence_number"]
        rogue = self._is_rogue(info["publisher_gid"]["data"])
        # A packet made by hand, in the name of the bridge: its content is too short to be a message.
        made = not rogue and number > self.published.get(topic, number)
        count.from_rogue = rogue or made
        if topic == ODOMETRY and not made:
            self.pose = message
        if count.from_rogue:
            count.rogue += 1
        else:
            count.honest += 1
            count.sequence = number

    def until(self, true: Callable[[], bool], limit_s: float) -> bool:
        """Counts until something is true, or until no message has come for `QUIET`, at most for `limit_s` of real time."""
        since = time.monotonic()
        end = since + limit_s
        while not true():
            left = min(end, since + QUIET) - time.monotonic()
            if left <= 0.0:
                return False
            if self._spin(left):
                since = time.monotonic()
        return True

    def _spin(self, limit_s: float) -> bool:
        """Counts one message, if one is there within the limit."""
        before = sum(count.rogue + count.honest for count in self.counts.values())
        self.executor.spin_once(timeout_sec=limit_s)
        return sum(count.rogue + count.honest for count in self.counts.values()) > before

    def begin_step(self) -> None:
        """Takes what came after the last step, and begins to count from zero."""
        for _ in range(DEPTH):
            if not self._spin(0.0):
                break
        for count in self.counts.values():
            count.rogue = count.honest = 0

    def mark(self, time_s: float) -> None:
        """Keeps which messages were the newest at the end of a step, so that a replay can name those of an earlier one."""
        self.marks.append((time_s, {topic: count.sequence for topic, count in self.counts.items()}))

    def sequence_at(self, topic: str, time_s: float) -> int:
        """Sequence number of the honest message that was the newest at a time, 0 without one."""
        return next((mark[topic] for at, mark in reversed(self.marks) if at <= time_s + 1e-6), 0)

    def place(self) -> Optional[Place]:
        """The place of the newest pose that has arrived, which the node drives by, whoever sent it."""
        if self.pose is None:
            return None
        at = deserialize_message(self.pose, Odometry).pose.pose.position
        place = (min(max(at.x, -FARTHEST), FARTHEST), min(max(at.y, -FARTHEST), FARTHEST))
        return place if all(map(math.isfinite, place)) else None

    def identify(self, mark: str, limit_s: float) -> Optional[bytes]:
        """The rogue's participant: the one with a publisher on a topic whose name nobody else was told."""

        def found() -> bool:
            infos = self.node.get_publishers_info_by_topic(mark)
            self.rogue = bytes(infos[0].endpoint_gid)[:PREFIX] if infos else None
            return bool(infos)

        self._wait(found, limit_s)
        return self.rogue

    def discover(self, topic: str, limit_s: float) -> bool:
        """Waits until the rogue's publisher of a topic is known here, as it then is to the node's participant."""
        return self._wait(lambda: any(self._publishers(topic)), limit_s)

    def _wait(self, true: Callable[[], bool], limit_s: float) -> bool:
        """Waits for a change of the graph, which is no message."""
        end = time.monotonic() + limit_s
        while not true():
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            self._spin(min(left, 0.01))
        return True

    def _is_rogue(self, gid: Iterable[int]) -> bool:
        return self.rogue is not None and bytes(gid)[:PREFIX] == self.rogue

    def _publishers(self, topic: str, rogue: bool = True) -> "list[TopicEndpointInfo]":
        return [info for info in self.node.get_publishers_info_by_topic(topic) if self._is_rogue(info.endpoint_gid) == rogue]

    def unread(self, topic: Optional[str]) -> Optional[str]:
        """The reason why an attack on a topic has no target, None if it has one or needs none."""
        return None if topic is None or self.readers[topic] is not None else f"the node does not read {topic}"

    def refusal(self, topic: str) -> Optional[str]:
        """The reason why the node's reader gets nothing of the rogue, if its announcement on the bus shows one."""
        reader = self.readers[topic]
        if reader is None:
            return None
        offers = [info.qos_profile for info in self._publishers(topic)]
        refused = any(qos_check_compatible(offer, reader)[0] == QoSCompatibility.ERROR for offer in offers)
        return "incompatible QoS" if refused else None

    def twins(self, limit_s: float) -> bool:
        """True once the graph has two nodes with the name of the one that sends commands."""
        names = {(info.node_name, info.node_namespace) for info in self._publishers(self.command_topic, rogue=False)}
        return self._wait(lambda: any(self.node.get_node_names_and_namespaces().count(name) > 1 for name in names), limit_s)

    def end(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)
