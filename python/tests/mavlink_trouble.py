"""Honest trouble on a signed MAVLink link: flights in which nobody attacks, and the table of what each end does.

    python3 -m tests.mavlink_trouble --flights 5 [--jobs 3] [--only NAME,NAME] [--json]

The rows are those of `mavlink_trouble.toml`, with the result expected of each. A flight has a second of sound flight, the trouble,
and the time after its end. With `at_contact` the trouble is there from the first datagram on.
"""

import argparse
import json
import statistics
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Iterator, Optional

from .mavlink_core import PERIOD, Core
from .mavlink_series import MAVLINK, PATIENT, PYTHON

HERE = Path(__file__).resolve().parent
ROWS = HERE / "mavlink_trouble.toml"
#: Length of the trouble, and of the watch after it, s.
SECONDS, AFTER = 6.0, 6.0
#: Datagrams on their way when the trouble begins are not counted, s.
ON_THE_WAY = 0.1
#: A silence that counts as one, s: longer than the pauses of either sender in flight.
SILENCE = 1.5
#: Programs by name: the command behind the program's end.
PROGRAMS = {
    "mavsdk": [str(PYTHON), str(HERE / "mavlink_watcher.py"), "{inner}"],
    "mavproxy": [
        str(PYTHON), str(MAVLINK / "programs/mavproxy_script.py"), "{inner}", "{folder}", str(MAVLINK / "programs/mission.scr"),
    ],
}  # fmt: skip

#: Names of the words of a summary, in the order of the expected ones.
WORDS = ("vehicle", "program", "ends", "told", "back")
#: Words by which MAVProxy says that it has found the vehicle, and that it has lost it.
FOUND, LOST = ("online system", "heartbeat OK", "Ready to arm"), ("no link", "link 1 down")

Row = dict[str, Any]
Line = dict[str, Any]


def rows() -> list[Row]:
    import tomllib  # of Python 3.11

    given = tomllib.loads(ROWS.read_text(encoding="utf-8"))["row"]
    defaults = {"end": {}, "vehicle": {}, "at_contact": False, "program": "mavsdk", "seconds": SECONDS}
    return [
        {**defaults, **row, "ardupilot": row.get("program") == "mavproxy", "expected": dict(zip(WORDS, row["expected"].split()))}
        for row in given
    ]


@dataclass
class Side:
    """An end in the trouble: accepted datagrams of those that came, its longest silence, and its return after the trouble."""

    came: int
    accepted: int
    #: Longest time in the trouble without an accepted datagram, s.
    silence_s: float
    #: Time after the trouble until a datagram is accepted, s; None if none was.
    back_s: Optional[float]


@dataclass
class Seen:
    """What one flight shows."""

    vehicle: Side
    program: Side
    #: Datagrams that the program's end sent in the trouble.
    sent: int
    #: Times from the begin of the trouble, s; None for never.
    failsafe_s: Optional[float] = None
    lost_s: Optional[float] = None
    #: Time from the end of the trouble until the vehicle flies by the program for half a second without a break, s.
    flies_s: Optional[float] = None
    #: True once the program has found the vehicle, before the end of the trouble.
    found: bool = False
    #: Results of the program's calls that began in the trouble, with their number.
    calls: dict[str, int] = field(default_factory=dict)
    #: Lines of a program that are no JSON, with their time.
    said: list[tuple[float, str]] = field(default_factory=list)

    def summary(self) -> dict[str, str]:
        """The words of the expected table."""
        return {
            "vehicle": heard(self.vehicle),
            "program": heard(self.program),
            "ends": "failsafe" if self.failsafe_s is not None else "flies" if self.flies_s is not None else "grounded",
            "told": "lost" if self.lost_s is not None else "no" if self.found else "unseen",
            "back": "yes" if self.flies_s is not None else "no",
        }


def heard(side: Side) -> str:
    if side.came == 0:
        return "nothing"
    if side.accepted == 0:
        return "none"
    if side.silence_s > SILENCE:
        return "few"
    return "all" if side.accepted == side.came else "most" if side.accepted >= side.came / 2 else "some"


