"""The graph under attack, where guests/ros2 is installed: receipts of each attack, and a rogue that fails.

Messages are counted by a witness in the bridge, so a receipt is not the rogue's own word: the tests of a rogue that lies show it.
"""

import tempfile
import unittest
from pathlib import Path
from typing import Any, Optional

from .driver import PERIOD, Drive, Process, drive
from .test_ros2 import NODES, PATIENT, PYTHON, ROS2, guest, node

TUTORIAL = [str(PYTHON), str(ROS2 / "pure_pursuit_node.py"), "--ros-args", "-p", "use_sim_time:=true"]
#: Time of the attack's begin, s, and the number of its first step.
BEGIN, FIRST = 1.0, 21

Receipt = dict[str, Any]

#: The beginning of a rogue of the tests: a participant that has answered its start.
PARTICIPANT = f"""
import json, sys
sys.path.insert(0, {str(ROS2)!r})
from participant import Odometry, Rogue

def answer(content, request):
    print(json.dumps({{"number": request["number"], **content}}), flush=True)

request = json.loads(sys.stdin.readline())
rogue = Rogue(request["start"])
answer({{}}, request)
"""


def order(attack: str, rate_hz: float = 100.0, amount: float = 3.0) -> list[dict[str, Any]]:
    return [{"id": 1, "attack": attack, "rate_hz": rate_hz, "amount": amount}]


def receipts(done: Drive) -> list[Receipt]:
    return [receipt for _, answer in done.exchanges[1:] for receipt in answer["reply"].get("bus", [])]


def total(done: Drive, name: str) -> int:
    return sum(receipt[name] for receipt in receipts(done))


def states(done: Drive) -> set[str]:
    return {answer["reply"]["state"] for _, answer in done.exchanges[FIRST:]}


@unittest.skipUnless(PYTHON.exists(), "ROS 2 is not installed: make -C guests/ros2")
class Graph(unittest.TestCase):
    def attacked(self, orders: list[dict[str, Any]], *options: str, command: Optional[list[str]] = None, seconds: float = 2.0) -> Drive:
        process = Process(guest(command or TUTORIAL, *PATIENT, *options))
        try:
            return drive(process, "corner", seconds, at=BEGIN, bus=orders)
        finally:
            self.assertEqual(process.end(), 0)


class Attacks(Graph):
    process: Process

    @classmethod
    def setUpClass(cls) -> None:
        if PYTHON.exists():
            cls.process = Process(guest(TUTORIAL, "--rogue", "--answer-ms", "500"))

    @classmethod
    def tearDownClass(cls) -> None:
        if PYTHON.exists():
            cls.process.end()

    def trial(self, attack: str, rate_hz: float = 100.0, amount: float = 3.0, seconds: float = 2.0) -> Drive:
        """One of many trials in one process."""
        return drive(self.process, "corner", seconds, at=BEGIN, bus=order(attack, rate_hz, amount))

    def received(self, done: Drive, sent: int) -> None:
        self.assertEqual({receipt["why"] for receipt in receipts(done)}, {None})
        self.assertEqual((total(done, "sent"), total(done, "received")), (sent, sent))

    def test_without_an_order_there_is_no_receipt(self) -> None:
        done = drive(self.process, "corner", 2.0, bus=[])
        self.assertEqual(receipts(done), [])
        self.assertAlmostEqual(done.truth[-1].y, 0.0)

    def test_a_forged_pose_turns_the_vehicle(self) -> None:
        done = self.trial("odometry")
        self.received(done, 100)
        self.assertEqual(({r["honest"] for r in receipts(done)}, {r["used"] for r in receipts(done)}), ({1}, {True}))
        self.assertLess(done.truth[-1].y, -0.01)
        # It drives by the forged place.
        self.assertAlmostEqual(done.exchanges[-1][1]["reply"]["place"][1], done.truth[-1].y + 3.0, places=2)

    def test_a_forged_command_is_in_force(self) -> None:
        done = self.trial("command")
        self.received(done, 100)
        self.assertEqual({answer["reply"]["speed_m_s"] for _, answer in done.exchanges[FIRST:]}, {3.0})

    def test_a_forged_time_is_not_the_last_word(self) -> None:
        done = self.trial("clock", amount=5.0)
        self.received(done, 100)
        self.assertEqual(({r["honest"] for r in receipts(done)}, {r["used"] for r in receipts(done)}), ({1}, {False}))

    def test_a_forged_route_stays_in_force(self) -> None:
        done = self.trial("route", rate_hz=2.0)
        self.received(done, 2)
        self.assertEqual({r["used"] for r in receipts(done)}, {True})
        self.assertGreater(done.truth[-1].y, 0.01)

    def test_a_replay_is_of_its_age(self) -> None:
        done = self.trial("replay_odometry", rate_hz=20.0, amount=0.5)
        self.received(done, 20)
        done = self.trial("replay_command", rate_hz=20.0, amount=0.5)
        self.received(done, 20)
        # The command of 0.5 s ago was of a standing vehicle until then.
        self.assertEqual({answer["reply"]["speed_m_s"] for _, answer in done.exchanges[FIRST:]}, {1.5})

    def test_a_replay_from_before_the_trial_is_not_sent(self) -> None:
        done = self.trial("replay_command", rate_hz=20.0, amount=60.0)
        self.assertEqual((total(done, "sent"), {r["why"] for r in receipts(done)}), (0, {"nothing so old was recorded"}))

    def test_one_packet_silences_a_best_effort_reader(self) -> None:
        done = self.trial("silence")
        self.assertEqual((total(done, "sent"), total(done, "received"), total(done, "honest")), (1, 1, 0))
        # No reason in the step of the packet: one would stand for a refusal.
        self.assertEqual([r["why"] for r in receipts(done)], [None] + [f"no honest /odom after its number {FIRST - 1}"] * 19)
        self.assertEqual(states(done), {"HOLDING"})
        self.assertEqual(len({tuple(answer["reply"]["place"]) for _, answer in done.exchanges[FIRST:]}), 1)
        self.assertGreater(done.truth[-1].x - done.exchanges[-1][1]["reply"]["place"][0], 0.5)

    def test_a_strangers_parameter_is_taken(self) -> None:
        done = self.trial("parameter", rate_hz=0.0, amount=0.0)
        self.received(done, 1)

    def test_a_name_is_taken_twice(self) -> None:
        done = self.trial("take_name")
        self.received(done, 1)

    def test_a_flood_does_not_keep_the_bridge_from_answering(self) -> None:
        done = self.trial("flood", rate_hz=1000.0)
        self.assertEqual((total(done, "sent"), len(receipts(done))), (1000, 20))
        self.assertGreater(total(done, "received"), 0)

    def test_a_listener_hears_each_topic_of_a_step(self) -> None:
        done = self.trial("listen")
        # Pose, inertial unit, satellite fix, tracks, command and time; none of its first step.
        self.assertEqual([r["received"] for r in receipts(done)][2:], [6] * 18)
        self.assertEqual(total(done, "sent"), total(done, "received"))

    def test_a_rate_is_of_the_vehicles_clock(self) -> None:
        done = self.trial("odometry", rate_hz=30.0)
        self.assertEqual([r["sent"] for r in receipts(done)][:4], [2, 1, 2, 1])

    def test_a_trial_after_an_attack_is_as_before(self) -> None:
        before = drive(self.process, "corner", 2.0, bus=[])
        for attack in ("silence", "parameter", "route"):
            self.trial(attack, amount=0.0)
            self.assertEqual(drive(self.process, "corner", 2.0, bus=[]).exchanges, before.exchanges)


