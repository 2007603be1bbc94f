"""The loop of a guest, in this process and as a process of its own."""

import io
import json
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Callable

from holdsafe_guest import MAX_LINE, Guest, ProtocolError, Receipt, Reply, Start, Step, serve

from .driver import Vehicle, second_start_of, second_step_of, start_of, step_of

PACKAGE = Path(__file__).resolve().parents[1]
START = json.dumps(start_of("straight")).encode() + b"\n"
STEP = json.dumps(step_of(1, Vehicle(), Vehicle(), True)).encode() + b"\n"
ORDER = {"id": 4, "attack": "clock", "rate_hz": 20.0, "amount": 5.0}
ATTACKED = json.dumps(second_step_of(step_of(1, Vehicle(), Vehicle(), True), [ORDER])).encode() + b"\n"
SECOND = json.dumps(second_start_of("straight")).encode() + b"\n"


class Slow(Guest):
    def step(self, step: Step) -> Reply:
        return Reply(min(0.5, step.limit_m_s), 0.0)


class Counting(Guest):
    """Its speed is the number of its steps since its start, and each order has a receipt."""

    def start(self, start: Start) -> None:
        self.steps = 0

    def step(self, step: Step) -> Reply:
        self.steps += 1
        return Reply(float(self.steps), 0.0, bus=[Receipt(order.id, 1, 1, 1, True) for order in step.bus])


def served(lines: bytes, make: Callable[[], Guest] = Slow) -> bytes:
    answers = io.BytesIO()
    serve(make, io.BytesIO(lines), answers)
    return answers.getvalue()


def ran(body: str, lines: bytes) -> tuple[int, bytes, str]:
    """Status, standard output and standard error of a guest whose step has this body."""
    program = "import os\nfrom holdsafe_guest import *\nclass G(Guest):\n    def step(self, step):\n        " + body + "\nrun(G)\n"
    done = subprocess.run([sys.executable, "-c", program], input=lines, capture_output=True, cwd=PACKAGE, check=False)
    return done.returncode, done.stdout, done.stderr.decode()


class Loop(unittest.TestCase):
    def test_each_request_has_one_answer(self) -> None:
        answers = served(START + STEP).splitlines()
        self.assertEqual(answers[0], b'{"ready":{}}')
        self.assertEqual(json.loads(answers[1]), {"reply": {"number": 1, "speed_m_s": 0.5, "curvature_per_m": 0.0}})

    def test_each_start_has_a_new_guest(self) -> None:
        answers = [json.loads(line) for line in served(SECOND + STEP + STEP + SECOND + STEP, Counting).splitlines()]
        self.assertEqual([answer["reply"]["speed_m_s"] for answer in answers if "reply" in answer], [1.0, 2.0, 1.0])
        self.assertEqual(sum("ready" in answer for answer in answers), 2)

    def test_an_order_has_a_receipt(self) -> None:
        answers = served(SECOND + ATTACKED, Counting).splitlines()
        self.assertEqual([receipt["id"] for receipt in json.loads(answers[1])["reply"]["bus"]], [4])

    def test_an_order_without_a_receipt_is_an_error(self) -> None:
        with self.assertRaisesRegex(ValueError, r"bus: receipts of the orders \[4\] expected, in their order, got \[\]"):
            served(SECOND + ATTACKED)

    def test_a_step_before_the_start_is_refused(self) -> None:
        with self.assertRaisesRegex(ProtocolError, "line 1: `start` expected, got `step`"):
            served(STEP)

    def test_a_long_line_is_not_read(self) -> None:
        with self.assertRaisesRegex(ProtocolError, f"line 2: at most {MAX_LINE} bytes"):
            served(START + b" " * MAX_LINE + STEP)


class Processes(unittest.TestCase):
    def test_the_end_of_input_is_no_error(self) -> None:
        status, output, errors = ran("return Reply(0.0, 0.0)", START + STEP)
        self.assertEqual((status, output.count(b"\n"), errors), (0, 2, ""))

    def test_printing_does_not_reach_the_protocol(self) -> None:
        body = "print('seen'); os.write(1, b'raw\\n'); return Reply(0.0, 0.0)"
        status, output, errors = ran(body, START + STEP)
        self.assertEqual((status, output.count(b"\n")), (0, 2))
        self.assertTrue("seen" in errors and "raw" in errors)

    def test_an_error_of_the_guest_is_traced(self) -> None:
        for body, message in [("return 1 / 0", "ZeroDivisionError"), ("return Reply(1e9, 0.0)", "speed_m_s: -100 to 100")]:
            status, output, errors = ran(body, START + STEP)
            self.assertEqual((status, output.count(b"\n")), (1, 1))
            self.assertIn("Traceback", errors)
            self.assertIn(message, errors)

    def test_a_broken_request_has_its_own_status(self) -> None:
        status, _, errors = ran("return Reply(0.0, 0.0)", START + b"{\n")
        self.assertEqual(status, 2)
        self.assertTrue(errors.startswith("holdsafe_guest: line 2: "), errors)


if __name__ == "__main__":
    unittest.main()
