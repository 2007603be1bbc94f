"""The bridge between `jsonl/2` and a ROS 2 graph: each step as messages, the command in force at its end as the answer.

A step's readings go out first and `/clock` last; then the bridge waits for a command, so that node and vehicle move in lock-step. It
changes no command, but lets none through until an operator has enabled driving, as the motors' enable of a base does. The base acts on the
newest command at the end of the step, whoever sent it. Conversions are left to `conversion` and `readings`, topics to `graph`, attacks to
`attacks`, processes to `processes`.

The wheels have no `tf2_msgs`, so `/tf` and `/tf_static` are published only where that package is installed.
"""

import sys
import time
from dataclasses import dataclass
from typing import Any, Optional

from attacks import Attacks
from conversion import MAX_TURN, Place, drive, lost
from graph import Graph
from holdsafe_guest import Guest, Reply, Start, Step, Velocity
from processes import NodeProcess

#: A step is sent again after this time until the node has answered for the first time: it may not have discovered each topic yet, s.
AGAIN = 0.05
#: Wall time for an answer where none is expected, s: between two commands of a node with a timer, whose phase drifts against the
#: vehicle's clock, and without a pose.
BETWEEN = 0.02
#: Wall time without a command after which a node that gets forged readings has no further one, s.
QUIET = 0.05


@dataclass(frozen=True)
class Options:
    """What the user of the bridge chooses."""

    #: Topic of the node's commands.
    command_topic: str = "/cmd_vel"
    #: Wall time for an answer to a step, s.
    answer_s: float = 0.2
    #: Wall time until a publisher of commands is found, s.
    ready_s: float = 30.0
    #: Vehicle time between the node's commands, s: 0 for one a step.
    command_period_s: float = 0.0
    #: Frame of `/plan`: `map` and `odom` are one.
    plan_frame: str = "map"
    #: True if readings are best effort, which a reliable reader does not match.
    best_effort: bool = False
    #: True if commands go through while the operator has not enabled driving.
    unlocked: bool = False
    #: True if replies state the place last given on `/odom`.
    place: bool = True
    #: True if the node goes on over trials without an attack, and begins again where `/clock` jumps back.
    keep_node: bool = False


@dataclass
class Counts:
    """Steps of a run, by their answers."""

    steps: int = 0
    answered: int = 0
    #: Steps without an answer in time, in which the last command stood.
    missed: int = 0
    #: Commands to turn on the spot, or more sharply than the protocol has.
    lost_turns: int = 0


@dataclass
class Pace:
    """When the node answers, in one trial."""

    #: Time of the last step that was answered.
    answered_s: float = float("-inf")
    #: True once two commands have come the stated period apart: then steps between are waited for by `BETWEEN` alone.
    in_phase: bool = False
    #: True once a step went by without a command: further ones without a pose are then not waited for as long.
    silent: bool = False
    #: True once the node has answered.
    ever: bool = False


