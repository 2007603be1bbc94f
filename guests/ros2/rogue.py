"""A rogue participant of the ROS 2 graph: what any process that reaches the bus can do without a key.

The bridge tells it on standard input, a line of JSON at a time, which attacks to carry out now and how many messages each is; a line on
standard output answers how many it has put on the bus. Whether an attack had an effect is left to the witness. The bridge keeps its limits
of time without the rogue, which may hang or end.
"""

import json
import os
import select
import sys
from typing import Any, Callable, Optional

from geometry_msgs.msg import PoseArray, TwistStamped
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix

import packet
from conversion import stamp
from participant import HEARS, Done, Rogue
from topics import CLOCK, ODOMETRY, PLAN, topic_of

#: Wall time for an answer of a service, s.
ANSWERS = 0.5
#: Wall time after which the queues of its readers are emptied, s.
IDLE = 0.02
#: Further topics of a listener.
OVERHEARD = {"/imu": Imu, "/fix": NavSatFix, "/tracks": PoseArray}


def forge_odometry(rogue: Rogue, order: dict[str, Any]) -> Done:
    """The newest pose, shifted north."""
    message = rogue.ears[ODOMETRY].message()
    if message is not None:
        message.pose.pose.position.y += order["amount"]
    return rogue.publish(ODOMETRY, message, order["count"])


def forge_command(rogue: Rogue, order: dict[str, Any]) -> Done:
    """Straight ahead, at a speed."""
    message = rogue.ears[rogue.command_topic].kind()
    twist = message
    if isinstance(message, TwistStamped):
        twist = message.twist
        message.header.stamp.sec, message.header.stamp.nanosec = stamp(order["time_s"])
    twist.linear.x = float(order["amount"])
    return rogue.publish(rogue.command_topic, message, order["count"])


def forge_clock(rogue: Rogue, order: dict[str, Any]) -> Done:
    message = Clock()
    message.clock.sec, message.clock.nanosec = stamp(order["time_s"] + order["amount"])
    return rogue.publish(CLOCK, message, order["count"])


def forge_route(rogue: Rogue, order: dict[str, Any]) -> Done:
    """The plan, shifted north."""
    rogue.until(lambda: bool(rogue.ears[PLAN].heard), HEARS)
    message = rogue.ears[PLAN].message()
    for way_point in message.poses if message else ():
        way_point.pose.position.y += order["amount"]
    return rogue.publish(PLAN, message, order["count"])


def replay_odometry(rogue: Rogue, order: dict[str, Any]) -> Done:
    return rogue.replay(ODOMETRY, order["sequence"], order["count"])


def replay_command(rogue: Rogue, order: dict[str, Any]) -> Done:
    return rogue.replay(rogue.command_topic, order["sequence"], order["count"])


def flood(rogue: Rogue, order: dict[str, Any]) -> Done:
    """The newest pose, byte for byte: the number alone is the attack."""
    ear = rogue.ears[ODOMETRY]
    return rogue.replay(ODOMETRY, ear.newest(), order["count"])


def silence(rogue: Rogue, order: dict[str, Any]) -> Done:
    """One forged packet in the name of the honest writer of poses, of the kind that its readers take."""
    writer = rogue.honest_writer(ODOMETRY)
    if writer is None:
        return Done(why=f"no honest writer of {ODOMETRY}")
    if not order["first"]:
        return Done()
    readers = [info for info in rogue.node.get_subscriptions_info_by_topic(ODOMETRY) if info.node_name not in rogue.ours]
    reliable = all(info.qos_profile.reliability == ReliabilityPolicy.RELIABLE for info in readers)
    packet.send(packet.heartbeat(writer) if reliable else packet.data(writer), int(os.environ.get("ROS_DOMAIN_ID", "0")))
    return Done(sent=1)


def set_parameter(rogue: Rogue, order: dict[str, Any]) -> Done:
    """Sets `use_sim_time` of the node by its own service, which asks nobody for a right to it."""
    target, done = rogue.target(), Done()
    if target is None:
        return Done(why="no node sends commands")
    name = f"{target.node_namespace.rstrip('/')}/{target.node_name}/set_parameters"
    client: Any = rogue.node.create_client(SetParameters, name)
    if not rogue.until(client.service_is_ready, ANSWERS):
        return Done(why="the node has no service for parameters")
    value = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=order["amount"] >= 0.5)
    for _ in range(order["count"]):
        future = client.call_async(SetParameters.Request(parameters=[Parameter(name="use_sim_time", value=value)]))
        done.sent += 1
        if not rogue.until(future.done, ANSWERS):
            done.why = "the service gives no answer"
            break
        result = future.result().results[0]
        done.answered += result.successful
        done.why = None if result.successful else f"refused: {result.reason}"[:80]
    rogue.node.destroy_client(client)
    return done


def take_name(rogue: Rogue, order: dict[str, Any]) -> Done:
    """A node of the same name: nothing on the bus forbids it."""
    target = rogue.target()
    if target is None:
        return Done(why="no node sends commands")
    if rogue.twin is not None:
        return Done()
    rogue.twin = Node(target.node_name, namespace=target.node_namespace, context=rogue.context, enable_rosout=False)
    return Done(sent=1)


def listen(rogue: Rogue, order: dict[str, Any]) -> Done:
    """Counts what is heard from its first step on, and sends nothing."""
    for topic, kind in OVERHEARD.items():
        if topic not in rogue.ears:
            rogue.listen_to(topic, kind)
    rogue.empty()
    heard = 0 if order["first"] else sum(ear.count for ear in rogue.ears.values())
    for ear in rogue.ears.values():
        ear.count = 0
    return Done(answered=heard)


ATTACKS: dict[str, Callable[[Rogue, dict[str, Any]], Done]] = {
    "odometry": forge_odometry,
    "command": forge_command,
    "clock": forge_clock,
    "route": forge_route,
    "replay_odometry": replay_odometry,
    "replay_command": replay_command,
    "silence": silence,
    "parameter": set_parameter,
    "flood": flood,
    "take_name": take_name,
    "listen": listen,
}


def answer(rogue: Rogue, request: dict[str, Any]) -> dict[str, Any]:
    """Carries out a request: publishers for attacks that begin, or the messages of a step."""
    if "open" in request:
        topics = [topic for attack in request["open"] if (topic := topic_of(attack, rogue.command_topic))]
        for topic in topics:
            rogue.publisher(topic)
        return {"topics": topics}
    rogue.hear(request["heard"])
    done = {}
    for order in request["act"]:
        act = ATTACKS.get(order["attack"])
        done[str(order["id"])] = vars(act(rogue, order) if act else Done(why="unknown attack"))
    return {"done": done}


def serve() -> None:
    """Answers each line, until the input ends. A participant lives from a start to the next leave."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    # Libraries write to descriptor 1.
    os.dup2(2, 1)
    rogue: Optional[Rogue] = None
    while True:
        if rogue and not select.select([sys.stdin], [], [], IDLE)[0]:
            rogue.empty()
            continue
        if not (line := sys.stdin.buffer.readline()):
            return
        request = json.loads(line)
        content: dict[str, Any] = {}
        if "leave" in request and rogue:
            rogue.end()
            rogue = None
        elif "start" in request:
            rogue = Rogue(request["start"])
        elif rogue:
            content = answer(rogue, request)
        answers.write(json.dumps({"number": request["number"], **content}).encode() + b"\n")


if __name__ == "__main__":
    serve()
