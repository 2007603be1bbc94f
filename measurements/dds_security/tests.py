"""Tests of the judge and of the packets, without DDS: `make test`."""

import struct
import unittest

import forgery
import judge
import packets

WRITER = bytes(range(12)) + bytes.fromhex("00000203")


def run(delivered=0, honest=100, invalid=""):
    counts = {"before": [40, 40], "during": [honest, 100], "after": [60, 60]}
    return {"invalid": invalid, "honest": counts, "delivered": delivered, "attack_sent": 100, "delivered_under_honest_guid": 0, "harm_m": 0.0,
            "ended": [0, 0], "sniffer_dropped": 0}


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
        cell = judge.cell(self.attack, "auth", [run(), run(), run(invalid="no packet of it on the wire")])
        self.assertEqual(cell["invalid"], ["no packet of it on the wire"])

    def test_two_runs_are_too_few(self):
        self.assertTrue(judge.cell(self.attack, "auth", [run(), run()])["invalid"])

    def test_every_attack_has_its_expectation(self):
        from attacks import ATTACKS

        self.assertEqual(list(ATTACKS), list(judge.expectations()))


class Forgery(unittest.TestCase):
    # Case 15 of the test vectors of GCM: a key of 256 bits, no data beside the plain text.
    KEY = bytes.fromhex("feffe9928665731c6d6a8f9467308308" * 2)
    NONCE = bytes.fromhex("cafebabefacedbaddecaf888")
    PLAIN = bytes.fromhex("d9313225f88406e5a55909c5aff5269a86a7a9531534f7da2e4c303d8a318a72"
                          "1c3c0c95956809532fcf0e2449a6b525b16aedf5aa0de657ba637b391aafd255")

    def test_seal_is_gcm(self):
        content, tag = forgery.seal(self.KEY, self.NONCE, self.PLAIN)
        self.assertEqual(content[:8].hex(), "522dc1f099567d07")
        self.assertEqual(tag.hex(), "b094dac5d93471bdec1a502270e3cc6c")

    def test_a_message_opens_as_it_was_sealed(self):
        material = forgery.GCM + bytes(4) + bytes(32) + b"KEYS" + bytes(4) + bytes(range(32))
        key = forgery.Key(material)
        header, body, tag = key.protect(b"of the whole message")
        packet = packets.HEADER + bytes(12) + b"".join(
            packets.submessage(kind, 1, part)
            for kind, part in ((forgery.SRTPS_PREFIX, header), (forgery.SEC_BODY, body), (forgery.SRTPS_POSTFIX, tag)))
        self.assertEqual(forgery.opened(packet, key), b"of the whole message")


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