class Readers(Graph):
    def test_a_reliable_reader_takes_nothing_of_best_effort(self) -> None:
        done = self.attacked(order("odometry"), "--rogue", "--rogue-best-effort", command=node("ahead"))
        self.assertEqual((total(done, "sent"), total(done, "received")), (100, 0))
        self.assertEqual({r["why"] for r in receipts(done)}, {"incompatible QoS"})

    def test_one_packet_silences_a_reliable_reader(self) -> None:
        done = self.attacked(order("silence"), "--rogue", "--answer-ms", "300", command=node("ahead"))
        self.assertEqual((total(done, "sent"), total(done, "received"), total(done, "honest")), (1, 1, 0))
        self.assertEqual(states(done), {"HOLDING"})

    def test_a_route_without_a_reader_is_named(self) -> None:
        done = self.attacked(order("route"), "--rogue", command=node("ahead"))
        self.assertEqual({r["why"] for r in receipts(done)}, {"the node does not read /plan"})
        self.assertEqual((total(done, "sent"), total(done, "received"), total(done, "used")), (0, 0, 0))

    def test_forged_times_fire_a_timer(self) -> None:
        commands = []
        for others in ([], [{**order("clock", amount=5.0)[0], "id": 2}]):
            done = self.attacked(order("listen") + others, "--rogue", "--command-period-s", "0.1", command=node("timed"))
            commands.append(sum(receipt["honest"] for receipt in receipts(done) if receipt["id"] == 1))
        self.assertGreater(commands[1], 1.3 * commands[0])

    def test_an_order_starts_the_rogue(self) -> None:
        done = self.attacked(order("command"))
        self.assertEqual((total(done, "sent"), total(done, "received")), (100, 100))


class Failures(Graph):
    """Rogues that are none of ours: the bridge answers each step, and says why."""

    def test_a_rogue_that_floods_without_an_order_is_outlasted(self) -> None:
        flood = PARTICIPANT + "while True: rogue.publisher('/odom').publish(Odometry())"
        self.assertEqual(self.of(flood), {"the rogue gives no answer within 1 s"})

    def of(self, program: str) -> set[Optional[str]]:
        with tempfile.NamedTemporaryFile("w", suffix=".py") as file:
            file.write(program)
            file.flush()
            done = self.attacked(order("odometry"), "--rogue-program", file.name, seconds=1.5)
        self.assertEqual((len(receipts(done)), total(done, "received"), states(done)), (10, 0, {"DRIVING"}))
        return {receipt["why"] for receipt in receipts(done)}

    def test_a_rogue_that_ends_is_named(self) -> None:
        self.assertEqual(self.of("raise SystemExit(3)"), {"the rogue ended: status 3"})

    def test_a_rogue_that_hangs_is_named(self) -> None:
        self.assertEqual(self.of("import signal; signal.pause()"), {"the rogue gives no answer within 8 s"})

    def test_a_rogue_that_talks_without_end_is_named(self) -> None:
        self.assertEqual(self.of("while True: print('x' * 1000, end='')"), {"the rogue's answers have no end"})

    def test_a_rogue_without_the_protocol_is_named(self) -> None:
        self.assertEqual(self.of("print('hello', flush=True); input()"), {"the rogue's answer is none of its protocol"})

    def test_a_rogue_that_lies_about_messages_has_none_received(self) -> None:
        lie = "for line in sys.stdin: answer({'topics': [], 'done': {'1': {'sent': 7}}}, json.loads(line))"
        self.assertEqual(self.of(PARTICIPANT + lie), {None})

    def test_a_rogue_outside_the_graph_is_given_no_order(self) -> None:
        absent = "import json, sys\nfor line in sys.stdin: print(json.dumps({'number': json.loads(line)['number']}), flush=True)"
        self.assertEqual(self.of(absent), {"the rogue is not in the graph yet"})


if __name__ == "__main__":
    unittest.main()
