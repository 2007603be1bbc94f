"""Honest trouble on a signed MAVLink link, where guests/mavlink is installed."""

import unittest

from . import mavlink_trouble
from .mavlink_series import PYTHON


@unittest.skipUnless(PYTHON.exists(), "MAVSDK and pymavlink are not installed: make -C guests/mavlink")
class Trouble(unittest.TestCase):
    def flown(self, name: str) -> dict[str, str]:
        row = next(row for row in mavlink_trouble.rows() if row["name"] == name)
        return mavlink_trouble.flown(row, seed=1).summary()

    def test_a_signed_link_without_trouble_loses_no_datagram(self) -> None:
        found = self.flown("sound")
        self.assertEqual((found["vehicle"], found["program"], found["told"]), ("all", "all", "no"))

    def test_a_late_clock_at_a_restart_silences_an_end_that_keeps_to_its_clock(self) -> None:
        found = self.flown("restart-30-s-same-own")
        self.assertEqual((found["vehicle"], found["program"], found["ends"]), ("none", "all", "failsafe"))

    def test_a_late_clock_at_a_restart_is_repaired_by_the_other_ends_stamps(self) -> None:
        found = self.flown("restart-year-same")
        self.assertNotEqual(found["vehicle"], "none")
        self.assertEqual(found["ends"], "flies")

    def test_a_vehicle_with_a_late_clock_is_not_found(self) -> None:
        found = self.flown("vehicle-late-year")
        self.assertEqual((found["vehicle"], found["program"], found["told"]), ("nothing", "none", "unseen"))
        self.assertEqual(found["back"], "yes")

    def test_a_vehicle_without_its_key_flies_on_unheard(self) -> None:
        found = self.flown("vehicle-drops-key")
        self.assertEqual((found["vehicle"], found["program"], found["ends"], found["told"]), ("all", "none", "flies", "lost"))


if __name__ == "__main__":
    unittest.main()
