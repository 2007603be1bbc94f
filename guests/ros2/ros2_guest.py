"""An unmodified ROS 2 node as a guest: starts the node's command and the bridge, and ends the node with it.

    ros2_guest.py [options] -- command of the node

Both ends of the graph get one environment: a domain to themselves, discovery and transport on the loopback interface alone, and a temporary folder
for logs. The exchange is left to `bridge`.
"""

import argparse
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import NoReturn, Optional

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "python"))

#: Domains whose ports are below those that Linux gives out by itself; ports of domain 0 and between two domains (RTPS).
DOMAINS, FIRST_PORT, PORTS = 101, 7400, 250
#: Waits for the end of the bridge, whatever ends it; then kills the node's session and removes its folder.
WARDEN = 'cat; kill -KILL "-$1"; rm -rf -- "$2"'


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
    """Variables of the bridge and the node. A profile of Fast DDS that the guest's file names is left as it is.

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


def nodes_environment() -> dict[str, str]:
    """The environment without what the wheels' start-up file has set for this interpreter: the node may have another ROS."""
    left = {name: value for name, value in os.environ.items() if name not in ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")}
    folders = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    if kept := [folder for folder in folders if folder and not folder.startswith(sys.prefix)]:
        left["LD_LIBRARY_PATH"] = os.pathsep.join(kept)
    return left


class NodeProcess:
    """The node's process, in a session of its own, beside a warden that outlives this process by the time to kill it."""

    def __init__(self, command: list[str], folder: str) -> None:
        # Standard output is the protocol's.
        self.name = command[0]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=2, env=nodes_environment(), start_new_session=True)
        self.warden = subprocess.Popen(
            ["sh", "-c", WARDEN, "warden", str(self.process.pid), folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def ended(self) -> Optional[str]:
        status = self.process.poll()
        return None if status is None else f"the node's command {self.name} ended: status {status}"

    def end(self) -> None:
        assert self.warden.stdin is not None
        self.warden.stdin.close()
        self.warden.wait()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="An unmodified ROS 2 node as a guest of holdsafe.")
    parser.add_argument("--command-topic", default="/cmd_vel", help="Twist or TwistStamped, as the node publishes it")
    parser.add_argument("--answer-ms", type=float, default=200.0, help="wall time for the answer to a step; then the last command stands")
    parser.add_argument("--ready-s", type=float, default=30.0, help="wall time until the node publishes commands")
    parser.add_argument("--command-period-s", type=float, default=0.0, help="vehicle time between commands, of a node with a timer")
    parser.add_argument("--best-effort", action="store_true", help="readings that a reliable reader does not get")
    parser.add_argument("--unlocked", action="store_true", help="let commands through while the operator has not enabled driving")
    parser.add_argument("--no-place", action="store_true", help="for a node that does not drive by /odom: `gives` has no `place` then")
    parser.add_argument("command", nargs="+", help="the node's command, after --")
    return parser.parse_args()


def main() -> NoReturn:
    asked = parsed()
    domain, held = own_domain()
    folder = tempfile.mkdtemp(prefix="ros2-guest-")
    os.environ.update(environment(domain, folder))
    # As an exception, so that the node is ended here and not by the warden alone.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with closing(held):
        # Before ROS is loaded, which takes as long here as there.
        node = NodeProcess(asked.command, folder)
        try:
            serve(asked, node)
        except KeyboardInterrupt:
            sys.exit(1)
        finally:
            node.end()


def serve(asked: argparse.Namespace, node: NodeProcess) -> NoReturn:
    from bridge import Bridge, Options
    from holdsafe_guest import run

    bridge = Bridge(
        Options(
            command_topic=asked.command_topic,
            answer_s=asked.answer_ms / 1000.0,
            ready_s=asked.ready_s,
            command_period_s=asked.command_period_s,
            best_effort=asked.best_effort,
            unlocked=asked.unlocked,
            place=not asked.no_place,
        ),
        node.ended,
    )
    try:
        run(lambda: bridge)
    finally:
        bridge.end()


if __name__ == "__main__":
    main()
