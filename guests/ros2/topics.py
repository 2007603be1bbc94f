"""Names and types of the graph that bridge, witness and rogue share."""

from typing import Any, Optional

from geometry_msgs.msg import Twist, TwistStamped

ODOMETRY, CLOCK, PLAN = "/odom", "/clock", "/plan"
#: Types of a command.
COMMANDS: dict[str, Any] = {"geometry_msgs/msg/Twist": Twist, "geometry_msgs/msg/TwistStamped": TwistStamped}
#: Bytes of a writer's identity that all writers of one participant share.
PREFIX = 12
#: Topics on which an attack publishes; those on commands are left out, whose topic the user of the bridge names.
ATTACKED = {"odometry": ODOMETRY, "replay_odometry": ODOMETRY, "flood": ODOMETRY, "clock": CLOCK, "route": PLAN}
ON_COMMANDS = {"command", "replay_command"}


def topic_of(attack: str, command_topic: str) -> Optional[str]:
    """The topic on which an attack publishes, None for one that does not."""
    return command_topic if attack in ON_COMMANDS else ATTACKED.get(attack)
