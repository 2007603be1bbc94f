"""An unmodified ROS 2 node as a guest: starts the node's command and the bridge, and ends the node with it.

    ros2_guest.py [options] -- command of the node

Each process of the graph gets one environment: a domain to themselves, discovery and transport on the loopback interface alone, and a
temporary folder for logs. The exchange is left to `bridge`, the processes to `processes`.
"""

import argparse
import os
import re
import signal
import socket
import sys
import tempfile
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "python"))

from processes import NodeProcess, Warden, start_rogue

#: Domains whose ports are below those that Linux gives out by itself; ports of domain 0 and between two domains (RTPS).
DOMAINS, FIRST_PORT, PORTS = 101, 7400, 250


def own_domain() -> tuple[int, socket.socket]:
    """A domain that no other bridge of this machine has, held by a socket for as long as this process lives.

    :raises OSError: each domain is taken.
    """
    for offset in range(DOMAINS):
        domain = (os.getpid() + offset) % DOMAINS + 1
        held = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            held.bind(("127.0.0.1", FIRST_PORT + PORTS * domain))
            return domain, held
        except OSError:
            held.close()
    raise OSError(f"each of {DOMAINS} domains of ROS 2 is taken on this machine")


def profile(folder: str) -> str:
    """The profile of Fast DDS. In the sandbox interfaces cannot be listed, and the loopback interface is the only one."""
    shipped = HERE / "fastdds.xml"
    try:
        socket.socket(socket.AF_NETLINK, socket.SOCK_RAW).close()
        return str(shipped)
    except PermissionError:
        adapted = Path(folder) / shipped.name
        adapted.write_text(re.sub("<interfaceWhiteList>.*</interfaceWhiteList>", "", shipped.read_text(), flags=re.DOTALL))
        return str(adapted)


def environment(domain: int, folder: str) -> dict[str, str]:
    """Variables of the bridge, the node and the rogue. A profile of Fast DDS that the guest's file names is left as it is.

    The profile has discovery and transport, on the loopback interface alone, so the range of ROS is left to it: its `LOCALHOST` adds
    shared memory, of which killed nodes leave files.
    """
    # The name of the variable before version 3 of Fast DDS, of which the later ones warn.
    name = "FASTRTPS_DEFAULT_PROFILES_FILE" if find_spec("fastrtps") else "FASTDDS_DEFAULT_PROFILES_FILE"
    return {
        name: os.environ.get(name) or profile(folder),
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
        "ROS_LOG_DIR": folder,
        "PYTHONUNBUFFERED": "1",
    }


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="An unmodified ROS 2 node as a guest of holdsafe.")
    parser.add_argument("--command-topic", default="/cmd_vel", help="Twist or TwistStamped, as the node publishes it")
    parser.add_argument("--answer-ms", type=float, default=200.0, help="wall time for the answer to a step; then the last command stands")
    parser.add_argument("--ready-s", type=float, default=30.0, help="wall time until the node publishes commands")
    parser.add_argument("--command-period-s", type=float, default=0.0, help="vehicle time between commands, of a node with a timer")
    parser.add_argument("--plan-frame", default="map", help="frame of /plan; map and odom are one, but a node may ask for odom")
    parser.add_argument("--best-effort", action="store_true", help="readings that a reliable reader does not get")
    parser.add_argument("--unlocked", action="store_true", help="let commands through while the operator has not enabled driving")
    parser.add_argument("--no-place", action="store_true", help="for a node that does not drive by /odom: `gives` has no `place` then")
    parser.add_argument(
        "--keep-node", action="store_true", help="one process of the node for all trials: it begins again where /clock jumps back"
    )
    parser.add_argument("--rogue", action="store_true", help="start the rogue participant with the node, so that it hears what it replays")
    parser.add_argument("--rogue-best-effort", action="store_true", help="a rogue whose messages a reliable reader does not get")
    parser.add_argument("--rogue-program", default=str(HERE / "rogue.py"), help="the rogue participant, in Python")
    parser.add_argument("command", nargs="+", help="the node's command, after --")
    return parser.parse_args()


def main() -> NoReturn:
    asked = parsed()
    domain, held = own_domain()
    folder = tempfile.mkdtemp(prefix="ros2-guest-")
    os.environ.update(environment(domain, folder))
    # As an exception, so that the node is ended here and not by the warden alone.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with closing(held), closing(Warden(folder)) as warden:
        # Before ROS is loaded, which takes as long here as there.
        node = NodeProcess(warden, asked.command)
        try:
            serve(asked, warden, node)
        except KeyboardInterrupt:
            sys.exit(1)


def serve(asked: argparse.Namespace, warden: Warden, node: NodeProcess) -> NoReturn:
    from attacks import Attacks
    from bridge import Bridge, Options
    from holdsafe_guest import run
    from rogue_link import RogueLink

    options = Options(
        command_topic=asked.command_topic,
        answer_s=asked.answer_ms / 1000.0,
        ready_s=asked.ready_s,
        command_period_s=asked.command_period_s,
        plan_frame=asked.plan_frame,
        best_effort=asked.best_effort,
        unlocked=asked.unlocked,
        place=not asked.no_place,
        keep_node=asked.keep_node,
    )
    link = RogueLink(lambda: start_rogue(warden, asked.rogue_program), lambda process: warden.kill("rogue", process))
    bridge = Bridge(options, node, Attacks(link, asked.rogue, asked.rogue_best_effort))
    try:
        run(lambda: bridge)
    finally:
        bridge.end()


if __name__ == "__main__":
    main()
