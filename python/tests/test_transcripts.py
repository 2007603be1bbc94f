"""Recorded exchanges: the follower in Python, C++ and Rust answers each request as recorded.

The programs in C++ and Rust are taken where they have been built: `make -C cpp`, `cargo build -p guest-client --example follower`.
"""

import json
import math
import os
import shutil
import sys
import unittest
from pathlib import Path
from typing import Any

from .driver import Process

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
FOLLOWERS = {
    "python": [sys.executable, str(ROOT / "guests/follower/follower.py")],
    "c++": [str(ROOT / "cpp/build/follower")],
    "rust": [str(TARGET / "debug/examples/follower")],
}


def pairs(path: Path) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    return list(zip(lines[::2], lines[1::2]))


def alike(a: Any, b: Any) -> bool:
    """Equal, numbers to a billionth: compilers may round otherwise."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, float) or isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-9, abs_tol=1e-9)
    return bool(a == b)


class Transcripts(unittest.TestCase):
    def replay(self, language: str) -> None:
        command = FOLLOWERS[language]
        if shutil.which(command[0]) is None:
            self.skipTest(f"{command[0]} has not been built")
        paths = sorted((ROOT / "guests/transcripts").glob("follower-*.jsonl"))
        self.assertGreaterEqual(len(paths), 3)
        for path in paths:
            guest = Process(command)
            for number, (request, recorded) in enumerate(pairs(path)):
                answer = guest.ask(request)
                self.assertTrue(alike(answer, recorded), f"{path.name}, pair {number}: {recorded} expected, got {answer}")
            self.assertEqual(guest.end(), 0)

    def test_the_python_follower_answers_as_recorded(self) -> None:
        self.replay("python")

    def test_the_cpp_follower_answers_as_recorded(self) -> None:
        self.replay("c++")

    def test_the_rust_follower_answers_as_recorded(self) -> None:
        self.replay("rust")


if __name__ == "__main__":
    unittest.main()
