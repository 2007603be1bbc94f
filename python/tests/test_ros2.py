"""The bridge to ROS 2 with nodes behind it, where guests/ros2 is installed."""

import json
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path
from typing import Optional

from .driver import Drive, Process, Vehicle, drive, second_start_of, second_step_of, start_of, step_of

ROS2 = Path(__file__).resolve().parents[2] / "guests/ros2"
PYTHON = ROS2 / ".venv/bin/python"
NODES = Path(__file__).with_name("ros2_nodes.py")
#: Generous: a loaded machine answers late.
PATIENT = ["--answer-ms", "2000"]


def node(name: str) -> list[str]:
    return [str(PYTHON), str(NODES), name, "--ros-args", "-p", "use_sim_time:=true"]


def guest(node_command: list[str], *options: str) -> list[str]:
    return [str(PYTHON), str(ROS2 / "ros2_guest.py"), *options, "--", *node_command]


def session_of(pid: int) -> list[int]:
    """Processes whose parent or session leader is `pid` or a child of it."""
    table = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            table[int(entry.name)] = (fields[0], int(fields[1]), int(fields[3]))
    children = {process for process, (_, parent, _) in table.items() if parent == pid}
    return [process for process, (state, _, session) in table.items() if state != "Z" and session in children]


def gone(processes: list[int], within_s: float = 5.0) -> bool:
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        if not any(Path(f"/proc/{process}").exists() for process in processes):
            return True
        time.sleep(0.05)
    return False


def traces() -> set[str]:
    """What the middleware or the bridge could leave."""
    shared = {str(path) for path in Path("/dev/shm").glob("*fastdds*")}
    return shared | {str(path) for path in Path(tempfile.gettempdir()).glob("ros2-guest-*")}


