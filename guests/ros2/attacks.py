"""Attacks on the graph in lock-step: which messages the rogue sends in a step, and the receipts of what became of them.

Rates are per second of the vehicle's clock, so an attack does not depend on wall time. `silence` comes before a step's readings, forged
readings between these and `/clock`, forged commands after the node's own. The rogue is told by `rogue_link`, its messages are counted by
`witness`.
"""

import math
import secrets
from dataclasses import dataclass, field
from typing import Any, Optional

from conversion import Place
from graph import NAME, Graph
from holdsafe_guest import Order, Receipt, Step
from rogue_link import RogueLink, whole
from topics import CLOCK, ODOMETRY, PLAN, topic_of
from witness import Witness

#: Wall time for the rogue to start, s: within a step's own, where the first order starts it.
STARTS = 8.0
#: Wall time for the rogue's answer in a step, s.
ANSWERS = 1.0
#: Wall time for the witness to count messages that have been sent, or to discover a publisher, s.
COUNTS = 0.5
#: Wall time for a rogue that was late to be found in the graph, s.
SOON = 0.02
#: Wall time for the node to take forged readings, s.
TAKES = 0.03
#: Attacks before the readings of a step, and after the node's command; others are between the readings and `/clock`.
EARLY, LATE = {"silence"}, {"command", "replay_command", "listen"}
#: Attacks that make the node act on forged readings, so that more than one command may follow.
ON_INPUTS = {"odometry", "replay_odometry", "flood", "clock", "route"}
#: At most one act a step, and one without a rate.
SINGLE = {"silence", "parameter", "take_name", "listen"}
REPLAYS = {"replay_odometry", "replay_command"}
MOST_WHY = 80


@dataclass
class Progress:
    """One order since it was opened."""

    steps: int = 0
    #: True once the rogue has the publishers for it.
    opened: bool = False
    #: Messages sent, and answers of a service, in all steps.
    total: int = 0
    answered: int = 0
    #: What the rogue states for this step.
    step: dict[str, Any] = field(default_factory=dict)

    def due(self, order: Order, period_s: float) -> int:
        """Messages of this step: the first at once, and over time the rate."""
        if order.attack in SINGLE:
            return int(self.total == 0 or order.attack == "listen" or order.rate_hz > 0.0)
        before, now = (math.ceil(order.rate_hz * period_s * steps - 1e-9) for steps in (self.steps, self.steps + 1))
        return now - before