def flown(row: Row, seed: int) -> Seen:
    """One flight."""
    with tempfile.TemporaryDirectory(prefix="mavlink-trouble-") as folder:
        ready = row["seconds"] + 30.0
        (Path(folder) / "row.json").write_text(json.dumps({**row, "seed": seed, "ready_s": ready}), encoding="utf-8")
        end = [str(PYTHON), str(HERE / "mavlink_troubled_end.py"), folder, "{port}", "--", *PROGRAMS[row["program"]]]
        core: Optional[Core] = None
        try:
            core = Core([str(PYTHON), str(HERE / "mavlink_troubled_vehicle.py"), folder, "--", *end], route=[[40.0, 0.0]])
            watched(core, Path(folder), row["seconds"])
        except EOFError as error:
            if "no message of" not in str(error):
                raise
        finally:
            if core is not None:
                core.end_if_there()
        return seen_in(row, lines(folder, "vehicle"), lines(folder, "end"))


def watched(core: Core, folder: Path, row_s: float) -> None:
    """Steps until the time after the trouble is over at both ends."""
    limit = round((PATIENT + row_s + AFTER) / PERIOD)
    left = round(AFTER / PERIOD)
    for step in range(limit):
        core.step()
        # The logs are read once a second.
        if step % 20 == 0 and all_over(folder):
            core.fly(left * PERIOD)
            return


def all_over(folder: Path) -> bool:
    return all(any(line.get("phase") == "after" for line in lines(folder, end)) for end in ("vehicle", "end"))


def lines(folder: "str | Path", name: str) -> list[Line]:
    path = Path(folder) / f"{name}.log"
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]


def moment(phase: str, row: Row, logs: dict[str, list[Line]]) -> float:
    """The time at which the trouble begins or ends: at the side that has it; for want of one, at the program's end."""
    sides = [side for side in ("end", "vehicle") if phase in row[side]] or ["end"]
    times = [line["at_s"] for side in sides for line in logs[side] if line.get("phase") == phase]
    if not times:
        raise ValueError(f"{row['name']}: no phase {phase}")
    return max(times)


def seen_in(row: Row, vehicle: list[Line], end: list[Line]) -> Seen:
    logs = {"vehicle": vehicle, "end": end}
    begun, over = moment("during", row, logs), moment("after", row, logs)
    seen = Seen(
        side([(line["at_s"], line["accepted"]) for line in vehicle if "accepted" in line], begun, over),
        side([(line["at_s"], line["came"]) for line in end if "came" in line], begun, over),
        sum(1 for line in end if "sent" in line and begun + ON_THE_WAY <= line["at_s"] < over),
    )
    states = [(line["at_s"], line["state"]) for line in vehicle if "state" in line]
    seen.failsafe_s = first(at - begun for at, state in states if state == "FAILSAFE" and begun <= at)
    seen.flies_s = flies_again(states, over)
    spoken = [(line["at_s"], line["said"]) for line in end if "said" in line]
    for at, text in spoken:
        note(seen, at, text, begun, over)
    return seen


def note(seen: Seen, at: float, text: str, begun: float, over: float) -> None:
    """Takes a line of the program."""
    try:
        line = json.loads(text)
    except ValueError:
        line = None
    if not isinstance(line, dict):
        seen.said.append((round(at - begun, 2), text))
        seen.found |= at < over and any(word in text for word in FOUND)
        if seen.lost_s is None and at >= begun and any(word in text for word in LOST):
            seen.lost_s = at - begun
    elif "found" in line:
        seen.found = at < over
    elif line.get("connected") is False and at >= begun and seen.lost_s is None:
        seen.lost_s = at - begun
    elif "call" in line and begun + ON_THE_WAY <= at < over:
        name = f"{line['call']} {line['result']}"
        seen.calls[name] = seen.calls.get(name, 0) + 1


