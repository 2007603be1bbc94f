#!/usr/bin/env python3
"""The experiment: every attack at every level, in namespaces of its own each, then the costs; a JSON file and a Markdown table.

python3 experiment.py [--runs 3] [--jobs 4] [--levels plain,auth] [--attacks heartbeat] [--cost-runs 3] [--out .build/result]
Exit code: 0, or 1 if a cell is INVALID other than by the attacker's own library.
"""

import argparse
import concurrent.futures
import json
import pathlib
import platform
import random
import subprocess
import sys
import time

import judge
import table
from processes import HERE

LIMIT_S = 90
NAMESPACES = ["unshare", "--user", "--map-root-user", "--net", "--mount"]


def separate(program, *words):
    """The JSON object of a program in namespaces of its own; where there is none, the reason."""
    try:
        done = subprocess.run([*NAMESPACES, sys.executable, program, *words], cwd=HERE, capture_output=True, text=True,
                              timeout=LIMIT_S, check=False)
        return json.loads(done.stdout)
    except (subprocess.TimeoutExpired, json.JSONDecodeError) as error:
        return {"invalid": f"{program}: {type(error).__name__}"}


def attack_once(level, attack, number):
    result = separate("cell.py", level, attack)
    return {"level": level, "attack": attack, "run": number, **result}


def all_runs(options):
    """In a drawn order, so that no level has the quiet or the busy part of the time for itself."""
    expected = judge.expectations()
    jobs = [(level, name, number) for name, attack in expected.items() if name in options.attacks
            for level in options.levels if level in attack for number in range(options.runs)]
    random.Random(1).shuffle(jobs)
    print(f"{len(jobs)} runs, {options.jobs} at a time", flush=True)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = list(pool.map(lambda job: attack_once(*job), jobs))
    return sorted(runs, key=lambda run: (run["attack"], run["level"], run["run"]))


def cost_runs(options):
    """One at a time, the levels in turn."""
    print(f"costs, {options.cost_runs} rounds", flush=True)
    runs = [separate("costs.py", level) for _ in range(options.cost_runs) for level in options.levels]
    return [run for run in runs if "latency_ms" in run]


def parse(words):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    listed = lambda text: text.split(",")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--levels", type=listed, default=list(judge.LEVELS))
    parser.add_argument("--attacks", type=listed, default=list(judge.expectations()))
    parser.add_argument("--cost-runs", type=int, default=3)
    parser.add_argument("--out", type=pathlib.Path, default=HERE / ".build" / "result")
    return parser.parse_args(words)


def main(words):
    options = parse(words)
    start = time.time()
    runs = all_runs(options)
    costs = cost_runs(options)
    result = {
        "date": time.strftime("%Y-%m-%d", time.gmtime(start)), "seconds": round(time.time() - start),
        "machine": platform.machine(), "kernel": platform.release(), "packages": (HERE / "packages.txt").read_text().splitlines(),
        "cells": judge.cells(runs), "costs": judge.costs(costs), "runs": runs,
    }
    options.out.with_suffix(".json").write_text(json.dumps(result, indent=1) + "\n")
    page = table.page(result)
    options.out.with_suffix(".md").write_text(page)
    print(page)
    invalid = [cell for cell in result["cells"] if cell["invalid"] and not table.is_of_own_library(cell)]
    return 1 if invalid else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
