"""A flight off board with one attack after another, and the table of many such flights.

    python3 -m tests.mavlink_series --flights 10 [--sign FILE]

The program is `guests/mavlink/programs/offboard.py`, at 0.5 m/s. Each row has the datagrams of all flights.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional

from .mavlink_core import Core, order

MAVLINK = Path(__file__).resolve().parents[2] / "guests/mavlink"
PYTHON = MAVLINK / ".venv/bin/python"
OFF_BOARD = [str(PYTHON), str(MAVLINK / "programs/offboard.py"), "{port}", "0.5"]
#: Time of the vehicle's clock for an act of a program on a loaded machine, s.
PATIENT = 60.0

#: Each attack with its rate and its amount. The last ones end a flight off board.
ATTACKS: list[tuple[str, float, float]] = [
    ("odometry", 20.0, 3.0),
    ("clock", 5.0, 60.0),
    ("take_name", 20.0, 5.0),
    ("replay_odometry", 0.0, 1.0),
    ("flood", 2000.0, 0.0),
    ("parameter", 5.0, 1.5),
    ("route", 2.0, 3.0),
    ("replay_command", 0.0, 1.0),
    ("command", 100.0, -2.0),
    ("rewrite", 0.0, 2.0),
    ("stop", 5.0, 2.0),
]
SECONDS, BETWEEN = 1.5, 0.5


@dataclass
class Seen:
    """One attack's receipts, and the vehicle's state at its end."""

    receipts: list[dict[str, Any]]
    state: str
    east_m: float

    def total(self, name: str) -> int:
        return sum(receipt[name] for receipt in self.receipts)

    def used(self) -> int:
        return sum(receipt["used"] for receipt in self.receipts)

    def refused(self) -> int:
        """Datagrams of steps in which none was accepted."""
        return sum(receipt["received"] for receipt in self.receipts if receipt["why"])

    def reasons(self) -> set[Optional[str]]:
        return {receipt["why"] for receipt in self.receipts if receipt["sent"]}


def attacked(core: Core, id: int, attack: str, rate_hz: float, amount: float, seconds: float = SECONDS) -> Seen:
    """One attack for some time, and a pause."""
    before = core.body.x
    flight = core.fly(seconds, lambda _: {"bus": [order(id, attack, rate_hz, amount)]})
    seen = Seen(flight.receipts(id), flight.replies[-1]["state"], core.body.x - before)
    core.fly(BETWEEN)
    return seen


def guest(program: list[str], *options: str) -> list[str]:
    return [str(PYTHON), str(MAVLINK / "mavlink_guest.py"), *options, "--", *program]


def flown(core: Core) -> dict[str, Seen]:
    """Every attack in one flight, by name."""
    begin(core)
    return {attack: attacked(core, id, attack, rate, amount) for id, (attack, rate, amount) in enumerate(ATTACKS, 1)}


def begin(core: Core) -> None:
    if not core.until_state("OFFBOARD", PATIENT):
        raise TimeoutError("no flight off board")
    # A datagram has to have passed before it is replayed.
    core.fly(1.2)


def row(attack: str, flights: list[dict[str, Seen]]) -> str:
    seen = [flight[attack] for flight in flights]
    total = {name: sum(one.total(name) for one in seen) for name in ("sent", "received", "honest")}
    used, steps = sum(one.used() for one in seen), sum(len(one.receipts) for one in seen)
    reasons = sorted({str(why) for one in seen for why in one.reasons()})
    states = sorted({one.state for one in seen})
    east = sum(one.east_m for one in seen) / len(seen)
    counts = f"{total['sent']:6} {total['received']:6} {sum(one.refused() for one in seen):6} {total['honest']:6} {used:4}/{steps}"
    return f"{attack:16} {counts} {east:6.2f} m {','.join(states):9} {','.join(reasons)}"


def main() -> None:
    parser = argparse.ArgumentParser(description="Attacks on the link of a flight off board.")
    parser.add_argument("--flights", type=int, default=1)
    parser.add_argument("--sign", metavar="FILE", help="sign the link")
    asked = parser.parse_args()
    options = ["--sign", asked.sign] if asked.sign else []
    flights = []
    for _ in range(asked.flights):
        core = Core(guest(OFF_BOARD, *options))
        flights.append(flown(core))
        core.end()
    print("attack             sent  recvd  refusd honest used/steps  east  state  why")
    for attack, _, _ in ATTACKS:
        print(row(attack, flights))


if __name__ == "__main__":
    main()
