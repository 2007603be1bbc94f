"""Lines of the protocol: read whole, or refused by name."""

import json
import unittest
from typing import Callable

from holdsafe_guest import (
    Block,
    Body,
    Cluster,
    Disc,
    Fix,
    Order,
    Origin,
    Pose,
    ProtocolError,
    Receipt,
    Reply,
    Start,
    Step,
    Velocity,
)
from holdsafe_guest.reading import request

from .driver import Vehicle, second_start_of, second_step_of, start_of, step_of

ORDER = {"id": 1, "attack": "odometry", "rate_hz": 100.0, "amount": 3.0}


def line(value: object) -> bytes:
    return json.dumps(value).encode()


class Requests(unittest.TestCase):
    def test_a_start_is_read_whole(self) -> None:
        start = request(line(start_of("straight")))
        assert isinstance(start, Start)
        self.assertEqual(start.route, [(10.0, 0.0), (20.0, 0.0)])
        self.assertEqual(start.obstacles, [Disc((10.0, 10.0), 0.5)])
        self.assertEqual(start.blocks, [Block((10.0, 10.0), (0.5, 0.3), 0.0)])
        self.assertEqual((start.time_s, start.period_s, start.looped), (3600.0, 0.05, False))
        self.assertEqual((start.max_speed_m_s, start.braking_m_s2, len(start.fence)), (3.0, 3.0, 4))

    def test_a_start_without_blocks_has_none(self) -> None:
        begun = start_of("straight")
        del begun["start"]["blocks"]
        start = request(line(begun))
        assert isinstance(start, Start)
        self.assertEqual(start.blocks, [])

    def test_a_step_is_read_whole(self) -> None:
        asked = step_of(2, Vehicle(x=1.0, yaw=-0.5, speed=2.0, curvature=0.1), Vehicle(x=1.0, yaw=-0.5), True)
        track = {"id": 7, "class": "person", "at": [1, 2], "velocity": [0.5, 0], "confidence": 0.9, "updated_s": 3600}
        asked["step"].update(tracks=[track], teammates=[[4, 5]])
        step = request(line(asked))
        assert isinstance(step, Step) and step.odometry is not None
        self.assertEqual((step.number, step.time_s, step.limit_m_s, step.mode), (2, 3600.1, 3.0, "READY"))
        self.assertEqual(step.fix, Fix(3600.1, (1.0, 0.0), -0.5, 0.04, 3600.1))
        self.assertEqual((step.odometry.speed_m_s, step.odometry.yaw_rate_rad_s), (2.0, 0.2))
        self.assertEqual((step.tracks[0].id, step.tracks[0].class_name, step.teammates), (7, "person", [(4.0, 5.0)]))

    def test_a_lost_fix_is_none(self) -> None:
        step = request(line(step_of(1, Vehicle(), None, True)))
        assert isinstance(step, Step)
        self.assertIsNone(step.fix)

    def test_a_first_start_has_nothing_of_the_second(self) -> None:
        start = request(line(start_of("straight")))
        assert isinstance(start, Start)
        self.assertEqual((start.protocol, start.pose, start.body, start.origin), ("jsonl/1", None, None, None))

    def test_a_second_start_is_read_whole(self) -> None:
        begun = second_start_of("straight")
        start = request(line(begun))
        assert isinstance(start, Start)
        self.assertEqual((start.protocol, start.pose), ("jsonl/2", Pose((0.0, 0.0), 0.0, None)))
        self.assertEqual(start.body, Body("ground", (1.2, 0.8), 0.4, 1.0, 0.0, 0.0))
        self.assertEqual(start.origin, Origin(47.0, 8.0, 400.0))
        begun["start"]["pose"] = None
        start = request(line(begun))
        assert isinstance(start, Start)
        self.assertIsNone(start.pose)

    def test_a_second_step_is_read_whole(self) -> None:
        asked = second_step_of(step_of(2, Vehicle(), Vehicle(x=1.0), True), [ORDER])
        track = {"id": 7, "class": "person", "at": [1, 2], "velocity": [0.5, 0], "confidence": 0.9, "updated_s": 3600, "sigma_m": 0.2}
        cluster = {"id": 9, "at": [3, 4], "velocity": [0, 1], "width_m": 0.5}
        asked["step"].update(tracks=[track], nearby=[cluster], height_m=2)
        asked["step"]["fix"]["height_m"] = 2.5
        step = request(line(asked))
        assert isinstance(step, Step) and step.fix is not None
        self.assertEqual((step.height_m, step.fix.height_m, step.tracks[0].sigma_m), (2.0, 2.5, 0.2))
        self.assertEqual(step.nearby, [Cluster(9, (3.0, 4.0), (0.0, 1.0), 0.5)])
        self.assertEqual(step.bus, [Order(1, "odometry", 100.0, 3.0)])

    def test_a_step_without_attacks_has_no_order(self) -> None:
        step = request(line(second_step_of(step_of(1, Vehicle(), None, True), [])))
        assert isinstance(step, Step)
        self.assertEqual((step.bus, step.nearby, step.height_m), ([], [], None))

    def test_unknown_fields_are_ignored(self) -> None:
        asked = step_of(1, Vehicle(), Vehicle(), True)
        asked["step"]["altitude_m"] = 3
        self.assertIsInstance(request(line(asked)), Step)

    def test_each_wrong_line_is_refused_by_name(self) -> None:
        good = line(step_of(1, Vehicle(), Vehicle(), True)).decode()
        begun = line(start_of("straight")).decode()
        second = line(second_start_of("straight")).decode()
        attacked = line(second_step_of(step_of(1, Vehicle(), Vehicle(), True), [ORDER])).decode()
        cases = [
            ("", "a line of JSON expected"),
            ("[" * 60_000, "a line of JSON expected"),
            ("[1]", "an object with one field"),
            ('{"stop":{}}', "`start` or `step` expected, got `stop`"),
            ('{"step":1}', "step: an object expected, got the number 1"),
            (good.replace('"mode"', '"mood"'), "the field `mode` is missing"),
            (good.replace('"number": 1', '"number": 1.5'), "step.number: a whole number expected, got the number 1.5"),
            (good.replace('"number": 1', '"number": true'), "got a truth value"),
            (good.replace('"limit_m_s": 3.0', '"limit_m_s": NaN'), "NaN is no number"),
            (good.replace('"limit_m_s": 3.0', '"limit_m_s": 1e999'), "limit_m_s: a number expected"),
            (good.replace('"at": [0.0, 0.0]', '"at": [0.0]'), "step.fix.at: [east, north] expected"),
            (begun.replace("jsonl/1", "jsonl/3"), "protocol jsonl/1 or jsonl/2 expected, got jsonl/3"),
            (begun.replace("jsonl/1", "jsonl/2"), "start: the field `pose` is missing"),
            (second.replace('"medium"', '"sort"'), "start.body: the field `medium` is missing"),
            (second.replace('"height_m": 400.0', '"height_m": null'), "start.origin.height_m: a number expected, got null"),
            (attacked.replace('"rate_hz": 100.0', '"rate_hz": "fast"'), "step.bus[0].rate_hz: a number expected, got a text"),
            (begun.replace("[20.0, 0.0]", '["20", 0.0]'), "start.route[1]: [east, north] expected"),
            (begun.replace('"radius_m": 0.5', '"radius_m": null'), "start.obstacles[0].radius_m: a number expected"),
            (begun.replace('"half_m": [0.5, 0.3]', '"half_m": [0.5]'), "start.blocks[0].half_m: [length, width] expected"),
        ]
        for text, message in cases:
            with self.assertRaises(ProtocolError, msg=text[:80]) as caught:
                request(text.encode())
            self.assertIn(message, str(caught.exception))


