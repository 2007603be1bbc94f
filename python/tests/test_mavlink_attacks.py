"""Attacks on the link between a vehicle and a program of MAVSDK's, unsigned and signed, where guests/mavlink is installed."""

import tempfile
import unittest
from pathlib import Path

from .mavlink_core import Core, order
from .mavlink_series import OFF_BOARD, PATIENT, PYTHON, Seen, attacked, begin, flown
from .test_mavlink import MISSION, Case, bare

WATCH = Path(__file__).with_name("mavsdk_watch.py")
#: Attacks that put no message in force.
WITHOUT_EFFECT = {"flood"}


@unittest.skipUnless(PYTHON.exists(), "MAVSDK and pymavlink are not installed: make -C guests/mavlink")
class Attacks(Case):
    def signed(self) -> list[str]:
        key = tempfile.NamedTemporaryFile("w", suffix=".key")
        self.addCleanup(key.close)
        key.write("correct-horse\n")
        key.flush()
        return ["--sign", key.name]

    def off_board(self, *options: str) -> Core:
        core = self.core(OFF_BOARD, *options)
        begin(core)
        return core

    def series(self, *options: str) -> dict[str, Seen]:
        return flown(self.core(OFF_BOARD, *options))

    def test_an_unsigned_link_takes_each(self) -> None:
        for attack, seen in self.series().items():
            with self.subTest(attack):
                self.assertGreater(seen.total("sent"), 0)
                self.assertEqual(seen.total("received"), seen.total("sent"))
                self.assertEqual(seen.reasons(), {None})
                self.assertEqual(seen.used() > 0, attack not in WITHOUT_EFFECT)
                if attack == "rewrite":
                    self.assertGreater(seen.east_m, 1.5)
                if attack == "stop":
                    self.assertEqual(seen.state, "HOLD")

    def test_forged_set_points_lead_backwards(self) -> None:
        # So often that the honest one is hardly ever the last of a step.
        seen = attacked(self.off_board(), 1, "command", 1000.0, -2.0)
        self.assertLess(seen.east_m, 0.0)

    def test_a_signed_link_refuses_each(self) -> None:
        for attack, seen in self.series(*self.signed()).items():
            with self.subTest(attack):
                # A rewritten set-point is lost, so the flight ends by the vehicle's own failsafe, and `stop` finds no flight.
                self.assertEqual(seen.state, "FAILSAFE" if attack in ("rewrite", "stop") else "OFFBOARD")
                self.assertGreater(seen.total("sent"), 0)
                self.assertEqual(seen.total("received"), seen.total("sent"))
                self.assertEqual(seen.reasons(), {"signature"})
                self.assertEqual(seen.used(), 0)

    def test_a_cut_link_ends_in_a_failsafe(self) -> None:
        for options in ([], self.signed()):
            with self.subTest(signed=bool(options)):
                seen = attacked(self.off_board(*options), 1, "silence", 0.0, 0.0, seconds=3.0)
                self.assertEqual((seen.total("received"), seen.total("honest")), (0, 0))
                self.assertGreater(seen.total("sent"), 20)
                self.assertEqual(seen.state, "FAILSAFE")

    def test_a_listener_hears_both_ends_and_changes_nothing(self) -> None:
        for options in ([], self.signed()):
            with self.subTest(signed=bool(options)):
                seen = attacked(self.off_board(*options), 1, "listen", 0.0, 0.0)
                self.assertEqual((seen.total("sent"), seen.used()), (seen.total("received"), 0))
                self.assertGreater(seen.total("received"), seen.total("honest"))
                self.assertEqual(seen.state, "OFFBOARD")

    def test_mavsdk_shows_a_forged_position_unless_it_is_signed(self) -> None:
        for options, forged in (([], True), (self.signed(), False)):
            with self.subTest(signed=bool(options)):
                core = self.core([str(PYTHON), str(WATCH), "{port}"], *options)
                core.fly(2.0)
                attacked(core, 1, "odometry", 20.0, 5.0)
                words = self.words(core)
                self.assertIn("north 0\n", words)
                self.assertEqual("north 5\n" in words, forged)

    def test_a_forged_mission_leads_elsewhere(self) -> None:
        for options, north in (([], 6.0), (self.signed(), 0.0)):
            with self.subTest(signed=bool(options)):
                core = self.core(MISSION, *options, route=[[25.0, 0.0]])
                self.assertTrue(core.until_state("MISSION", PATIENT))
                seen = attacked(core, 1, "route", 2.0, 6.0, seconds=2.0)
                self.assertTrue(core.until_state("HOLD", PATIENT))
                self.assertAlmostEqual(core.body.y, north, delta=1.5)
                self.assertEqual(seen.used() > 0, north > 0.0)

    def test_a_forged_stop_lands_disarms_or_holds(self) -> None:
        for act, states in enumerate((["LAND", "DISARMED"], ["DISARMED"], ["HOLD"])):
            with self.subTest(states[0]):
                core = self.core(MISSION, route=[[40.0, 0.0]])
                self.assertTrue(core.until_state("MISSION", PATIENT))
                seen = attacked(core, 1, "stop", 5.0, float(act))
                self.assertIn(seen.state, states)
                if states[0] == "LAND":
                    self.assertTrue(core.until_state("DISARMED", PATIENT))
                    self.assertLess(core.body.height, 0.3)

    def test_two_attacks_have_a_receipt_each(self) -> None:
        core = self.off_board()
        orders = [order(1, "odometry", 20.0, 3.0), order(2, "parameter", 10.0, 1.0)]
        flight = core.fly(1.5, lambda _: {"bus": orders})
        for id in (1, 2):
            self.assertGreater(flight.total(id, "sent"), 10)
            self.assertEqual(flight.total(id, "received"), flight.total(id, "sent"))
        core.fly(0.5)
        self.assertNotIn("bus", flight.replies[-1])

    def test_what_reaches_no_socket_is_not_received(self) -> None:
        core = self.core(["sh", "-c", '"$@" & sleep 1.5; kill $!; wait', "short", *bare("parameters")])
        self.assertTrue(core.until(lambda _: False, 3.0) is False)
        seen = attacked(core, 1, "odometry", 20.0, 3.0)
        self.assertGreater(seen.total("sent"), 20)
        self.assertEqual(seen.total("received"), 0)
        # No end has refused them: a judge has to tell that apart.
        self.assertEqual(seen.reasons(), {None})


if __name__ == "__main__":
    unittest.main()
