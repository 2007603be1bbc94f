#!/usr/bin/env python3
"""An optimizer of nevergrad for `holdsafe search --optimizer` and `lab search --optimizer`.

    pip install nevergrad==1.0.12
    OPTIMIZER=TwoPointsDE holdsafe search nominal --optimizer tools/optimizer/nevergrad_optimizer.py

OPTIMIZER names an entry of nevergrad's registry (default TwoPointsDE). One that takes no points in parallel is asked for one a round. A sequence is a point of the unit cube: for each of its places one
number for the action type, or for no action from the second place on, one for the moment, and one for each number of the action. The loss
falls from 1 for the run without an attack to 0 at the nearest limit of the oracle; a finding has -1, a sequence that did not arrive 2.
"""

import json
import os
import random
import sys

import nevergrad
import numpy

AT_LIMIT = 1_000_000  # an approach in millionths of the way


def place(share, last):
    """The place of a number in its range: `share` of the unit interval."""
    return min(int(share * (last + 1)), last)


class Cube:
    """Points of the unit cube as sequences of the attack space that `begin` states."""

    def __init__(self, begin):
        self.moves = [move["last"] for move in begin["moves"]]
        self.first, self.last = begin["begins"]
        self.longest = begin["longest"]
        self.numbers = max(map(len, self.moves))
        self.width = 2 + self.numbers
        self.dimensions = self.width * self.longest

    def sequence(self, point):
        """The actions of a point."""
        actions = []
        for i in range(self.longest):
            kind, moment, *numbers = point[i * self.width:(i + 1) * self.width]
            # From the second place on, half of the interval is no action.
            kind = kind if i == 0 else 2 * kind - 1
            if kind < 0:
                continue
            move = place(kind, len(self.moves) - 1)
            places = [place(share, last) for share, last in zip(numbers, self.moves[move])]
            actions.append({"move": move, "begins": self.first + place(moment, self.last - self.first), "places": places})
        return actions


def loss(result, nominal):
    """The remaining share of the way to the nearest limit."""
    if result["finding"]:
        return -1.0
    if result["class"] == "INVALID":
        return 2.0
    left = [1.0]
    for limit, way in result["approaches"].items():
        from_ = nominal.get(limit, 0)
        if from_ < AT_LIMIT:
            left.append((AT_LIMIT - way) / (AT_LIMIT - from_))
    return max(0.0, min(left))


def main():
    # Words of the libraries are no answers.
    answers, sys.stdout = sys.stdout, sys.stderr
    begin = json.loads(sys.stdin.readline())
    cube = Cube(begin)
    space = nevergrad.p.Array(shape=(cube.dimensions,), lower=0.0, upper=1.0)
    # Some optimizers draw from the generators of the process.
    seed = begin["seed"] % 2**32
    random.seed(seed)
    numpy.random.seed(seed)
    space.random_state.seed(seed)
    name = os.environ.get("OPTIMIZER", "TwoPointsDE")
    if name not in nevergrad.optimizers.registry:
        sys.exit(f"OPTIMIZER={name}: nevergrad has no such optimizer")
    kind = nevergrad.optimizers.registry[name]
    at_once = 1 if kind.no_parallelization else 16
    optimizer = kind(space, budget=begin["budget"], num_workers=at_once)
    asked = []
    for line in sys.stdin:
        told = json.loads(line)
        for point, result in zip(asked, told["results"]):
            optimizer.tell(point, loss(result, begin["approaches"]))
        if told["most"] == 0:
            return
        asked = [optimizer.ask() for _ in range(min(at_once, told["most"]))]
        print(json.dumps({"sequences": [cube.sequence(point.value) for point in asked]}), file=answers, flush=True)


main()