class Attacks:
    """The attacks of one trial after another, with one rogue process for all."""

    def __init__(self, link: RogueLink, at_start: bool, best_effort: bool) -> None:
        self.link, self.at_start, self.best_effort = link, at_start, best_effort
        self.witness: Optional[Witness] = None
        self.graph: Any = None
        self.progress: dict[int, Progress] = {}
        #: True once an order was carried out in this trial: node and graph are not as before then.
        self.begun = False
        #: True once the witness hears nothing of the honest poses any more.
        self.silenced = False

    def start(self, graph: Graph, period_s: float) -> bool:
        """A new trial; true if that has changed the graph."""
        kept = self.witness is not None and self.graph is graph and not self.begun and not self.link.failed
        if self.witness is not None and not kept:
            self.end()
        self.graph, self.period_s = graph, period_s
        self.progress, self.begun, self.silenced = {}, False, False
        if kept and self.witness is not None:
            self.witness.marks.clear()
        elif self.at_start:
            self._start_rogue()
        return self.at_start and not kept

    def _start_rogue(self) -> None:
        """The witness first, so that it is there when the rogue sends its first message."""
        self.witness = Witness(self.graph)
        self.mark = f"/mark_{secrets.token_hex(8)}"
        told = {
            "mark": self.mark,
            "command_topic": self.graph.command_topic,
            "command_type": self.graph.command_name,
            "best_effort": self.best_effort,
            "ours": [NAME, Witness.NAME],
        }
        if self.link.ask({"start": told}, STARTS) is not None:
            self._identify(COUNTS)

    def _identify(self, limit_s: float) -> bool:
        """True once the rogue's participant is known; until then none of its messages could be told from an honest one."""
        if self.witness is not None and self.graph.rogue is None and self.witness.identify(self.mark, limit_s) is not None:
            self.graph.rogue = self.witness.rogue
            participants = (self.graph.rogue, self.witness.prefix)
            self.graph.until(lambda: all(map(self.graph.is_heard_by, participants)), COUNTS)
        return self.graph.rogue is not None

    def begin_step(self, step: Step) -> None:
        """Opens the orders that are new in this step, and carries out those that come before its readings."""
        if step.bus and self.witness is None:
            self._start_rogue()
            self.graph.know_readers()
        if self.witness is None:
            return
        self.witness.begin_step()
        self.readings = step.fix is not None
        self.progress = {order.id: self.progress.get(order.id, Progress()) for order in step.bus}
        for progress in self.progress.values():
            progress.step = {}
        new = [order for order in step.bus if not self.progress[order.id].opened]
        if new and self._identify(SOON):
            self._open(new)
        self._act([order for order in step.bus if order.attack in EARLY], step)

    def _open(self, orders: list[Order]) -> None:
        """Publishers first: a message before readers have discovered its writer is lost by chance."""
        self.begun = True
        answer = self.link.ask({"open": [order.attack for order in orders]}, ANSWERS)
        for order in orders:
            self.progress[order.id].opened = answer is not None
        topics = answer.get("topics", []) if answer else []
        if self.witness and isinstance(topics, list):
            for topic in filter(self.witness.counts.__contains__, topics):
                self.witness.discover(topic, COUNTS)
            # The node's participant gets the announcement when the witness does, but nothing shows when it has taken it.
            self.graph.settle(COUNTS)

    def before_clock(self, step: Step) -> None:
        """After the honest readings."""
        if self.witness is None:
            return
        if self.readings and not self.silenced:
            self.silenced = not self.witness.until(lambda: self._count(ODOMETRY).honest > 0, COUNTS) and self._attacked("silence", step)
        self._act([order for order in step.bus if order.attack not in EARLY | LATE], step)
        if self.touches_inputs(step):
            # So that the node has taken forged readings before a timer fires, and a forged time before the honest one replaces it. Commands
            # show when it has, if it answers each reading.
            forged_time = any(order.attack == "clock" for order in step.bus)
            self.graph.until(lambda: not forged_time and self.has_answered_each(), TAKES)

    def after_command(self, step: Step) -> None:
        """After the node's command, which the base has."""
        if self.witness is None:
            return
        base, commands = self.graph.base, self._count(self.graph.command_topic)
        self.witness.until(lambda: commands.sequence >= base.sequence and self._count(CLOCK).honest > 0, COUNTS)
        self._act([order for order in step.bus if order.attack in LATE], step)
        self.graph.until(lambda: base.rogue >= commands.rogue, COUNTS)

    def _act(self, orders: list[Order], step: Step) -> None:
        if not orders or self.witness is None:
            return
        if not all(self.progress[order.id].opened for order in orders):
            for order in orders:
                self._note(order, {"why": self.link.why or "the rogue is not in the graph yet"})
            return
        for order in orders:
            if unread := self.witness.unread(self._topic(order.attack)):
                self._note(order, {"why": unread})
        orders = [order for order in orders if not self.witness.unread(self._topic(order.attack))]
        if orders:
            self._send(orders, step)

    def _send(self, orders: list[Order], step: Step) -> None:
        """Lets the rogue act, and waits until the witness has counted it."""
        assert self.witness is not None
        acts = [self._act_of(order, step) for order in orders]
        # Of this step alone: a rogue that was started late has not heard earlier ones.
        counts = {topic: self._count(topic) for topic in (ODOMETRY, CLOCK, self.graph.command_topic)}
        heard = {topic: count.sequence for topic, count in counts.items() if count.honest > 0}
        answer = self.link.ask({"act": acts, "heard": heard}, ANSWERS)
        done = answer.get("done") if answer else None
        for order in orders:
            stated = done.get(str(order.id)) if isinstance(done, dict) else None
            self._note(order, stated if isinstance(stated, dict) else {"why": self.link.why})
        for topic in {topic for order in orders if (topic := self._topic(order.attack))}:
            sent = sum(self._sent(order) for order in step.bus if self._topic(order.attack) == topic)
            self.witness.until(lambda: self._count(topic).rogue >= sent, COUNTS)

    def _act_of(self, order: Order, step: Step) -> dict[str, Any]:
        assert self.witness is not None
        progress = self.progress[order.id]
        act = {"id": order.id, "attack": order.attack, "amount": order.amount, "time_s": step.time_s, "first": progress.total == 0}
        act["count"] = progress.due(order, self.period_s)
        if order.attack == "listen":
            act["first"] = progress.steps == 0
        progress.steps += 1
        if order.attack in REPLAYS:
            act["sequence"] = self.witness.sequence_at(self._topic(order.attack) or "", step.time_s - order.amount)
        return act

    def _note(self, order: Order, stated: dict[str, Any]) -> None:
        progress = self.progress[order.id]
        progress.step = stated
        progress.total += whole(stated.get("sent"))
        progress.answered += whole(stated.get("answered"))

    def _topic(self, attack: str) -> Optional[str]:
        """The topic on which an attack publishes."""
        return topic_of(attack, self.graph.command_topic)

    def _sent(self, order: Order) -> int:
        return whole(self.progress[order.id].step.get("sent"))

    def _count(self, topic: str) -> Any:
        assert self.witness is not None
        return self.witness.counts[topic]

    def _attacked(self, attack: str, step: Step) -> bool:
        return any(order.attack == attack and self.progress[order.id].total > 0 for order in step.bus)

    def touches_inputs(self, step: Step) -> bool:
        return self.witness is not None and any(order.attack in ON_INPUTS for order in step.bus)

    def has_answered_each(self) -> bool:
        """True once the node has sent a command for each pose of the step, honest and forged: it can have no further one."""
        count = self._count(ODOMETRY)
        return bool(self.graph.base.honest >= count.honest + count.rogue > 0)

    def place(self) -> Optional[Place]:
        """The place that the node drives by, once an order may have changed it."""
        return self.witness.place() if self.witness is not None and self.begun else None

    def receipts(self, step: Step) -> list[Receipt]:
        """Those of the step's orders, at its end. Orders on one topic share what was received of it, the first one first."""
        if self.witness is None:
            return []
        left = {topic: count.rogue for topic, count in self.witness.counts.items()}
        made = [self._receipt(order, left) for order in step.bus]
        self.witness.mark(step.time_s)
        return made

    def _receipt(self, order: Order, left: dict[str, int]) -> Receipt:
        topic, sent = self._topic(order.attack), self._sent(order)
        if topic is None:
            return self._receipt_without_messages(order, sent)
        received = min(sent, left[topic])
        left[topic] -= received
        count, progress = self._count(topic), self.progress[order.id]
        newest = self.graph.base.from_rogue if topic == self.graph.command_topic else count.from_rogue
        why = progress.step.get("why")
        if why is None and received < sent and self.witness is not None:
            # A loss has no reason: one stands for a refusal.
            why = self.witness.refusal(topic)
        return Receipt(order.id, sent, received, count.honest, newest and progress.total > 0, short(why))

    def _receipt_without_messages(self, order: Order, sent: int) -> Receipt:
        """Attacks whose effect is not a message on a topic."""
        progress = self.progress[order.id]
        answered, why = whole(progress.step.get("answered")), progress.step.get("why")
        honest, used = self._count(self.graph.command_topic).honest, False
        if order.attack == "silence":
            count = self._count(ODOMETRY)
            # A heartbeat is no message: its receipt is the silence of the honest writer.
            honest, used, answered = count.honest, self.silenced, int(self.silenced and sent > 0)
            if self.silenced and sent == 0:
                why = why or f"no honest {ODOMETRY} after its number {count.sequence}"
        elif order.attack == "parameter":
            used = progress.answered > 0
        elif order.attack == "take_name" and sent > 0:
            assert self.witness is not None
            answered = int(self.witness.twins(COUNTS))
        elif order.attack == "listen":
            # A listener has no message of its own: it is given what passes.
            sent = answered
        return Receipt(order.id, sent, answered, honest, used, short(why))

    def end(self) -> None:
        """Takes rogue and witness out of the graph."""
        self.link.leave(ANSWERS)
        if self.witness is not None:
            self.witness.end()
            self.witness = None


def short(why: Any) -> Optional[str]:
    """A reason as a receipt may have it."""
    return None if why is None else str(why)[:MOST_WHY]