class Bridge(Guest):
    """The guest: one for all trials of its process."""

    def __init__(self, options: Options, node: NodeProcess, attacks: Attacks) -> None:
        self.options, self.process, self.attacks = options, node, attacks
        self.counts = Counts()
        self.graph: Optional[Graph] = None

    def start(self, start: Start) -> None:
        """A trial. The node is started again after an attack, which may have left something in it, or where it is not to be kept."""
        again = self.graph is not None
        if again and (self.attacks.begun or not self.options.keep_node):
            self.end_graph()
            self.process.start_again()
        if self.graph is None:
            self.graph = Graph(self.options.command_topic, self.options.best_effort, self.process.ended)
            self.graph.set_mission(start, self.options.plan_frame)
            self.graph.find_commands(self.options.ready_s)
        else:
            self.graph.base.command = None
            self.graph.set_mission(start, self.options.plan_frame)
            # The jump back, before the mission of this trial.
            self.graph.publish_clock(start.time_s)
        self.period_s, self.pace = start.period_s, Pace()
        self.wheels = start.body is None or start.body.medium == "ground"
        self.place: Place = start.pose.at if start.pose else (0.0, 0.0)
        self.graph.settle(self.options.ready_s)
        if self.attacks.start(self.graph, start.period_s):
            self.graph.settle(self.options.ready_s)
        self.graph.publish_mission()
        self.graph.wait_for_mission()

    def step(self, step: Step) -> Reply:
        graph, attacks, pace = self.ready(), self.attacks, self.pace
        graph.drain()
        graph.publish_mission()
        attacks.begin_step(step)
        self.publish(step)
        self.counts.steps += 1
        overdue = step.time_s >= pace.answered_s + self.options.command_period_s - self.period_s / 2.0
        without_pose = step.fix is None or attacks.silenced
        whole = (overdue or not pace.in_phase) and not (pace.silent and without_pose)
        answered = self.answer(step, self.options.answer_s if whole else BETWEEN)
        self.note(step, overdue, whole, answered)
        attacks.after_command(step)
        receipts = attacks.receipts(step)
        graph.before_s = step.time_s
        return self.reply(step, overdue and not answered, receipts)

    def ready(self) -> Graph:
        assert self.graph is not None  # a start comes before each step
        return self.graph

    def publish(self, step: Step) -> None:
        graph = self.ready()
        if step.fix is not None:
            self.place = step.fix.at
        graph.publish_readings(step)
        self.attacks.before_clock(step)
        graph.publish_clock(step.time_s)

    def answer(self, step: Step, limit_s: float) -> bool:
        """Waits for the first command after the step; false if none came within `limit_s`."""
        graph, end = self.ready(), time.monotonic() + limit_s
        while not graph.base.answered:
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            if not graph.until(lambda: graph.base.answered, min(left, AGAIN)) and not self.pace.ever:
                graph.publish_mission()
                graph.publish_readings(step)
                graph.publish_clock(step.time_s)
        if self.attacks.touches_inputs(step):
            self.wait_for_last(end)
        return True

    def wait_for_last(self, end: float) -> None:
        """Waits until the node has answered each forged reading, as far as it does: the last command is in force."""
        graph, count = self.ready(), -1
        while graph.base.honest != count and time.monotonic() < end and not self.attacks.has_answered_each():
            count = graph.base.honest
            graph.until(lambda: graph.base.honest != count, QUIET)

    def note(self, step: Step, overdue: bool, whole: bool, answered: bool) -> None:
        """Keeps when the node answers."""
        pace = self.pace
        pace.silent = not answered and (whole or pace.silent)
        if answered:
            # A timer that sees its first /clock fires at once, out of its phase.
            pace.in_phase = overdue and pace.answered_s > float("-inf")
            pace.answered_s, pace.ever = step.time_s, True
            self.counts.answered += 1
        elif overdue:
            pace.in_phase = False
            self.counts.missed += 1

    def reply(self, step: Step, missed: bool, receipts: Any) -> Reply:
        place = (self.attacks.place() or self.place) if self.options.place else None
        command = self.ready().base.command
        if command is None or (step.limit_m_s <= 0.0 and not self.options.unlocked):
            return Reply(0.0, 0.0, state="WAITING", place=place, bus=receipts)
        state = "HOLDING" if missed else "DRIVING"
        forward, turn = float(command.linear.x), float(command.angular.z)
        if self.wheels:
            self.counts.lost_turns += lost(forward, turn)
            speed, curvature = drive(forward, turn)
            return Reply(speed, curvature, state=state, place=place, bus=receipts)
        cut = min(max(turn, -MAX_TURN), MAX_TURN)
        velocity = Velocity(forward, float(command.linear.y), float(command.linear.z), cut)
        return Reply(velocity=velocity, state=state, place=place, bus=receipts)

    def end_graph(self) -> None:
        self.attacks.end()
        if self.graph is not None:
            self.graph.end()
            self.graph = None

    def end(self) -> None:
        counts = self.counts
        print(
            f"ros2: {counts.steps} steps, {counts.answered} answered, {counts.missed} missed, {counts.lost_turns} turns lost",
            file=sys.stderr,
        )
        self.end_graph()
