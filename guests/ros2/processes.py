"""Processes of the guest beside the bridge: the node and the rogue participant, each in a session of its own, and their warden.

The warden outlives this process by the time to kill the others: whatever ends the bridge, none of them stays. The environment is that of
`environment`.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Optional

#: Reads the newest process of each role; at the end of its input kills their sessions and removes the folder.
WARDEN = """
while read -r role pid; do case $role in node) node=$pid;; rogue) rogue=$pid;; esac; done
for pid in $node $rogue; do kill -KILL "-$pid"; done
rm -rf -- "$1"
"""


class Warden:
    """Starts processes, and ends them with this one."""

    def __init__(self, folder: str) -> None:
        self.process = subprocess.Popen(
            ["sh", "-c", WARDEN, "warden", folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def start(self, role: str, command: list[str], **pipes: Any) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen(command, env=environment_of_a_child(command), start_new_session=True, **pipes)
        self._tell(role, str(process.pid))
        return process

    def kill(self, role: str, process: "subprocess.Popen[bytes]") -> None:
        """Ends a session now. Its number may be another's afterwards, so the warden forgets it."""
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()
        self._tell(role, "")

    def _tell(self, role: str, pid: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{role} {pid}\n".encode())
        self.process.stdin.flush()

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


class NodeProcess:
    """The node's process."""

    def __init__(self, warden: Warden, command: list[str]) -> None:
        self.warden, self.command = warden, command
        self.process = self._started()

    def _started(self) -> "subprocess.Popen[bytes]":
        # Standard output is the protocol's.
        return self.warden.start("node", self.command, stdin=subprocess.DEVNULL, stdout=2)

    def start_again(self) -> None:
        """A new process in place of the old one: a node has no convention to forget a mission."""
        self.warden.kill("node", self.process)
        self.process = self._started()

    def ended(self) -> Optional[str]:
        status = self.process.poll()
        return None if status is None else f"the node's command {self.command[0]} ended: status {status}"


def start_rogue(warden: Warden, program: str) -> "subprocess.Popen[bytes]":
    """The rogue participant, with pipes to this process."""
    command = [sys.executable, str(Path(program).resolve())]
    return warden.start("rogue", command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)


def environment_of_a_child(command: list[str]) -> dict[str, str]:
    """The environment without what the wheels' start-up file has set for this interpreter: the node may have another ROS.

    Fast DDS before version 3 reads its profile by another name, of which later ones warn: it is set where the node has its own interpreter.
    """
    left = {name: value for name, value in os.environ.items() if name not in ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")}
    if os.path.abspath(command[0]) != os.path.abspath(sys.executable) and (profile := left.get("FASTDDS_DEFAULT_PROFILES_FILE")):
        left.setdefault("FASTRTPS_DEFAULT_PROFILES_FILE", profile)
    folders = os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)
    if kept := [folder for folder in folders if folder and not folder.startswith(sys.prefix)]:
        left["LD_LIBRARY_PATH"] = os.pathsep.join(kept)
    return left
