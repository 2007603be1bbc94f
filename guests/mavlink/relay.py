"""A relay between a vehicle and a program, a process of its own without the link's key: it passes datagrams on, and attacks when told to.

    relay.py --vehicle PORT --program PORT [--factor F]

It has one port a side, so that neither end sees a second one. A stranger's datagrams come from a third port. The first line that it
writes has the ports of its sides. A line on standard input, {"orders": [{"id", "attack", "rate_hz", "amount"}]}, has the attacks that
are open from now on; the answer is a line with all that has been sent since the last one. The messages are left to `attacks`.
"""

import argparse
import json
import os
import select
import sys
import time
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

from attacks import Datagram, Forger, Heard
from link import BATCH, LOOPBACK, digest, open_socket, parsed, parser, port_of
from receipts import PROGRAM, VEHICLE

#: Longest wait, s, and the longest time that an attack catches up on, s.
WAIT, BEHIND = 0.05, 1.0
#: Datagrams of one attack between two looks at the sockets: a flood must not keep back honest datagrams.
AT_ONCE = 200
OTHER = {VEHICLE: PROGRAM, PROGRAM: VEHICLE}
#: Attacks whose sender is no end of the link, but has a port of its own.
STRANGERS = {"parameter", "flood", "take_name"}


class Open:
    """An order that is open."""

    def __init__(self, order: dict[str, Any], heard: Heard, now_s: float, factor: float) -> None:
        self.id, self.attack = order["id"], order["attack"]
        rate = order["rate_hz"] * factor
        #: Real time from one to the next; without an end where there is only one.
        self.period = 1.0 / rate if rate > 0.0 else float("inf")
        age = self.attack.startswith("replay")
        self.forger = Forger(self.attack, order["amount"] / factor if age else order["amount"], heard)
        self.due_s = self.since_s = now_s

    def datagrams(self, now_s: float) -> list[bytes]:
        """Datagrams that are due."""
        made = list(self.forger.replayed(self.since_s, now_s))
        self.since_s = now_s
        self.due_s = max(self.due_s, now_s - BEHIND)
        while self.due_s <= now_s and len(made) < AT_ONCE:
            self.due_s += self.period
            made += self.forger.once(now_s)
        return made


class Relay:
    """The sockets, the open orders and the journal of sent datagrams."""

    def __init__(self, vehicle: int, program: int, factor: float) -> None:
        self.sides = {VEHICLE: open_socket(), PROGRAM: open_socket()}
        self.stranger = open_socket()
        self.ports, self.factor = {VEHICLE: vehicle, PROGRAM: program}, factor
        self.heard, self.parser = Heard(), parser(255, 0)
        self.orders: dict[int, Open] = {}
        #: Receiver, digest, order (0 for an honest datagram) and type of each datagram sent.
        self.journal: list[tuple[str, str, int, str]] = []
        self.passed = self.dropped = self.returned = 0

    def serve(self) -> None:
        """Until the end of standard input."""
        pending = b""
        ends = [*self.sides.values(), self.stranger]
        while True:
            ready, _, _ = select.select([sys.stdin, *ends], [], [], self.wait())
            # Orders first: a datagram that passes after they are open is under attack.
            if sys.stdin in ready:
                read = os.read(0, 65536)
                if not read:
                    return
                *lines, pending = (pending + read).split(b"\n")
                for line in lines:
                    self.pass_all()
                    self.attack()
                    self.take_orders(json.loads(line)["orders"])
                    print(json.dumps(self.report()), flush=True)
            self.pass_all()
            self.attack()

    def wait(self) -> float:
        due = min((order.due_s for order in self.orders.values()), default=float("inf"))
        replays = any(order.attack.startswith("replay") for order in self.orders.values())
        return min(max(due - time.monotonic(), 0.0), 0.005 if replays else WAIT)

    def take_orders(self, orders: list[dict[str, Any]]) -> None:
        now = time.monotonic()
        self.orders = {
            order["id"]: self.orders.get(order["id"]) or Open(order, self.heard, now, self.factor) for order in orders
        }

    def report(self) -> dict[str, Any]:
        """Datagrams sent, kept back and received since the last report."""
        missing = {str(id): why for id, order in self.orders.items() if (why := order.forger.missing())}
        report = {
            "journal": self.journal,
            "passed": self.passed,
            "dropped": self.dropped,
            "returned": self.returned,
            "missing": missing,
        }
        self.journal, self.passed, self.dropped, self.returned = [], 0, 0, 0
        return report

    def pass_all(self) -> None:
        for side, end in self.sides.items():
            for data in datagrams(end):
                self.passed += 1
                self.pass_on(Datagram(time.monotonic(), side, data, parsed(self.parser, data)[0]))
        self.returned += sum(1 for _ in datagrams(self.stranger))

    def pass_on(self, datagram: Datagram) -> None:
        """Passes a datagram to the other end, unless an open attack does something else with it."""
        self.heard.take(datagram)
        name = datagram.messages[0].get_type() if datagram.messages else ""
        for order in self.orders.values():
            if order.attack == "silence":
                self.dropped += 1
                return
            if datagram.sender == PROGRAM and order.attack == "rewrite":
                rewritten = order.forger.rewritten(datagram)
                if rewritten is not None:
                    return self.send(VEHICLE, rewritten, order.id, name)
            if datagram.sender == VEHICLE and order.attack == "route" and datagram.messages:
                answers = order.forger.answers(datagram.messages[0])
                if answers is not None:
                    for answer in answers:
                        self.send(VEHICLE, answer, order.id, "MISSION_ITEM_INT")
                    return
        self.send(OTHER[datagram.sender], datagram.data, 0, name)

    def attack(self) -> None:
        now = time.monotonic()
        for order in self.orders.values():
            for data in order.datagrams(now):
                self.send(order.forger.to, data, order.id, name_of(data), order.attack in STRANGERS)

    def send(self, to: str, data: bytes, order: int, name: str, stranger: bool = False) -> None:
        end = self.stranger if stranger else self.sides[to]
        try:
            end.sendto(data, (LOOPBACK, self.ports[to]))
        except OSError:
            # No socket is there, or its buffer is full: the datagram counts as sent, and the witness does not see it.
            pass
        self.journal.append((to, digest(data), order, name))


def datagrams(end: Any) -> "list[bytes]":
    found = []
    for _ in range(BATCH):
        try:
            found.append(end.recv(65536))
        except BlockingIOError:
            break
        except OSError:
            # The answer of the kernel to a datagram for a port without a socket.
            continue
    return found


def name_of(data: bytes) -> str:
    messages, _ = parsed(NAMES, data)
    return str(messages[0].get_type()) if messages else ""


#: A parser for names alone.
NAMES = parser(255, 0)


def main(arguments: Optional[list[str]] = None) -> None:
    asked = argparse.ArgumentParser(description="A relay that attacks a MAVLink link when told to.")
    asked.add_argument("--vehicle", type=int, required=True, metavar="PORT", help="port of the vehicle")
    asked.add_argument("--program", type=int, required=True, metavar="PORT", help="port of the program")
    asked.add_argument("--factor", type=float, default=1.0, help="seconds of the vehicle's clock in one of real time")
    given = asked.parse_args(arguments)
    relay = Relay(given.vehicle, given.program, given.factor)
    print(json.dumps({side: port_of(end) for side, end in relay.sides.items()}), flush=True)
    relay.serve()


if __name__ == "__main__":
    main()
