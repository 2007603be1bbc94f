"""The guests of `guests/`, where they are installed: each drives a corner, and two of its processes answer alike."""

import shutil
import sys
import unittest
from pathlib import Path

from .driver import MISSIONS, Process, drive

GUESTS = Path(__file__).resolve().parents[2] / "guests"


class Guests(unittest.TestCase):
    def arrives(self, command: list[str], state: str, mission: str = "corner") -> None:
        if shutil.which(command[0]) is None:
            self.skipTest(f"{command[0]} has not been built")
        rounds = []
        for _ in range(2):
            guest = Process(command)
            rounds.append(drive(guest, mission, 30.0))
            self.assertEqual(guest.end(), 0)
        done = rounds[0]
        self.assertEqual(done.exchanges, rounds[1].exchanges)
        goal, last = MISSIONS[mission][0][-1], done.truth[-1]
        self.assertLess(((last.x - goal[0]) ** 2 + (last.y - goal[1]) ** 2) ** 0.5, 1.0)
        self.assertLess(abs(last.speed), 0.05)
        self.assertEqual(done.states[-1][1], state)

    def test_the_follower_arrives(self) -> None:
        self.arrives([sys.executable, str(GUESTS / "follower/follower.py")], "ARRIVED")

    def test_mrpt_arrives(self) -> None:
        self.arrives([str(GUESTS / "mrpt/mrpt-guest"), str(GUESTS / "mrpt/reactive.ini")], "IDLE")

    def test_mrpt_drives_between_two_buildings(self) -> None:
        self.arrives([str(GUESTS / "mrpt/mrpt-guest"), str(GUESTS / "mrpt/reactive.ini")], "IDLE", "street")

    def test_wpilib_arrives(self) -> None:
        self.arrives([str(GUESTS / "wpilib/.venv/bin/python"), str(GUESTS / "wpilib/wpilib_guest.py")], "ARRIVED")

    def test_a_ros_2_node_arrives(self) -> None:
        node = [str(GUESTS / "ros2/pure_pursuit_node.py"), "--ros-args", "-p", "use_sim_time:=true"]
        python = str(GUESTS / "ros2/.venv/bin/python")
        # A bridge states no arrival: the node does not.
        bridge = [python, str(GUESTS / "ros2/ros2_guest.py"), "--answer-ms", "2000", "--", python, *node]
        self.arrives(bridge, "DRIVING")


if __name__ == "__main__":
    unittest.main()