@unittest.skipUnless(PYTHON.exists(), "ROS 2 is not installed: make -C guests/ros2")
class Ros2(unittest.TestCase):
    def driven(self, name: str, *options: str, seconds: float = 6.0, attack: str = "none") -> Drive:
        before = traces()
        process = Process(guest(node(name), *options))
        done = drive(process, "straight", seconds, attack, at=2.0)
        self.assertEqual(process.end(), 0)
        self.assertEqual(traces() - before, set())
        return done

    def states(self, done: Drive) -> list[str]:
        return [answer["reply"]["state"] for _, answer in done.exchanges[1:]]

    def failure(self, command: list[str]) -> str:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        _, words = process.communicate(json.dumps(start_of("straight")) + "\n", timeout=60)
        self.assertEqual(process.returncode, 1)
        return words

    def test_a_default_reader_answers_each_step(self) -> None:
        for name in ("ahead", "stamped", "planned", "mapped"):
            with self.subTest(name):
                done = self.driven(name, *PATIENT)
                self.assertEqual(set(self.states(done)[10:]), {"DRIVING"})
                self.assertGreater(done.truth[-1].x, 4.0)

    def test_the_second_protocol_has_fix_inertia_and_pose(self) -> None:
        process = Process(guest(node("navigated"), *PATIENT))
        done = drive(process, "straight", 6.0, bus=[])
        self.assertEqual(process.end(), 0)
        self.assertGreater(done.truth[-1].x, 4.0)

    def test_a_body_with_rotors_is_given_a_velocity(self) -> None:
        start = second_start_of("straight")
        start["start"]["body"]["medium"] = "air"
        process = Process(guest(node("ahead"), *PATIENT))
        process.ask(start)
        reply = process.ask(second_step_of(step_of(1, Vehicle(), Vehicle(), True), []))["reply"]
        self.assertEqual(process.end(), 0)
        self.assertEqual(reply["velocity"], {"forward_m_s": 1.0, "left_m_s": 0.0, "up_m_s": 0.0, "turn_rad_s": 0.0})
        self.assertNotIn("speed_m_s", reply)

    def test_trials_in_one_process_are_alike(self) -> None:
        tutorial = [str(PYTHON), str(ROS2 / "pure_pursuit_node.py"), "--ros-args", "-p", "use_sim_time:=true"]
        for options in ([], ["--keep-node"], ["--keep-node", "--rogue"]):
            with self.subTest(options):
                process = Process(guest(tutorial, *PATIENT, *options))
                # To the end of the route, so that a node that is kept has another state than at its start.
                first, second, third = (drive(process, "straight", 20.0, bus=[]) for _ in range(3))
                self.assertEqual(process.end(), 0)
                self.assertGreater(first.truth[-1].x, 18.0)
                self.assertEqual(second.exchanges, first.exchanges)
                self.assertEqual(third.exchanges, first.exchanges)

    def test_two_runs_are_alike(self) -> None:
        self.assertEqual(self.driven("ahead", *PATIENT).exchanges, self.driven("ahead", *PATIENT).exchanges)

    def test_a_default_reader_gets_no_best_effort_readings(self) -> None:
        done = self.driven("ahead", "--best-effort", "--answer-ms", "50", seconds=2.0)
        self.assertEqual(set(self.states(done)), {"WAITING"})

    def test_a_timer_runs_by_the_vehicles_clock(self) -> None:
        done = self.driven("timed", "--command-period-s", "0.1", *PATIENT)
        self.assertLess(self.states(done).count("HOLDING"), 3)
        self.assertGreater(done.truth[-1].x, 4.0)

    def test_the_last_command_of_a_silent_node_stands(self) -> None:
        done = self.driven("tired", "--answer-ms", "300", seconds=3.0)
        self.assertEqual(self.states(done)[-1], "HOLDING")
        self.assertAlmostEqual(done.exchanges[-1][1]["reply"]["speed_m_s"], 1.0)

    def test_without_a_pose_the_last_command_stands(self) -> None:
        begun = time.monotonic()
        done = self.driven("ahead", *PATIENT, seconds=6.0, attack="dropout")
        self.assertEqual(set(self.states(done)[10:38]), {"DRIVING"})
        self.assertEqual(set(self.states(done)[40:]), {"HOLDING"})
        # Eighty steps of two seconds each would be 160 s.
        self.assertLess(time.monotonic() - begun, 30.0)

    def test_two_bridges_do_not_hear_each_other(self) -> None:
        silent = Process(guest(node("mute"), "--ready-s", "60"))
        try:
            process = Process(guest(node("ahead"), *PATIENT))
            self.assertEqual(drive(process, "straight", 2.0).states[-1][1], "DRIVING")
            self.assertEqual(process.end(), 0)
        finally:
            silent.popen.send_signal(signal.SIGINT)
            silent.end()

    def test_a_node_without_commands_is_named(self) -> None:
        words = self.failure(guest(node("mute"), "--ready-s", "1"))
        self.assertIn("no publisher of /cmd_vel within 1 s", words)

    def test_a_node_that_ends_is_named(self) -> None:
        self.assertIn("ended: status 7", self.failure(guest(node("ends"))))

    def test_nothing_outlives_the_bridge(self) -> None:
        before = traces()
        launched = ["sh", "-c", 'sleep 600 & "$@" & wait', "launch", *node("ahead")]
        for end in (None, signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            with self.subTest(end):
                process = Process(guest(launched, *PATIENT, "--rogue"))
                drive(process, "straight", 1.0)
                there = session_of(process.popen.pid)
                # The warden, the rogue, and the node with its launcher and what that started.
                self.assertGreaterEqual(len(there), 5)
                self.assertEqual(self.ended(process, end), {None: 0, signal.SIGKILL: -signal.SIGKILL}.get(end, 1))
                self.assertTrue(gone(there), there)
                self.assertEqual(traces() - before, set())

    def ended(self, process: Process, end: Optional[signal.Signals]) -> int:
        if end is not None:
            process.popen.send_signal(end)
            process.popen.wait(timeout=20)
        return process.end()


if __name__ == "__main__":
    unittest.main()
