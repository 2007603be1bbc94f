"""The loop of a guest: one request in, one answer out, until the input ends.

A guest whose file has `reuse` gets a start for each trial, and `serve` makes a new guest for each. Standard output belongs to the
protocol, so `run` sends everything else that the process prints to standard error. Requests are left to `messages` and `reading`, answers
to `replies`.
"""

import os
import sys
import traceback
from typing import BinaryIO, Callable, NoReturn, Optional

from .messages import MAX_LINE, ProtocolError, Start, Step
from .reading import request
from .replies import READY, Reply


class Guest:
    """An autonomy program: told the mission once, then asked for a set-point each step."""

    def start(self, start: Start) -> None:
        """Takes the mission. Its limit of time is `start_ms` of the guest's file."""

    def step(self, step: Step) -> Reply:
        """The set-point of a step. Its limit of time is `step_ms` of the guest's file."""
        raise NotImplementedError


def serve(make: Callable[[], Guest], requests: BinaryIO, answers: BinaryIO) -> None:
    """Answers each line of `requests` with a line to `answers`, with a guest from `make` for each start.

    :raises ProtocolError: a request is no line of the protocol; the message begins with the line's number.
    """
    guest: Optional[Guest] = None
    number = 0
    while line := requests.readline(MAX_LINE + 1):
        number += 1
        try:
            asked = _asked(line, guest)
        except ProtocolError as error:
            raise ProtocolError(f"line {number}: {error}") from None
        if isinstance(asked, Start):
            guest = make()
            guest.start(asked)
            answer = READY
        else:
            assert guest is not None  # `_asked` refuses a step before the start
            answer = _receipted(guest.step(asked), asked).line(asked.number)
        answers.write(answer)
        answers.flush()


def _asked(line: bytes, guest: Optional[Guest]) -> "Start | Step":
    if len(line) > MAX_LINE:
        raise ProtocolError(f"at most {MAX_LINE} bytes expected, got more")
    asked = request(line)
    if guest is None and isinstance(asked, Step):
        raise ProtocolError("`start` expected, got `step`")
    return asked


def _receipted(reply: Reply, step: Step) -> Reply:
    """The reply, whose receipts are those of the step's orders: of an order without one nobody knows whether it was carried out."""
    expected, got = [order.id for order in step.bus], [receipt.id for receipt in reply.bus]
    if expected != got:
        raise ValueError(f"bus: receipts of the orders {expected} expected, in their order, got {got}")
    return reply


def run(make: Callable[[], Guest]) -> NoReturn:
    """Serves standard input and output, and ends the process: status 0 at the end of the input, 1 after an error of the guest's own
    code with its traceback on standard error, 2 after a request that is no line of the protocol."""
    sys.stdout.flush()
    answers = os.fdopen(os.dup(1), "wb")
    # Libraries write to descriptor 1 without asking Python.
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    try:
        serve(make, sys.stdin.buffer, answers)
    except ProtocolError as error:
        print(f"holdsafe_guest: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        # The other end is gone: the run is over.
        sys.exit(0)
    except Exception:
        traceback.print_exc()
        sys.exit(1)
    sys.exit(0)