class Replies(unittest.TestCase):
    def test_a_reply_leaves_out_missing_fields(self) -> None:
        self.assertEqual(Reply(1, 0).line(3), b'{"reply":{"number":3,"speed_m_s":1.0,"curvature_per_m":0.0}}\n')
        whole = json.loads(Reply(1.5, -0.1, state="GO", place=(1, 2), wake_s=0.2).line(1))
        self.assertEqual(whole["reply"]["place"], [1.0, 2.0])
        self.assertEqual((whole["reply"]["state"], whole["reply"]["wake_s"]), ("GO", 0.2))

    def test_a_value_out_of_range_is_refused(self) -> None:
        for speed, curvature, wake, place in [
            (float("nan"), 0, None, None),
            (101, 0, None, None),
            (0, -11, None, None),
            (0, 0, 1.5, None),
            (0, 0, None, (0.0, 1e9)),
        ]:
            with self.assertRaisesRegex(ValueError, "expected, got"):
                Reply(speed, curvature, wake_s=wake, place=place)

    def test_a_velocity_replaces_speed_and_curvature(self) -> None:
        velocity = json.loads(Reply(velocity=Velocity(1.0, turn_rad_s=-0.5)).line(3))["reply"]["velocity"]
        self.assertEqual(velocity, {"forward_m_s": 1.0, "left_m_s": 0.0, "up_m_s": 0.0, "turn_rad_s": -0.5})
        self.assertNotIn("speed_m_s", json.loads(Reply(velocity=Velocity(1.0)).line(3))["reply"])

    def test_a_reply_has_one_set_point(self) -> None:
        for speed, curvature, velocity in [(None, None, None), (1.0, None, None), (1.0, 0.0, Velocity(1.0)), (None, 0.0, Velocity(1.0))]:
            with self.assertRaisesRegex(ValueError, "speed_m_s and curvature_per_m expected, or velocity"):
                Reply(speed, curvature, velocity=velocity)

    def test_a_receipt_is_written_whole(self) -> None:
        receipt = Receipt(1, 5, 0, 1, False, "incompatible QoS")
        written = json.loads(Reply(1, 0, bus=[receipt]).line(3))["reply"]["bus"]
        self.assertEqual(written, [{"id": 1, "sent": 5, "received": 0, "honest": 1, "used": False, "why": "incompatible QoS"}])

    def test_a_wrong_part_of_a_reply_is_refused(self) -> None:
        wrong: list[Callable[[], object]] = [
            lambda: Velocity(101.0),
            lambda: Velocity(0.0, turn_rad_s=float("nan")),
            lambda: Receipt(1, -1, 0, 0, False),
            lambda: Receipt(1, 0, 0, 0, False, "x" * 81),
        ]
        for make in wrong:
            with self.assertRaisesRegex(ValueError, "expected, got"):
                make()


if __name__ == "__main__":
    unittest.main()
