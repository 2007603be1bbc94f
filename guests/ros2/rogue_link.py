"""The bridge's end of the pipes to the rogue's process: one question at a time, each with a limit of wall time.

A rogue that hangs, ends or answers nonsense costs the bridge a stated time and no more: the answer is missing then, and `why` has the
reason for the receipts.
"""

import json
import os
import select
import subprocess
import time
from typing import Any, Callable, Optional

#: Most bytes of answers that are read for one question.
MOST_BYTES = 64 * 1024
#: Wall time for the answer to an earlier question, once it is late, s.
LATE = 0.02


class RogueLink:
    """The rogue's process, started with the first question."""

    def __init__(self, start: Callable[[], "subprocess.Popen[bytes]"], kill: Callable[["subprocess.Popen[bytes]"], None]) -> None:
        self.start, self.kill = start, kill
        self.process: Optional["subprocess.Popen[bytes]"] = None
        self.number = 0
        self._begin()

    def _begin(self) -> None:
        #: True while the newest question has no answer.
        self.waits = False
        #: The reason why there is no answer; one of a failed rogue stays.
        self.why: Optional[str] = None
        self.failed = False
        self.rest = b""

    def ask(self, content: dict[str, Any], limit_s: float) -> Optional[dict[str, Any]]:
        """The answer, or None within the limit; then `why` has the reason."""
        if self.process is None:
            self.process = self.start()
        if self.waits and not self.failed:
            self._answer(LATE)
        if self.failed or self.waits:
            return None
        self.number += 1
        line = json.dumps({"number": self.number, **content}).encode() + b"\n"
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(line)
        except BrokenPipeError:
            self._fail(self._ended())
            return None
        self.waits = True
        return self._answer(limit_s)

    def leave(self, limit_s: float) -> None:
        """Takes the rogue out of the graph; a process that does not answer is ended, and the next question starts another."""
        if self.process is not None and self.ask({"leave": True}, limit_s) is None:
            self.kill(self.process)
            self.process = None
            self._begin()

    def _answer(self, limit_s: float) -> Optional[dict[str, Any]]:
        end, got = time.monotonic() + limit_s, 0
        while got < MOST_BYTES:
            left = end - time.monotonic()
            if left <= 0.0 or not select.select([self._output()], [], [], left)[0]:
                self.why = self.why or f"the rogue gives no answer within {limit_s:g} s"
                return None
            part = os.read(self._output(), MOST_BYTES)
            if not part:
                self._fail(self._ended())
                return None
            got += len(part)
            self.rest += part
            while b"\n" in self.rest:
                line, _, self.rest = self.rest.partition(b"\n")
                answer = parsed(line)
                if answer is None:
                    self._fail("the rogue's answer is none of its protocol")
                    return None
                if answer.get("number") == self.number:
                    self.waits, self.why = False, None
                    return answer
        self._fail("the rogue's answers have no end")
        return None

    def _output(self) -> int:
        assert self.process is not None and self.process.stdout is not None
        return self.process.stdout.fileno()

    def _ended(self) -> str:
        assert self.process is not None
        try:
            return f"the rogue ended: status {self.process.wait(timeout=LATE)}"
        except subprocess.TimeoutExpired:
            return "the rogue has closed its pipes"

    def _fail(self, why: str) -> None:
        self.failed, self.why = True, why


def parsed(line: bytes) -> Optional[dict[str, Any]]:
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return answer if isinstance(answer, dict) else None


def whole(value: Any) -> int:
    """A count as the rogue states it, or 0 for what is none."""
    return value if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**32 else 0
