"""The bridge: a guest of `jsonl/2` on one side, a MAVLink vehicle on the other, in real time.

A program for MAVLink lives in real time, so each step is answered no earlier than its time by the wall clock, with the set-point that
the vehicle has by then. Between steps the vehicle's thread goes on. Attacks are passed on to the relay; their receipts follow from the
datagrams that the ends have received.
"""

import random
import socket
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

import route
from autopilot import COMPONENT, NOWHERE, SYSTEM, Autopilot, Outcome, wait_until
from geodesy import Globe
from holdsafe_guest import Guest, Order, Receipt, Reply, Start, Step, Velocity
from link import Link, Record, key_of, open_socket, port_of
from processes import Helper, Program
from receipts import PROGRAM, VEHICLE, Arrivals, KernelWitness, Receipts, Witness

#: Ports below those that Linux gives out by itself.
PORTS = range(16384, 32768)
#: Words of the program's command that the bridge replaces.
PORT, ROUTE, WAYPOINTS, FOLDER = "{port}", "{route}", "{waypoints}", "{folder}"


@dataclass(frozen=True)
class Options:
    """Choices of the bridge's user."""

    #: The program's command.
    command: list[str]
    #: True to speak as ArduPilot, as MAVProxy needs it; else as PX4.
    ardupilot: bool = False
    #: Seconds of the vehicle's clock in one of real time.
    factor: float = 1.0
    #: File with the passphrase of a signed link.
    sign: Optional[str] = None
    #: True if the program signs by itself.
    signs_itself: bool = False
    #: Port that the program listens on; 0 for a free one.
    port: int = 0
    #: Real time until the first message of the program, s.
    ready_s: float = 30.0
    #: Parameters of the vehicle by name.
    parameters: dict[str, float] = field(default_factory=dict)


def reserved() -> socket.socket:
    """A socket on a free port, to be closed when the program starts, which takes the port.

    The kernel gives out no port of this range by itself: between the two, no other socket gets it but one of another bridge, by chance.
    """
    while True:
        try:
            return open_socket(random.choice(PORTS))
        except OSError:
            continue


