"""Receipts of attacks on a MAVLink link: the relay's journal against the datagrams at the end's socket."""

import contextlib
import socket
import sys
import unittest
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "guests/mavlink"))

from holdsafe_guest import Order
from receipts import PROGRAM, VEHICLE, KernelWitness, Receipts, Witness


@dataclass(frozen=True)
class Reached:
    serial: int
    digest: str
    accepted: bool = True
    why: Optional[str] = None


def sent(*datagrams: tuple[str, int], to: str = VEHICLE) -> list[list[Any]]:
    return [[to, digest, order, "COMMAND_LONG"] for digest, order in datagrams]


def orders(arrivals: Any) -> list[int]:
    return [arrival.order for arrival in arrivals.arrived]


class Witnesses(unittest.TestCase):
    def test_a_replay_is_told_from_the_same_bytes(self) -> None:
        witness = Witness(VEHICLE)
        reached = [Reached(1, "a"), Reached(2, "b"), Reached(3, "a")]
        self.assertEqual(orders(witness.match(sent(("a", 0), ("b", 0), ("a", 7)), reached)), [0, 0, 7])

    def test_a_lost_datagram_moves_no_other(self) -> None:
        witness = Witness(VEHICLE)
        reached = [Reached(1, "a"), Reached(2, "c")]
        self.assertEqual(orders(witness.match(sent(("a", 0), ("b", 7), ("c", 7)), reached)), [0, 7])

    def test_a_datagram_of_a_third_process_belongs_to_no_order(self) -> None:
        witness = Witness(VEHICLE)
        self.assertEqual(orders(witness.match(sent(("a", 7)), [Reached(1, "x"), Reached(2, "a")])), [7])

    def test_one_after_the_report_counts_in_the_next_step(self) -> None:
        witness = Witness(VEHICLE)
        self.assertEqual(orders(witness.match(sent(("a", 7)), [Reached(1, "a"), Reached(2, "b")])), [7])
        self.assertEqual(orders(witness.match(sent(("b", 7)), [])), [7])
        # Not in the one after that: a stranger's is forgotten.
        witness.match([], [Reached(3, "c")])
        witness.match([], [])
        self.assertEqual(orders(witness.match(sent(("c", 7)), [])), [])

    def test_a_receipt_says_why_none_is_accepted(self) -> None:
        order = Order(7, "command", 20.0, 1.0)
        journal = sent(("a", 0), ("b", 7), ("c", 7))
        for accepted, why in ((True, None), (False, "signature")):
            witness, receipts = Witness(VEHICLE), Receipts()
            at = {
                VEHICLE: witness.match(journal, [Reached(1, "a"), Reached(2, "b", accepted, why), Reached(3, "c", accepted, why)]),
                PROGRAM: Witness(PROGRAM).match([], []),
            }
            receipts.note(at, {"set-point": 3 if accepted else 1}, follows=True)
            report = {"journal": journal, "passed": 1, "dropped": 0, "missing": {}}
            receipt = receipts.of(order, report, at)
            self.assertEqual((receipt.sent, receipt.received, receipt.honest), (2, 2, 1))
            self.assertEqual((receipt.used, receipt.why), (accepted, why))

    def test_the_kernel_does_not_know_who_checks_signatures(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            end.bind(("127.0.0.1", 0))
            for signed in (False, True):
                arrived = KernelWitness(end.getsockname()[1], signed).match(sent(("a", 7), to=PROGRAM)).arrived
                self.assertEqual([arrival.accepted for arrival in arrived], [not signed])

    def test_a_full_socket_costs_the_attacker(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as end:
            end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            end.bind(("127.0.0.1", 0))
            journal = sent(("h", 0), *[("a", 7)] * 200, to=PROGRAM)
            for _ in journal:
                end.sendto(bytes(200), end.getsockname())
            arrived = KernelWitness(end.getsockname()[1]).match(journal)
            end.setblocking(False)
            there = 0
            with contextlib.suppress(BlockingIOError):
                while end.recv(4096):
                    there += 1
            self.assertEqual(len(arrived.arrived), there)
            self.assertEqual(len(arrived.of(0)), 1)

    def test_a_set_point_is_in_force_only_where_it_is_followed(self) -> None:
        receipts, order = Receipts(), Order(7, "command", 20.0, 1.0)
        at = {VEHICLE: Witness(VEHICLE).match(sent(("b", 7)), [Reached(1, "b")]), PROGRAM: Witness(PROGRAM).match([], [])}
        for follows in (False, True):
            receipts.note(at, {"set-point": 1}, follows)
            self.assertEqual(receipts.used(order), follows)


if __name__ == "__main__":
    unittest.main()