def side(came: list[tuple[float, bool]], begun: float, over: float) -> Side:
    inside = [(at, accepted) for at, accepted in came if begun + ON_THE_WAY <= at < over]
    times = [begun, *(at for at, accepted in inside if accepted), over]
    silence = max(later - earlier for earlier, later in zip(times, times[1:]))
    back = first(at - over for at, accepted in came if accepted and at >= over)
    return Side(len(inside), sum(accepted for _, accepted in inside), silence, back)


def flies_again(states: list[tuple[float, str]], over: float) -> Optional[float]:
    """Time from the end of the trouble until ten steps in a row by the program."""
    after = [(at, state in ("OFFBOARD", "MISSION")) for at, state in states if at >= over]
    return first(after[at][0] - over for at in range(len(after) - 9) if all(flies for _, flies in after[at : at + 10]))


def first(values: Iterator[float]) -> Optional[float]:
    return next(values, None)


def spread(values: list[Optional[float]]) -> str:
    """Median and range of those that are there, and their number where some are not."""
    there = [value for value in values if value is not None]
    if not there:
        return "-"
    count = f" ({len(there)}/{len(values)})" if len(there) < len(values) else ""
    return f"{statistics.median(there):.1f} [{min(there):.1f}-{max(there):.1f}]{count}"


def cells(row: Row, flights: list[Seen]) -> dict[str, Any]:
    """The row of the table."""
    found: dict[str, set[str]] = {name: {flight.summary()[name] for flight in flights} for name in flights[0].summary()}
    calls: dict[str, int] = {}
    for flight in flights:
        for name, count in flight.calls.items():
            calls[name] = calls.get(name, 0) + count
    return {
        "name": row["name"],
        "flights": len(flights),
        "vehicle": f"{sum(f.vehicle.accepted for f in flights)}/{sum(f.vehicle.came for f in flights)}",
        "program": f"{sum(f.program.accepted for f in flights)}/{sum(f.program.came for f in flights)}",
        "sent": sum(f.sent for f in flights),
        "silence": f"{spread([f.vehicle.silence_s for f in flights])} / {spread([f.program.silence_s for f in flights])}",
        "failsafe": spread([f.failsafe_s for f in flights]),
        "lost": spread([f.lost_s for f in flights]),
        "back": f"{spread([f.vehicle.back_s for f in flights])} / {spread([f.program.back_s for f in flights])}",
        "flies": spread([f.flies_s for f in flights]),
        "calls": calls,
        "said": flights[0].said,
        "each": [vars(flight) | {"vehicle": vars(flight.vehicle), "program": vars(flight.program)} for flight in flights],
        "found": {name: sorted(words) for name, words in found.items()},
        "unexpected": {
            name: sorted(words) for name, words in found.items() if words != {row["expected"][name]}
        },
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Honest trouble on a signed MAVLink link.")
    parser.add_argument("--flights", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="flights at once")
    parser.add_argument("--only", default="", help="names of rows, by commas")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    names = set(filter(None, asked.only.split(",")))
    chosen = [row for row in rows() if not names or row["name"] in names]
    with ThreadPoolExecutor(asked.jobs) as pool:
        flights = [[pool.submit(flown, row, seed) for seed in range(1, asked.flights + 1)] for row in chosen]
        for row, waiting in zip(chosen, flights):
            valid = [flight.result() for flight in waiting if flight.exception() is None]
            for flight in waiting:
                if error := flight.exception():
                    print(f"{row['name']}: a flight is not counted: {error!r}", file=sys.stderr)
            if valid:
                made = cells(row, valid)
                print(json.dumps(made) if asked.json else text(made), flush=True)


def text(made: dict[str, Any]) -> str:
    parts = [f"{name} {made[name]}" for name in ("vehicle", "program", "silence", "failsafe", "lost", "back", "flies")]
    end = f"  UNEXPECTED {made['unexpected']}" if made["unexpected"] else ""
    return f"{made['name']:28} n {made['flights']} | " + " | ".join(parts) + f" | {made['calls']}{end}"


if __name__ == "__main__":
    sys.exit(main())