class Bridge(Guest):
    """The guest, for one trial. `folder` is for the route and for files of the program."""

    def __init__(self, options: Options, folder: str) -> None:
        self.options, self.folder = options, folder
        self.autopilot: Optional[Autopilot] = None
        self.program: Optional[Program] = None
        self.helpers: list[Helper] = []
        #: Holds the program's port until the program starts.
        self.reserved: Optional[socket.socket] = None
        self.orders: list[Order] = []
        self.journal: list[Any] = []
        self.receipts, self.due_s, self.before_s = Receipts(), 0.0, 0.0
        self.steps = self.late = 0

    def start(self, start: Start) -> None:
        if self.autopilot is not None:
            raise RuntimeError("one trial for each process expected, got a second start")
        self.wheels = start.body is None or start.body.medium == "ground"
        self.before_s, self.due_s = start.time_s, time.monotonic()
        link = self.connect()
        self.autopilot = Autopilot(start, self.options.ardupilot, key_of(self.options.sign), link)
        for name, value in self.options.parameters.items():
            if not self.autopilot.parameters.change(name, value):
                raise ValueError(f"no parameter {name} that may be {value:g}; there are {', '.join(self.autopilot.parameters.names)}")
        route.write(Path(self.folder), start, Globe(start.origin or NOWHERE))
        if self.reserved is not None:
            self.reserved.close()
        self.program = Program(self.command(), self.environment(), self.folder)
        self.autopilot.begin()
        self.wait_for_program(self.autopilot, self.program)

    def connect(self) -> Link:
        """Starts the relay, and the signing end where the program has none."""
        key = key_of(self.options.sign)
        link = Link(SYSTEM, COMPONENT, key)
        self.port = self.options.port
        if not self.port:
            self.reserved = reserved()
            self.port = port_of(self.reserved)
        outer = self.port
        self.proxy: Optional[Helper] = None
        if key is not None and not self.options.signs_itself:
            self.proxy = self.helper("proxy.py", "--program", str(self.port), "--sign", str(self.options.sign))
            outer = self.proxy.first["relay"]
        ports = ["--vehicle", str(port_of(link.socket)), "--program", str(outer)]
        self.relay = self.helper("relay.py", *ports, "--factor", str(self.options.factor))
        link.peer = self.relay.first[VEHICLE]
        if self.proxy:
            self.proxy.tell({"relay": self.relay.first[PROGRAM]})
        self.vehicle_witness, self.proxy_witness = Witness(VEHICLE), Witness(PROGRAM)
        self.kernel_witness = KernelWitness(self.port, signed=key is not None)
        return link

    def helper(self, script: str, *options: str) -> Helper:
        made = Helper(script, *options)
        self.helpers.append(made)
        return made

    def words(self) -> dict[str, str]:
        folder = Path(self.folder)
        return {
            PORT: str(self.port),
            ROUTE: str(folder / route.ROUTE),
            WAYPOINTS: str(folder / route.WAYPOINTS),
            FOLDER: self.folder,
        }

    def command(self) -> list[str]:
        found = []
        for word in self.options.command:
            for name, value in self.words().items():
                word = word.replace(name, value)
            found.append(word)
        return found

    def environment(self) -> dict[str, str]:
        words = {f"MAVLINK_{name[1:-1].upper()}": value for name, value in self.words().items()}
        if self.options.sign:
            words["MAVLINK_KEY"] = self.options.sign
        # MAVSDK leaves a folder among the temporary files of a program that is killed.
        return {**words, "PYTHONUNBUFFERED": "1", "TMPDIR": self.folder}

    def wait_for_program(self, autopilot: Autopilot, program: Program) -> None:
        def ended() -> Optional[str]:
            sentence = program.ended()
            return sentence and sentence + refused(autopilot.link)

        if not wait_until(lambda: autopilot.heard > 0, self.options.ready_s, ended):
            raise TimeoutError(f"no message of {program.name} within {self.options.ready_s:g} s of real time{refused(autopilot.link)}")

    def step(self, step: Step) -> Reply:
        assert self.autopilot is not None and self.program is not None  # `serve` refuses a step before the start
        self.autopilot.step(step)
        if step.bus != self.orders:
            # An order of this step is open from the step's beginning.
            self.orders = list(step.bus)
            self.journal = self.told()["journal"]
        self.pace(step.time_s)
        self.program.note_end()
        self.steps += 1
        # The relay's report first: the datagrams in it are then at the sockets.
        report = self.told()
        outcome = self.autopilot.finish_step()
        return self.reply(outcome, self.receipt(report, outcome))

    def pace(self, time_s: float) -> None:
        """Waits for the step's time. A core that was late is not followed by a hurry: the program lives in real time."""
        now = time.monotonic()
        due = self.due_s + (time_s - self.before_s) / self.options.factor
        self.late += due < now
        self.due_s, self.before_s = max(due, now), time_s
        if self.due_s > now:
            threading.Event().wait(self.due_s - now)

    def told(self) -> dict[str, Any]:
        """The relay's report, after it was told the orders that are open."""
        report: dict[str, Any] = self.relay.ask({"orders": [vars(order) for order in self.orders]})
        return report

    def receipt(self, report: dict[str, Any], outcome: Outcome) -> list[Receipt]:
        """The receipts of the step."""
        report["journal"] = self.journal + report["journal"]
        self.journal = []
        at = {
            VEHICLE: self.vehicle_witness.match(report["journal"], outcome.records),
            PROGRAM: self.at_program(report["journal"]),
        }
        self.receipts.note(at, outcome.causes, outcome.follows)
        return [self.receipts.of(order, report, at) for order in self.orders]

    def at_program(self, journal: list[Any]) -> Arrivals:
        if self.proxy is None:
            return self.kernel_witness.match(journal)
        return self.proxy_witness.match(journal, [Record(**record) for record in self.proxy.ask({})])

    def reply(self, outcome: Outcome, receipts: list[Receipt]) -> Reply:
        motion, place = outcome.motion, outcome.place
        if self.wheels:
            return Reply(motion.forward, motion.curvature(), state=outcome.state, place=place, bus=receipts)
        velocity = Velocity(motion.forward, motion.left, motion.up, motion.turn)
        return Reply(state=outcome.state, place=place, velocity=velocity, bus=receipts)

    def end(self) -> None:
        if self.program:
            self.program.end()
        if self.autopilot:
            self.autopilot.end()
            link = self.autopilot.link
            print(f"mavlink: {self.steps} steps, {self.late} late, {link.received} datagrams, refused {link.refused}", file=sys.stderr)
        for helper in self.helpers:
            helper.end()


def refused(link: Link) -> str:
    """Words about refused datagrams, for an error."""
    return f"; {sum(link.refused.values())} datagrams refused: {', '.join(link.refused)}" if link.refused else ""
