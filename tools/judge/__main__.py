#!/usr/bin/env python3
"""A second judge of a run: another language, another hand, the same question.

It reads the log that a run leaves as JSON lines (`events.jsonl`, see docs/reviewer/evidence.md) and says, from the text of the
properties in ARCHITECTURE.md and docs/ alone, which class the run belongs to. Nothing of the oracle is used. What it has
no rule for it says (`not_judged`) and then gives no class: to abstain is no agreement.

    python3 tools/judge runs/x/twin/delay/1/events.jsonl     # one object on stdout
    python3 tools/judge -                                    # many logs one behind the other, one object a line

Python 3.8, standard library only. Times are microseconds of trace time.
"""

import json
import sys

from log import Log
from verdict import judge

MAX_LINE = 1 << 20


class Unreadable(Exception):
    """Not a log of a run."""


def logs(lines):
    """The logs of a stream: each begins with a line that has bounds and no event."""
    head, events = None, []
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_LINE:
            raise Unreadable("line %d: longer than any of a log" % number)
        try:
            value = json.loads(line)
        except ValueError:
            raise Unreadable("line %d: not JSON" % number) from None
        if isinstance(value, dict) and "bounds" in value:
            if head is not None:
                yield Log(head, events)
            head, events = value, []
        elif isinstance(value, dict) and value.get("end") is True and head is not None:
            yield Log(head, events)
            head, events = None, []
        elif head is None or not isinstance(value, dict) or "event" not in value:
            raise Unreadable("line %d: not an event of a run" % number)
        else:
            events.append(value)
    if head is not None:
        yield Log(head, events)


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        source = sys.stdin if arguments[0] == "-" else open(arguments[0], encoding="utf-8")
        judged = 0
        for log in logs(source):
            print(json.dumps(judge(log)), flush=True)
            judged += 1
        if not judged:
            raise Unreadable("no log in it")
    except (Unreadable, OSError, UnicodeDecodeError) as error:
        print("judge: %s: %s" % (arguments[0], error), file=sys.stderr)
        return 2
    except (KeyError, TypeError, AttributeError, IndexError, StopIteration, ValueError) as error:
        print("judge: %s: not a log of a run: %r" % (arguments[0], error), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
