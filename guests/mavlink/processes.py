"""The processes beside the bridge: the program under test in a session of its own, and the helpers that answer a line with a line.

Whatever ends the bridge ends them: a helper at the end of its input, the program by a warden that waits for the same.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Optional

HERE = Path(__file__).resolve().parent
#: Waits for the end of the bridge, then kills the program's session and removes its folder.
WARDEN = 'cat; kill -KILL "-$1"; rm -rf -- "$2"'


class Helper:
    """The relay, or the proxy: its lines are JSON."""

    def __init__(self, script: str, *options: str) -> None:
        command = [sys.executable, str(HERE / script), *options]
        self.name = script
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
        self.first = self.read()

    def read(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.name} ended: status {self.process.wait()}")
        return json.loads(line)

    def tell(self, told: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(told).encode() + b"\n")
        self.process.stdin.flush()

    def ask(self, asked: Any) -> Any:
        self.tell(asked)
        return self.read()

    def end(self) -> None:
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()


class Program:
    """The program under test, which may end before the trial does."""

    def __init__(self, command: list[str], environment: dict[str, str], folder: str) -> None:
        self.name, self.told = command[0], False
        # Standard output is the protocol's.
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=2, env={**os.environ, **environment}, start_new_session=True
        )
        self.warden = subprocess.Popen(
            ["sh", "-c", WARDEN, "warden", str(self.process.pid), folder],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def ended(self) -> Optional[str]:
        status = self.process.poll()
        return None if status is None else f"the program {self.name} ended: status {status}"

    def note_end(self) -> None:
        """Says once that the program has ended."""
        sentence = self.ended()
        if sentence and not self.told:
            self.told = True
            print(f"mavlink: {sentence}", file=sys.stderr)

    def end(self) -> None:
        assert self.warden.stdin is not None
        self.warden.stdin.close()
        self.warden.wait()
        self.process.wait()
