"""A run's log, and what is asked of it often. Nothing is judged here."""

import math
from bisect import bisect_right

SLACK = 50_000  # what a log entry may lag behind what it tells, and a command take on its way
CLOCKS = 1_000  # what two clocks and two logs may differ by
STANDING = 50  # mm/s below which a plant stands
APART = 80_000  # between two places that a speed is taken from, at least

NOMINAL_MODES = ("READY", "PREPARE_TO_ACT")
RESTING_MODES = ("HOLD_SAFE", "IDLE")

IMAGING = ("rgb", "depth", "thermal", "lidar")  # sensors of frames
OLD = ("freeze", "skew")  # faults under which one of these shows old content under fresh stamps


def distance(a, b):
    return math.hypot(a["x_mm"] - b["x_mm"], a["y_mm"] - b["y_mm"])


class Log:
    """A run's events, by what they are."""

    def __init__(self, head, events):
        self.head, self.events = head, events
        self.bounds, self.camera, self.end = head["bounds"], head["camera"], head["duration_us"]
        self.reaction_ms = 100 + self.bounds["control_period_ms"]  # t0 of docs/reference/bounds.md
        self.by_kind = {}
        self.samples = None
        for e in events:
            self.by_kind.setdefault(e["event"]["is"], []).append(e)
        self.modes = [(0, "IDLE", "IDLE", "start")]
        for e in self.of("transition", "restarted"):
            if e["event"]["is"] == "restarted":
                if e["event"]["node"] == "unit-a":
                    self.modes.append((e["t_us"], self.modes[-1][2], "IDLE", "start"))
            elif e["node"] == "unit-a":
                ev = e["event"]
                self.modes.append((e["t_us"], ev["from"], ev["to"], ev["cause"]))
        self.mode_times = [m[0] for m in self.modes]

    def of(self, *kinds, by=None):
        """Events of these kinds, in order, of one node where one is named."""
        if len(kinds) == 1:
            found = self.by_kind.get(kinds[0], [])
        else:
            found = sorted((e for k in kinds for e in self.by_kind.get(k, [])), key=lambda e: e["t_us"])
        return [e for e in found if by is None or e["node"] == by]

    def mode_at(self, t):
        return self.modes[bisect_right(self.mode_times, t) - 1][2]

    def was_in(self, mode, since, until):
        return self.mode_at(since) == mode or any(since <= m[0] <= until and m[2] == mode for m in self.modes)

    def changes(self):
        return self.modes[1:]

    def guest(self):
        """Whether a guest drove, bare, and failed within the run; None without a guest."""
        engaged = self.of("guest_engaged", by="unit-a")
        if not engaged:
            return None
        failed = next((e for e in self.of("guest_failed", by="unit-a") if e["t_us"] <= self.end), None)
        return {"bare": engaged[0]["event"]["bare"], "failed": failed}

    def intents(self):
        return [(e["t_us"], key(e["event"]["command"]), e["event"]["kind"]) for e in self.of("intended", by="console")]

    def due(self):
        """By command: the time until it is due and for how long it then is, of those with a time tag."""
        tagged = (e["event"] for e in self.of("intended", by="console"))
        return {key(ev["command"]): (ev["tag"]["after"], ev["tag"]["within"]) for ev in tagged if ev.get("tag")}

    def executed(self):
        return [
            (e["t_us"], key(e["event"]["command"]), e["event"]["kind"])
            for e in self.of("executed", by="unit-a")
            if e["event"]["refused"] is None
        ]

    def taken(self):
        """When the relay took datagrams off their way, by hash: to send them later, or never."""
        found = {}
        for e in self.of("attack"):
            if e["event"]["action"] in ("delay", "reorder", "drop"):
                found.setdefault(e["event"]["hash"], e["t_us"])
        return found

    def truth(self):
        """Samples of the plant: speed in any direction as `moves`, mm/s; motion and set-point within its safe set, or at rest, as `safe`."""
        if self.samples is None:
            self.samples = []
            for e in self.of("truth", "margins"):
                if e["event"]["unit"] == "unit-a" and e["event"]["is"] == "truth":
                    self.samples.append((e["t_us"], dict(e["event"], stamp=e["local_us"])))
                elif e["event"]["unit"] == "unit-a" and self.samples:
                    self.samples[-1][1]["margins"] = e["event"]
            for i, (_, tr) in enumerate(self.samples):
                tr["moves"] = max(abs(tr["speed_mm_s"]), self.over_ground(i))
                own = tr.get("margins")
                tr["safe"] = own["safe"] >= 0 if own else tr["moves"] <= STANDING
                tr["asked_safe"] = own["asked"] >= 0 if own else abs(tr["set_speed_mm_s"]) <= STANDING
        return self.samples

    def over_ground(self, i):
        """The lower of the speeds since a place before and to one after, so that a stop is no motion; by the plant's own clock."""
        here = self.samples[i][1]
        before = (tr for _, tr in reversed(self.samples[:i]) if here["stamp"] - tr["stamp"] >= APART)
        after = (tr for _, tr in self.samples[i + 1 :] if tr["stamp"] - here["stamp"] >= APART)
        others = [found for found in (next(before, None), next(after, None)) if found]
        return min((int(distance(here, tr) / (abs(tr["stamp"] - here["stamp"]) / 1e6)) for tr in others), default=0)

    def turned(self, kind, node, on, since=0):
        """When something of a node was switched on, or off again."""
        return [
            e["t_us"] for e in self.of(kind) if e["event"]["node"] == node and e["event"]["on"] == on and e["t_us"] >= since
        ]

    def dead(self, node):
        """Spans in which a node did not live."""
        spans = []
        for e in self.of("ended"):
            if e["event"]["node"] == node:
                again = [r["t_us"] for r in self.of("restarted") if r["event"]["node"] == node and r["t_us"] >= e["t_us"]]
                spans.append((e["t_us"], again[0] if again else float("inf")))
        return spans

    def stopped(self, node):
        """Spans in which a node lived and did not run; of a slow one the longest stop that it may come to. At the end of a run
        everybody is let go on, to close its account."""
        spans = []
        for e in self.of("suspended"):
            if e["event"]["node"] != node or not e["event"]["on"]:
                continue
            over = [t for t in self.turned("suspended", node, False, e["t_us"]) if t > e["t_us"]]
            until = min(over[0] if over else self.end, self.end)
            if e["event"]["how"] != "hang":
                slow = e["event"]["how"]["slow"]
                until = min(until, e["t_us"] + slow["period"] * (1000 - slow["quota"]) // 1000)
            spans.append((e["t_us"], until))
        return spans

    def able(self, node, t):
        """When a node that hung at t could next do what was due then: one judgement after it runs again."""
        hung = {e["t_us"] for e in self.of("suspended") if e["event"]["how"] == "hang"}
        soon = self.bounds["control_period_ms"] * 1000 + SLACK
        return max([t] + [end + soon for start, end in self.stopped(node) if start in hung and start <= t])


def key(command):
    return (command["operator"], command["boot"], command["sequence"])


def key_of_record(record):
    return (record["node"], record["boot"], record["sequence"])


def kind_name(kind):
    return kind if isinstance(kind, str) else next(iter(kind))


def towards_safe(kind):
    """One step, without a reason or a second signature."""
    return kind_name(kind) in ("hold", "disarm")


def within(span, t):
    return span[0] <= t <= span[1]


def planned(plan):
    what = plan["what"]
    return (what, None) if isinstance(what, str) else next(iter(what.items()))
