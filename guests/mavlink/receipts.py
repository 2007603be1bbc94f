"""Receipts of attacks: datagrams that the relay has sent, against those that reached the socket of their end.

The relay's journal has each datagram that it sent, in order, with its digest; the end's records have each datagram that reached its
socket, in order. Both are matched one to one in that order, since the loopback interface keeps it, and so even a replay, whose bytes
are those of an honest datagram, is told from it. No process looks at the content for that.
"""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

from holdsafe_guest import Order, Receipt

#: The ends of the link.
VEHICLE, PROGRAM = "vehicle", "program"
SET_POINT = "set-point"
#: Kinds of message that an attack puts in force at the vehicle or at the program.
IN_FORCE = {
    "command": (SET_POINT,),
    "rewrite": (SET_POINT,),
    "stop": ("command",),
    "route": ("mission",),
    "parameter": ("parameter",),
    "replay_command": (SET_POINT, "command", "mission", "parameter"),
    "odometry": ("position",),
    "take_name": ("position",),
    "replay_odometry": ("position",),
    "clock": ("clock",),
}
TO_PROGRAM = {"odometry", "clock", "replay_odometry", "take_name"}
KINDS_OF_TELEMETRY = {"GLOBAL_POSITION_INT": "position", "LOCAL_POSITION_NED": "position", "SYSTEM_TIME": "clock", "TIMESYNC": "clock"}
#: An attack that keeps datagrams back, and one that only listens.
SILENCE, LISTEN = "silence", "listen"
#: Longest reason in a receipt, characters.
MOST = 80


@dataclass
class Arrivals:
    """Datagrams of a step at one end, by its witness."""

    arrived: list["Arrival"] = field(default_factory=list)
    #: Order of the datagram by its number at the end.
    orders: dict[int, int] = field(default_factory=dict)

    def of(self, order: int) -> list["Arrival"]:
        return [arrival for arrival in self.arrived if arrival.order == order]


@dataclass(frozen=True)
class Arrival:
    """One datagram at the socket of its end."""

    #: 0 for an honest one.
    order: int
    #: Type of its message.
    name: str
    accepted: bool
    #: The reason for which none of its messages was accepted.
    why: Optional[str]


class Witness:
    """Matches the journal with the records of one end, step after step."""

    def __init__(self, end: str) -> None:
        self.end = end
        #: Records of the last step that no datagram of the journal matched yet: they came after the relay's report.
        self.kept: list[Any] = []

    def match(self, journal: list[list[Any]], records: list[Any]) -> Arrivals:
        found, waiting = Arrivals(), [*self.kept, *records]
        sent = [(digest, order, name) for to, digest, order, name in journal if to == self.end]
        at, last = 0, 0
        places: dict[str, list[int]] = {}
        for index, (digest, *_) in enumerate(sent):
            places.setdefault(digest, []).append(index)
        for index, record in enumerate(waiting):
            place = next((place for place in places.get(record.digest, ()) if place >= at), None)
            if place is None:
                continue
            at, last = place + 1, index + 1
            _, order, name = sent[place]
            found.arrived.append(Arrival(order, name, record.accepted, record.why))
            found.orders[record.serial] = order
        # A record of the step before that has no match now is no datagram of the relay.
        self.kept = waiting[max(last, len(self.kept)) :]
        return found


class KernelWitness:
    """The socket of a program that is not ours: the kernel counts the datagrams that it loses there, and delivers the rest."""

    def __init__(self, port: int, signed: bool = False) -> None:
        self.port, self.lost, self.noted = port, 0, False
        #: A program that checks signatures by itself may refuse a datagram, which the kernel does not see: none counts as accepted then.
        self.accepts = not signed

    def note(self, words: str) -> None:
        if not self.noted:
            print(f"mavlink: {words}", file=sys.stderr)
        self.noted = True

    def match(self, journal: list[list[Any]]) -> Arrivals:
        found = Arrivals()
        try:
            now = drops(self.port)
        except OSError:
            # Without a witness no datagram counts as received, so a trial has no receipt and is INVALID.
            self.note("no witness at the program: /proc/net/udp cannot be read")
            return found
        if now is None:
            return found
        # Which of them are lost the kernel does not say: the attack's, so that a receipt never states too many.
        lost, self.lost = now - self.lost, now
        for to, _, order, name in journal:
            if to == PROGRAM and order and lost > 0:
                lost -= 1
            elif to == PROGRAM:
                found.arrived.append(Arrival(order, name, self.accepts, None))
        return found


def drops(port: int) -> Optional[int]:
    """Datagrams that the socket of a port has lost; None if there is no such socket."""
    for line in Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]:
        fields = line.split()
        if int(fields[1].rpartition(":")[2], 16) == port:
            return int(fields[12])
    return None


class Receipts:
    """The receipts of a trial. `in_force` has the order behind what is in force at either end, by kind."""

    def __init__(self) -> None:
        self.in_force: dict[str, int] = {}
        self.causes: dict[str, int] = {}
        #: True while the vehicle follows set-points: in another mode none is in force.
        self.follows = False

    def note(self, at: dict[str, Arrivals], causes: dict[str, int], follows: bool) -> None:
        """Takes the order behind each kind in force: at the vehicle by the causes, at the program by the last accepted one."""
        self.follows = follows
        for kind, serial in causes.items():
            if self.causes.get(kind) != serial:
                self.causes[kind] = serial
                self.in_force[kind] = at[VEHICLE].orders.get(serial, 0)
        for arrival in at[PROGRAM].arrived:
            if arrival.accepted and arrival.name in KINDS_OF_TELEMETRY:
                self.in_force[KINDS_OF_TELEMETRY[arrival.name]] = arrival.order

    def of(self, order: Order, report: dict[str, Any], at: dict[str, Arrivals]) -> Receipt:
        """The receipt of one order of the step."""
        end = PROGRAM if order.attack in TO_PROGRAM else VEHICLE
        honest = len(at[end].of(0))
        if order.attack == LISTEN:
            return Receipt(order.id, sent=report["passed"], received=report["passed"], honest=honest, used=False)
        if order.attack == SILENCE:
            # Its act is to keep datagrams back, in force for as long as it lasts.
            return Receipt(order.id, sent=report["dropped"], received=0, honest=honest, used=True, why="kept back")
        sent = sum(1 for _, _, owner, _ in report["journal"] if owner == order.id)
        arrived = at[end].of(order.id)
        why = report["missing"].get(str(order.id)) if sent == 0 else reason(arrived)
        return Receipt(order.id, sent, len(arrived), honest, self.used(order), why and why[:MOST])

    def used(self, order: Order) -> bool:
        kinds = [kind for kind in IN_FORCE.get(order.attack, ()) if kind != SET_POINT or self.follows]
        return order.id in {self.in_force.get(kind) for kind in kinds}


def reason(arrived: list[Arrival]) -> Optional[str]:
    """The reason for which the end refused all datagrams; None if it accepted one, or got none."""
    return None if not arrived or any(arrival.accepted for arrival in arrived) else arrived[0].why
