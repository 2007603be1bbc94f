"""The bridge to MAVLink with programs behind it, where guests/mavlink is installed."""

import os
import signal
import tempfile
import unittest
from pathlib import Path
from typing import Optional

from .mavlink_core import HEIGHT, Core
from .mavlink_series import MAVLINK, OFF_BOARD, PATIENT, PYTHON, guest
from .test_ros2 import gone, session_of

PROGRAMS = Path(__file__).with_name("mavlink_programs.py")
MISSION = [str(PYTHON), str(MAVLINK / "programs/mission.py"), "{port}", "{route}"]


def bare(name: str) -> list[str]:
    return [str(PYTHON), str(PROGRAMS), name, "{port}"]


class Case(unittest.TestCase):
    """Cores with a bridge each, which leave no files."""

    def core(self, program: list[str], *options: str, rotors: bool = True, route: Optional[list[list[float]]] = None) -> Core:
        # A folder for temporary files of this bridge alone: other tests may run beside it.
        folder = tempfile.mkdtemp()
        self.addCleanup(os.rmdir, folder)
        core = Core(["env", f"TMPDIR={folder}", *guest(program, *options)], rotors, route)
        self.addCleanup(core.end_if_there)
        return core

    def words(self, core: Core) -> str:
        status, words = core.end()
        self.assertEqual(status, 0, words)
        return words

    def flown(self, program: list[str], *options: str, seconds: float = 12.0) -> str:
        """The words of a bare program that was given some time."""
        core = self.core(program, *options)
        core.fly(seconds, lambda at_s: {"limit": 3.0 if at_s > 0.5 else 0.0})
        words = self.words(core)
        self.assertIn("done", words)
        return words


