"""Values of the crate, by its example."""

import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def trace(what):
    command = ["cargo", "run", "--quiet", "--release", "-p", "spacecraft", "--example", "trace", "--", what]
    return json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
