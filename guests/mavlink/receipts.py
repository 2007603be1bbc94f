"""Receipts of attacks: what the relay has sent, against what reached the socket of the end that it was meant for.

The relay's journal has each datagram that it sent, in order, with its digest; the end's records have each datagram that reached its socket, in
order. Both are matched one to one in that order, since the loopback interface keeps it, and so even a replay, whose bytes are those of an
honest datagram, is told from it. No process looks at the content for that.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

from attacks import IN_FORCE, POSITIONS, PROGRAM, TO_PROGRAM, VEHICLE
from holdsafe_guest import Order, Receipt

#: An attack that keeps datagrams back, and one that only listens.
SILENCE, LISTEN = "silence", "listen"
#: Longest reason in a receipt, characters.
MOST = 80


@dataclass
class Arrivals:
    """What one end's witness says of the datagrams of a step: each with its order (0 for an honest one) and its fate."""

    #: (order, accepted, why) of each datagram that reached the socket.
    arrived: list[tuple[int, bool, Optional[str]]] = field(default_factory=list)
    #: Order of the datagram by its number at the end.
    orders: dict[int, int] = field(default_factory=dict)

    def of(self, order: int) -> list[tuple[bool, Optional[str]]]:
        return [(accepted, why) for at, accepted, why in self.arrived if at == order]


class Witness:
    """Matches the journal with the records of one end, step after step."""

    def __init__(self, end: str) -> None:
        self.end = end
        #: Records of the last step that no datagram of the journal matched yet: they came after the relay's report.
        self.kept: list[Any] = []

    def match(self, journal: list[list[Any]], records: list[Any]) -> Arrivals:
        found, waiting = Arrivals(), [*self.kept, *records]
        sent = [(digest, order) for to, digest, order, _ in journal if to == self.end]
        at, last = 0, 0
        places: dict[str, list[int]] = {}
        for index, (digest, _) in enumerate(sent):
            places.setdefault(digest, []).append(index)
        for index, record in enumerate(waiting):
            place = next((place for place in places.get(record.digest, ()) if place >= at), None)
            if place is None:
                continue
            at, last = place + 1, index + 1
            order = sent[place][1]
            found.arrived.append((order, record.accepted, record.why))
            found.orders[record.serial] = order
        # Of the records of the step before, what has no match now is no datagram of the relay.
        self.kept = waiting[max(last, len(self.kept)) :]
        return found


class KernelWitness:
    """The socket of a program that is not ours: the kernel counts what it loses there, and delivers the rest."""

    def __init__(self, port: int) -> None:
        self.port, self.lost = port, drops(port) or 0

    def match(self, journal: list[list[Any]]) -> Arrivals:
        found, now = Arrivals(), drops(self.port)
        sent = [order for to, _, order, _ in journal if to == PROGRAM]
        if now is None:
            return found
        # Which of them are lost the kernel does not say: the attack's, so that a receipt never states too many.
        lost, self.lost = now - self.lost, now
        for order in sorted(sent, reverse=True):
            if lost > 0:
                lost -= 1
            else:
                found.arrived.append((order, True, None))
        return found


def drops(port: int) -> Optional[int]:
    """Datagrams that the socket of a port has lost; None if there is no such socket."""
    for line in Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]:
        fields = line.split()
        if int(fields[1].rpartition(":")[2], 16) == port:
            return int(fields[12])
    return None


class Receipts:
    """The receipts of a trial. `in_force` has the order behind what is in force at the vehicle, by kind."""

    def __init__(self) -> None:
        self.in_force: dict[str, int] = {}
        self.causes: dict[str, int] = {}

    def note(self, arrivals: Arrivals, causes: dict[str, int]) -> None:
        """Takes which datagrams put in force what is so now."""
        for kind, serial in causes.items():
            if self.causes.get(kind) != serial:
                self.causes[kind] = serial
                self.in_force[kind] = arrivals.orders.get(serial, 0)

    def of(self, order: Order, report: dict[str, Any], at: dict[str, Arrivals]) -> Receipt:
        """The receipt of one order of the step."""
        end = PROGRAM if order.attack in TO_PROGRAM else VEHICLE
        honest = len(at[end].of(0))
        if order.attack == LISTEN:
            return Receipt(order.id, sent=0, received=report["passed"], honest=honest, used=False)
        if order.attack == SILENCE:
            return Receipt(order.id, sent=report["dropped"], received=0, honest=honest, used=report["dropped"] > 0, why="kept back")
        sent = sum(1 for _, _, owner, _ in report["journal"] if owner == order.id)
        arrived = at[end].of(order.id)
        why = report["missing"].get(str(order.id)) if sent == 0 else reason(arrived)
        return Receipt(order.id, sent, len(arrived), honest, self.used(order, report), why and why[:MOST])

    def used(self, order: Order, report: dict[str, Any]) -> bool:
        if order.attack in TO_PROGRAM:
            names = {"SYSTEM_TIME", "TIMESYNC"} if order.attack == "clock" else POSITIONS
            owners = [owner for to, _, owner, name in report["journal"] if to == PROGRAM and name in names]
            return owners[-1:] == [order.id]
        return self.in_force.get(IN_FORCE.get(order.attack, "set-point")) == order.id


def reason(arrived: list[tuple[bool, Optional[str]]]) -> Optional[str]:
    """Why none of the datagrams was accepted; None if one was."""
    if not arrived:
        return "not at the socket"
    return None if any(accepted for accepted, _ in arrived) else arrived[0][1]