@unittest.skipUnless(PYTHON.exists(), "MAVSDK and pymavlink are not installed: make -C guests/mavlink")
class Programs(Case):
    def test_a_mission_is_flown_and_held(self) -> None:
        for rotors in (True, False):
            with self.subTest(rotors=rotors):
                core = self.core(MISSION, rotors=rotors)
                self.assertTrue(core.until_state("MISSION", PATIENT))
                self.assertTrue(core.until_state("HOLD", PATIENT))
                place = core.flight.places[-1]
                core.fly(1.0)
                x, y, height = core.flight.places[-1]
                # The goal is reached by MAVSDK's radius, and HOLD stands.
                self.assertLess(abs(x - 8.0) + abs(y - 6.0), 2.0)
                self.assertLess(abs(x - place[0]) + abs(y - place[1]), 1.5)
                self.assertEqual(height, HEIGHT)
                self.words(core)

    def test_arming_waits_for_the_operator(self) -> None:
        core = self.core(MISSION)
        core.fly(3.0, lambda _: {"limit": 0.0})
        self.assertEqual(core.flight.states(), ["DISARMED"])
        self.assertTrue(core.until_state("MISSION", PATIENT))
        self.words(core)

    def test_the_operators_hold_ends_a_mission(self) -> None:
        core = self.core(MISSION)
        self.assertTrue(core.until_state("MISSION", PATIENT))
        core.fly(1.0)
        held = core.step(lambda _: {"limit": 0.0})
        self.assertEqual((held["state"], held["velocity"]["forward_m_s"]), ("HOLD", 0.0))
        core.fly(2.0)
        self.assertEqual(core.flight.states()[-1], "HOLD")
        self.words(core)

    def test_off_board_follows_and_fails_safe(self) -> None:
        core = self.core(bare("set_points"))
        self.assertTrue(core.until_state("OFFBOARD", PATIENT))
        core.fly(1.5)
        self.assertGreater(core.body.x, 0.8)
        self.assertTrue(core.until_state("FAILSAFE", 5.0))
        self.assertEqual(core.flight.replies[-1]["velocity"]["forward_m_s"], 0.0)
        self.words(core)

    def test_a_lost_position_fails_safe(self) -> None:
        core = self.core(OFF_BOARD)
        self.assertTrue(core.until_state("OFFBOARD", PATIENT))
        self.assertTrue(core.until_state("FAILSAFE", 3.0, lambda _: {"fix": False}))
        self.words(core)

    def test_a_killed_program_leaves_a_safe_vehicle(self) -> None:
        core, program = self.with_pid(OFF_BOARD)
        self.assertTrue(core.until_state("OFFBOARD", PATIENT))
        os.kill(program, signal.SIGKILL)
        self.assertTrue(core.until_state("FAILSAFE", 5.0))
        self.assertIn("ended: status -9", self.words(core))

    def test_a_stopped_program_leaves_a_safe_vehicle(self) -> None:
        core, program = self.with_pid(OFF_BOARD)
        self.assertTrue(core.until_state("OFFBOARD", PATIENT))
        os.kill(program, signal.SIGSTOP)
        self.assertTrue(core.until_state("FAILSAFE", 5.0))
        os.kill(program, signal.SIGCONT)
        core.fly(2.0)
        # The set-points go on, but the mode has not been asked for again.
        self.assertEqual(core.flight.replies[-1]["state"], "FAILSAFE")
        self.words(core)

    def with_pid(self, program: list[str]) -> tuple[Core, int]:
        with tempfile.NamedTemporaryFile("r") as file:
            core = self.core(["sh", "-c", 'echo $$ > "$0"; exec "$@"', file.name, *program])
            return core, int(file.read())

    def test_a_silent_program_does_not_end_a_mission(self) -> None:
        core = self.core(bare("silent"))
        self.assertTrue(core.until_state("MISSION", PATIENT))
        core.fly(13.0)
        self.assertEqual(core.flight.replies[-1]["state"], "MISSION")
        self.words(core)

    def test_a_silent_program_ends_one_by_parameter(self) -> None:
        core = self.core(bare("silent"), "--parameter", "NAV_DLL_ACT=1", "--parameter", "COM_DL_LOSS_T=2")
        self.assertTrue(core.until_state("MISSION", PATIENT))
        self.assertTrue(core.until_state("FAILSAFE", 5.0))
        self.words(core)

    def test_each_command_is_answered(self) -> None:
        words = self.flown(bare("commands"))
        said = "disabled 2|unknown 3|other 0|take-off 0|reposition 0|mission 2|off-board 2|version 0 True|interval 0|disarm 2"
        for line in said.split("|"):
            self.assertIn(line + "\n", words)

    def test_parameters_take_numbers_alone(self) -> None:
        words = self.flown(bare("parameters"))
        self.assertIn("names 8\ncruise 2.0\ncruise 2.0\ncruise 2.0\ntime 77\n", words)

    def test_garbage_takes_no_order_with_it(self) -> None:
        words = self.flown(bare("garbage"))
        self.assertIn("armed 0\n", words)
        for why in ("checksum", "unknown message", "no whole frame", "no frame"):
            self.assertIn(f"'{why}'", words)

    def test_no_message_ends_the_vehicle(self) -> None:
        for options in ([], ["--ardupilot"]):
            with self.subTest(options):
                self.assertIn("armed 0\n", self.flown(bare("every"), *options))

    def test_an_unknown_item_refuses_the_mission(self) -> None:
        self.assertIn("upload 3\ncount 0\n", self.flown(bare("refused")))

    def test_a_program_that_says_nothing_is_named(self) -> None:
        with self.assertRaisesRegex(EOFError, "no message of .*python within 2 s of real time"):
            self.core(bare("mute"), "--ready-s", "2")

    def test_a_program_that_ends_at_once_is_named(self) -> None:
        with self.assertRaisesRegex(EOFError, "the program false ended: status 1"):
            self.core(["false"])

    def test_nothing_outlives_the_bridge(self) -> None:
        for end in (None, signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            with self.subTest(end):
                core = self.core(["sh", "-c", 'sleep 600 & "$@" & wait', "launch", *bare("parameters")])
                core.fly(0.5)
                there = session_of(core.process.pid)
                self.assertGreaterEqual(len(there), 5)
                if end is not None:
                    core.process.send_signal(end)
                status, _ = core.end()
                self.assertEqual(status, {None: 0, signal.SIGKILL: -signal.SIGKILL}.get(end, 1))
                self.assertTrue(gone(there), there)

    def test_a_step_takes_its_time(self) -> None:
        for factor in (1.0, 4.0):
            with self.subTest(factor):
                core = self.core(bare("parameters"), "--factor", str(factor))
                core.step()
                self.assertGreaterEqual(core.timed(1.0), 1.0 / factor - 0.01)
                self.words(core)


@unittest.skipUnless((PYTHON.parent / "mavproxy.py").exists(), "MAVProxy is not installed: make -C guests/mavlink mavproxy")
class MavProxy(Case):
    def script(self, *names: str) -> list[str]:
        scripts = [str(MAVLINK / "programs" / name) for name in names]
        return [str(PYTHON), str(MAVLINK / "programs/mavproxy_script.py"), "{port}", "{folder}", *scripts]

    def held(self, core: Core) -> None:
        self.assertTrue(core.until_state("MISSION", PATIENT))
        self.assertTrue(core.until_state("HOLD", PATIENT))
        self.assertLess(abs(core.body.x - 8.0) + abs(core.body.y - 6.0), 2.0)
        # Until it has seen it.
        core.fly(2.0)
        self.assertRegex(self.words(core), "Mode LOITER(.|\n)*Mode LOITER")

    def test_a_mission_is_flown_and_held(self) -> None:
        # Its first words must not precede the operator's.
        core = self.core(self.script("mission.scr"), "--ardupilot")
        core.fly(3.0, lambda _: {"limit": 0.0})
        self.held(core)

    def test_a_signed_mission_is_flown_and_held(self) -> None:
        with tempfile.NamedTemporaryFile("w") as key:
            key.write("correct-horse\n")
            key.flush()
            core = self.core(self.script("signed.scr", "mission.scr"), "--ardupilot", "--sign", key.name, "--signs-itself")
            core.fly(3.0, lambda _: {"limit": 0.0})
            self.held(core)


if __name__ == "__main__":
    unittest.main()
