"""What the operator is owed: of commands, of sessions at the broker, of the settings that a unit takes, of the age of what the
gateway and the unit accept of each other."""

from links import arrivals
from log import CLOCKS, SLACK, key, towards_safe

ANSWERED = 1_000_000  # within a second the display says what became of a command, and that a session was lost
ERROR_MM = 400  # of the last fix, there too
JUDGED = 20_000  # within so long of a datagram at the guard its record is judged; nothing else is there meanwhile if it came alone


def p7_commands(log):
    """None is shown as executed that was not, and none as under way for longer than a second."""
    safe = {k for _, k, kind in log.intents() if towards_safe(kind)}
    executed, due = {}, {}
    for t, k, _ in log.executed():
        executed.setdefault(k, t)
    for e in log.of("command_shown", by="console"):
        t, k, shown = e["t_us"], key(e["event"]["command"]), e["event"]["shown"]
        if shown == "executed" and executed.get(k, float("inf")) > t + SLACK:
            yield "P7", t, "shown as executed, and it was not"
        if shown in ("requested", "released"):
            due[k] = t + ANSWERED + SLACK
        elif shown != "sent" and not (shown == "staged" and k in safe):
            # It waits for the operator, or it is answered, or shown as not answered.
            if due.pop(k, t) < t:
                yield "P7", t, "shown as under way for too long"
    if "console" not in log.head["killed"]:
        for k, until in due.items():
            if until < log.end:
                yield "P7", until, "shown as under way to the end"


def p7_sessions(log):
    """A display that shows the unit as fresh shows each session that was lost at the broker."""
    lost = {}
    for e in log.of("session_lost"):
        peer, by = e["event"]["peer"], e["t_us"] + ANSWERED
        lost[peer] = lost.get(peer, 0) + 1
        told = any(s["event"]["peer"] == peer and s["event"]["times"] >= lost[peer] and s["t_us"] <= by for s in log.of("losses_shown"))
        dark = any(died <= by < again for died, again in log.dead("console"))
        if not told and not dark and by < log.end and fresh_at(log, e["node"], by):
            yield "P7", by, "nothing is shown of a session that was lost"


def fresh_at(log, who, t):
    """What the display last said of this unit; of the unit under test, where it is the gateway's session."""
    unit = who if who.startswith("unit-") else "unit-a"
    shown = [e["event"]["freshness"] for e in log.of("displayed") if e["event"]["unit"] == unit and e["t_us"] <= t]
    return shown[-1:] == ["fresh"]


def p8_sessions(log):
    """What leads away from safe and was given before the unit lost its session is not executed after it."""
    given = {}
    for t, k, _ in log.intents():
        given.setdefault(k, t)
    lost = [e["t_us"] for e in log.of("session_lost", by="unit-a")]
    for t, k, kind in log.executed():
        if not towards_safe(kind) and any(given.get(k, t) < at <= t for at in lost):
            yield "P8", t, "an order of before a lost session is executed after it"


def p4_settings(log):
    """No settings under which a unit that loses its place at the margin leaves the fence: docs/reference/bounds.md, *Settings*."""
    b = log.bounds
    blind = max(b["product_limit_ms"] + b["control_period_ms"], b["set_point_lease_ms"]) - log.reaction_ms  # what the fence guard has already taken off
    for e in log.of("executed"):
        kind = e["event"]["kind"]
        if e["event"]["refused"] is None and isinstance(kind, dict) and "configure" in kind:
            values = kind["configure"]
            if values["margin_mm"] < values["speed_mm_s"] * blind // 1000 + ERROR_MM:
                yield "P4", e["t_us"], "settings that lead out of the fence"


def p7_age(log):
    """Nothing is accepted that is older than Tf: at least as old as what lies between the relay's entry and the guard's."""
    held, limit = log.taken(), log.bounds["freshness_ms"] * 1000 + CLOCKS
    for node, interface, peer in (("gateway", "uplink", "unit-a"), ("unit-a", "downlink", "gateway")):
        mine = [e for e in log.of("accepted", by=node) if (e["event"]["at"], e["event"]["peer"]) == (interface, peer)]
        accepted = [e["t_us"] for e in mine]
        passed = [(a["t"], a["hash"]) for a in arrivals(log, node) if a["verdict"] == "passed"]
        for i, (t, payload) in enumerate(passed):
            if payload not in held or t - held[payload] <= limit:
                continue
            near = [at for at, _ in passed[max(0, i - 1) : i + 2] if abs(at - t) <= JUDGED]
            taken = [at for at in accepted if t <= at <= t + JUDGED]
            if len(near) == 1 and taken:
                yield "P7", taken[0], "accepted at %s and too old" % node
                break
