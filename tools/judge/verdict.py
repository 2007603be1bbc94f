"""The one class of a run: the first that matches, from UNSAFE down to NOMINAL."""

from control import p4_settings, p7_age, p7_commands, p7_sessions, p8_sessions
from disguise import seen_through
from guards import p1_witnessed
from log import NOMINAL_MODES
from mission import mission, stuck
from owed import p2_p3_processes
from place import p3_lost, p5_distrusted
from plant import p8_effects, speeds
from properties import p1_lifetime, p1_p11_acts, p2, p3_link, p3_operator, p3_place, p4, p5, p6, p7, p8, p9, p10, p12
from receipts import receipts, sensor_faults

UNSAFE = {"P1", "P4", "P5", "P7", "P8", "P9", "P11", "P12"}
RULES = (
    p1_p11_acts, p1_lifetime, p3_link, speeds, p3_operator, p4, p5, p6, p7, p8, p9, p10, p12,
    p2_p3_processes, p3_lost, p5_distrusted, p4_settings, p7_age, p7_commands, p7_sessions, p8_sessions, p8_effects,
)
VERDICT = 5_000  # how soon after a message on shared memory the verdict over it is in the log


def responded(log, zero):
    """Whether anything was refused or shown as an alarm from then on."""
    if refused_in_memory(log, zero) or seen_through(log, zero) or refused_on_guest_bus(log, zero):
        return True
    for e in log.of("refused", "guard_saw", "stream_saw", "command_shown", "losses_shown", "displayed"):
        ev, t = e["event"], e["t_us"]
        if t < zero:
            continue
        if ev["is"] == "refused":
            if not in_memory(ev["at"]):
                return True
        elif ev["is"] == "guard_saw":
            if ev["verdict"] != "passed":
                return True
        elif ev["is"] == "stream_saw":
            if ev["sight"] == "refused":
                return True
        elif ev["is"] == "command_shown":
            if ev["shown"] == "not_acknowledged":
                return True
        elif ev["is"] == "losses_shown":
            return True
        elif ev["unit"] == "unit-a" and ev["freshness"] in ("stale", "lost") and t < log.end:
            return True
    return any(e["event"]["account"] == "discarded" and e["event"]["n"] > 0 for e in log.of("count"))


def refused_on_guest_bus(log, zero):
    """Whether the attacked end of a guest's bus refused everything from then on."""
    steps = [e["event"] for e in log.of("guest_bus") if e["t_us"] >= zero]
    refused = any(ev["refused"] for ev in steps)
    return refused and not any(ev["in_force"] or (ev["sent"] > 0 and not ev["refused"]) for ev in steps)


def in_memory(interface):
    return isinstance(interface, dict) and "bus" in interface


def refused_in_memory(log, zero):
    """Whether a reader of shared memory refused what an insider had put there. Services refuse there what came late of itself,
    too, and an older boot is the honest producer's whose place an insider took: neither answers the attack."""
    refused, counted = {}, {}
    for e in log.of("refused"):
        if in_memory(e["event"]["at"]):
            refused.setdefault((e["node"], e["event"]["at"]["bus"]), []).append((e["t_us"], e["event"]["reason"] != "epoch"))
    for e in log.of("count"):
        account = e["event"]["account"]
        if isinstance(account, dict) and "refused" in account and in_memory(account["refused"][0]) and account["refused"][1] != "epoch":
            place = (e["node"], account["refused"][0]["bus"])
            counted[place] = counted.get(place, 0) + e["event"]["n"]
    for e in log.of("mouth_saw", by="campaign"):
        ev, t = e["event"], e["t_us"]
        if t < zero or not in_memory(ev["at"]):
            continue
        place = (ev["reader"], ev["at"]["bus"])
        told = refused.get(place, [])
        if any(answers and t <= at <= t + VERDICT for at, answers in told):
            return True
        # Of the many only the first are written; then the closing account tells.
        if counted.get(place, 0) > sum(answers for _, answers in told) and all(at <= t for at, _ in told):
            return True
    return False


def false_trips(log, zero):
    until = float("inf") if not log.head["planned"] or zero is None else zero
    trips = 0
    for t, frm, to, cause in log.changes():
        restricted = frm in NOMINAL_MODES and to in ("DEGRADED", "HOLD_SAFE") and cause != "operator"
        lost = frm == "PREPARE_TO_ACT" and to == "READY" and cause.startswith("lost:")
        trips += t < until and (restricted or lost)
    return trips


def latency(log, zero):
    def first(test):
        return next(((c[0] - zero) / 1000.0 for c in log.changes() if c[0] >= zero and test(c)), None)

    return {
        "to_degraded": first(lambda c: c[2] in ("DEGRADED", "HOLD_SAFE") and c[3] != "operator"),
        "to_hold_safe": first(lambda c: c[2] == "HOLD_SAFE" and c[3] != "operator"),
    }


def parked(log):
    """Of a dead unit only its plant can be believed: it stands, and nothing drives it."""
    truth = log.truth()
    still = truth and not truth[-1][1]["leased"] and truth[-1][1]["safe"]
    return bool(still) and any(e["event"]["node"] == "unit-a" for e in log.of("ended"))


def of_failed_guest(log, failed, found, whole, unknown):
    if any(p in ("P2", "P3") and t <= failed["t_us"] for p, t, _ in found):
        if unknown:
            return None
        if whole:
            return "LATE"
    stalled = any(e["event"]["by"] > log.head["stall_limit_us"] for e in log.of("stalled"))
    return "INVALID" if stalled and failed["event"]["fault"] in ("silent", "not_started") else "GUEST_FAILED"


def classify(log, found, whole, unknown, trips, zero, missing):
    """The first that matches; None where something that it hangs on is not judged."""
    broken = {p for p, _, _ in found}
    if log.head["custody"]:
        return "INVALID"
    if log.guest() is not None and log.guest()["bare"]:
        return None  # most rules here are about guards and modes, of which a bare guest has none
    if broken & UNSAFE:
        return "UNSAFE"
    guest = log.guest()
    if guest is not None and guest["failed"]:
        return of_failed_guest(log, guest["failed"], found, whole, unknown)
    if unknown:
        return None
    if not whole or broken & {"P6", "P10"}:
        return "INVALID"
    if broken & {"P2", "P3"}:
        return "LATE"
    if trips:
        return "FALSE_TRIP"
    if missing:
        return "INVALID"
    if zero is None:
        return "STUCK" if stuck(log) else "NOMINAL"
    after = [c[2] for c in log.changes() if c[0] >= zero and c[3] != "operator"]
    if "HOLD_SAFE" in after or parked(log):
        return "HOLD_SAFE"
    if "DEGRADED" in after:
        return "DEGRADED"
    return "REJECTED" if responded(log, zero) else "UNDETECTED"


def judge(log):
    faults = sensor_faults(log)
    whole, zero, unknown = receipts(log, faults)
    found = [finding for rule in RULES for finding in rule(log)]
    found += [finding for rule in (p1_witnessed, p2, p3_place) for finding in rule(log, faults)]
    trips = false_trips(log, zero)
    missing = mission(log, zero)
    return {
        "outcome": classify(log, found, whole, unknown, trips, zero, missing),
        "broken": sorted({p for p, _, _ in found}),
        "findings": ["%s at %d ms: %s" % (p, t // 1000, what) for p, t, what in sorted(found, key=lambda f: f[1])[:20]],
        "mission": missing,
        "stuck": stuck(log),
        "receipt": None if unknown else whole,
        "not_judged": sorted(unknown),
        "false_trips": trips,
        "latency_ms": latency(log, zero) if zero is not None and not unknown else {},
    }
