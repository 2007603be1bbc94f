"""Tests of the judge and of the packets, without DDS: `make test`."""

import struct
import unittest

import judge
import packets

WRITER = bytes(range(12)) + bytes.fromhex("00000203")


def run(delivered=0, honest=100, why=""):
    counts = {"before": [40, 40], "during": [honest, 100], "after": [60, 60]}
    return {"why": why, "honest": counts, "delivered": delivered, "attack_sent": 100, "delivered_under_honest_guid": 0, "harm_m": 0.0}


class Judge(unittest.TestCase):
    attack = {"name": "a", "auth": "STOPPED KEPT", "known": {"auth": "STOPPED LOST"}}

    def test_intervals_are_exact(self):
        self.assertEqual(judge.clopper_pearson(0, 256)[0], 0.0)
        self.assertAlmostEqual(judge.clopper_pearson(0, 256)[1], 1 - 0.025 ** (1 / 256), places=4)
        self.assertAlmostEqual(judge.clopper_pearson(7, 20)[0], 0.1539, places=4)
        self.assertAlmostEqual(judge.clopper_pearson(7, 20)[1], 0.5922, places=4)

    def test_one_delivered_message_is_a_difference(self):
        cell = judge.cell(self.attack, "auth", [run(), run(), run(delivered=1)])
        self.assertEqual((cell["measured"], cell["is_as_required"]), ("DELIVERED KEPT", False))

    def test_a_published_weakness_is_told_from_a_new_one(self):
        cell = judge.cell(self.attack, "auth", [run(honest=0)] * 3)
        self.assertEqual((cell["is_as_required"], cell["is_as_known"]), (False, True))

    def test_an_attack_that_did_not_leave_is_invalid(self):
        cell = judge.cell(self.attack, "auth", [run(), run(), run(why="no packet of it on the wire")])
        self.assertEqual(cell["invalid"], ["no packet of it on the wire"])

    def test_two_runs_are_too_few(self):
        self.assertTrue(judge.cell(self.attack, "auth", [run(), run()])["invalid"])

    def test_every_attack_has_its_expectation(self):
        from attacks import ATTACKS

        self.assertEqual(list(ATTACKS), list(judge.expectations()))


class Packets(unittest.TestCase):
    def test_data_has_its_writer_number_and_content(self):
        packet = packets.data_packet(WRITER, 2**32 + 7, bytes(48))
        self.assertEqual((packet[:4], packet[8:20]), (b"RTPS", WRITER[:12]))
        body = packet[32:]
        self.assertEqual((body[0], body[12:16]), (packets.DATA, WRITER[12:]))
        self.assertEqual(struct.unpack("<iI", body[16:24]), (1, 7))
        self.assertEqual(struct.unpack("<H", body[2:4])[0], len(body) - 4)

    def test_heartbeat_is_as_long_as_the_standard_says(self):
        packet = packets.heartbeat_packet(WRITER, 100_000, 1)
        self.assertEqual(len(packet), 20 + 4 + 28)


if __name__ == "__main__":
    unittest.main()
