#!/usr/bin/env python3
"""Writes a ladder of wrong bounds in one attack space, for `lab search --list`.

The rule was fixed before any search: each of the ten bounds that `misset` knows, in each attack space of an attacker without a key, is wrong by
a quarter, an eighth, a sixteenth, a thirty-second and a sixty-fourth of its value on the ground platform. It is too long; the time of
recovery is too short.

A first search of `processes` (one seed, 1,000 trials) shows that the ladder needs a control: each of its 50 rungs has a finding, 49 of
them by uniform drawing at the same trial, so the finding is not the bound's. What is found with the right bound as well is no weakness
of the list.

    tools/weaknesses/ladder.py path > ladder.toml
    lab search --list ladder.toml --draws 3 --budget 3000
"""

import sys
import tomllib
from pathlib import Path

BOUNDS = [
    "freshness_ms", "lease_ms", "product_limit_ms", "unrecovered_ms", "track_limit_ms", "command_limit_ms", "authority_ms",
    "hysteresis_ms", "set_point_lease_ms", "seal_limit_ms",
]
PARTS = [4, 8, 16, 32, 64]
SPACES = ["path", "sensors", "processes"]


def main() -> None:
    """Prints the ladder of one attack space."""
    if len(sys.argv) != 2 or sys.argv[1] not in SPACES:
        sys.exit(f"usage: {sys.argv[0]} {'|'.join(SPACES)}")
    space = sys.argv[1]
    platform = Path(__file__).resolve().parents[2] / "platforms/ground.toml"
    right = tomllib.loads(platform.read_text())["bounds"]
    for bound in BOUNDS:
        for part in PARTS:
            by = max(1, round(right[bound] / part))
            wrong = right[bound] - by if bound == "hysteresis_ms" else right[bound] + by
            print("[[weakness]]")
            print(f'name = "{bound.removesuffix("_ms").replace("_", "-")}-{part}-{space}"')
            print(f'scenario = "nominal"\nalphabet = "{space}"')
            print(f'misset = {{ bound = "{bound}", to_ms = {wrong} }}\nfind = ["UNSAFE", "LATE"]\n')


main()
