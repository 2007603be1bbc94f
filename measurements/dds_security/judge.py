"""From runs to cells: pooled counts with exact intervals, the measured words, and the comparison with expected.toml."""

import math
import pathlib
import tomllib

KEPT_SHARE, RUNS, MESSAGES = 0.95, 3, 100
LEVELS = ("plain", "auth", "data", "meta", "sign", "encrypt")


def expectations(path=pathlib.Path(__file__).with_name("expected.toml")):
    return {attack["name"]: attack for attack in tomllib.loads(path.read_text())["attack"]}


def at_most(k, n, p):
    """Probability of at most k successes of n."""
    if p <= 0:
        return 1.0
    if p >= 1:
        return 1.0 if k >= n else 0.0
    log = lambda i: math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1) + i * math.log(p) + (n - i) * math.log1p(-p)
    return min(1.0, math.fsum(math.exp(log(i)) for i in range(k + 1)))


def bisected(is_below):
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if is_below(middle) else (low, middle)
    return (low + high) / 2


def clopper_pearson(k, n, error=0.05):
    """The exact interval of a share, k of n."""
    if n == 0:
        return [0.0, 1.0]
    low = 0.0 if k == 0 else bisected(lambda p: 1 - at_most(k - 1, n, p) < error / 2)
    high = 1.0 if k == n else bisected(lambda p: at_most(k, n, p) > error / 2)
    return [round(low, 5), round(high, 5)]


def reasons(attack, runs):
    """Reasons for which a cell is INVALID."""
    found = {run["invalid"] for run in runs if run["invalid"]}
    whole = [run for run in runs if "honest" in run]
    if len(runs) < RUNS:
        found.add(f"fewer than {RUNS} runs")
    if any(run["honest"]["before"][0] < KEPT_SHARE * run["honest"]["before"][1] for run in whole):
        found.add("honest messages were lost before the attack")
    if sum(run["honest"]["during"][1] for run in whole) < MESSAGES:
        found.add(f"fewer than {MESSAGES} honest messages")
    if attack["name"] != "control" and sum(run["attack_sent"] for run in whole) < MESSAGES and not found:
        found.add(f"fewer than {MESSAGES} messages of the attacker")
    return sorted(found)


def summed(runs, phase):
    return [sum(run["honest"][phase][part] for run in runs) for part in (0, 1)]


def from_attack_on(phases):
    return [a + b for a, b in zip(phases["during"], phases["after"])]


def words(expected_word, delivered, honest):
    """NONE belongs to the attack, which has no message to deliver; the other words are measured."""
    first = "NONE" if expected_word.startswith("NONE") else "DELIVERED" if delivered else "STOPPED"
    return f"{first} {'KEPT' if honest[0] >= KEPT_SHARE * honest[1] else 'LOST'}"


def agrees(measured, expected):
    return all(e in (m, "UNSTATED") for m, e in zip(measured.split(), expected.split()))


def cell(attack, level, runs):
    """One attack at one level, over all its runs."""
    whole = [run for run in runs if "honest" in run]
    delivered, sent = (sum(run[key] for run in whole) for key in ("delivered", "attack_sent"))
    phases = {phase: summed(whole, phase) for phase in ("before", "during", "after")}
    honest = from_attack_on(phases)
    measured = words(attack[level], delivered, honest)
    known = attack.get("known", {}).get(level)
    return {
        "attack": attack["name"], "level": level, "runs": len(runs), "invalid": reasons(attack, runs),
        "required": attack[level], "known": known, "measured": measured,
        "is_as_required": agrees(measured, attack[level]), "is_as_known": agrees(measured, known or attack[level]),
        "delivered": [delivered, sent], "delivered_interval": clopper_pearson(delivered, sent),
        "delivered_under_honest_guid": sum(run["delivered_under_honest_guid"] for run in whole),
        "honest": phases, "honest_interval": clopper_pearson(*honest),
        "words_of_runs": [words(attack[level], run["delivered"], from_attack_on(run["honest"])) for run in whole],
        "harm_m": [run["harm_m"] for run in whole],
        # Runs in which plant or node ended by itself.
        "crashed": sum(any(run["ended"][:2]) for run in whole),
        "sniffer_dropped": sum(run["sniffer_dropped"] for run in whole),
    }


def cells(runs):
    found = []
    for name, attack in expectations().items():
        for level in LEVELS:
            mine = [run for run in runs if run["attack"] == name and run["level"] == level]
            if mine and level in attack:
                found.append(cell(attack, level, mine))
    return found


def quantile(values, share):
    """The nearest rank."""
    ordered = sorted(values)
    return ordered[max(0, math.ceil(share * len(ordered)) - 1)]


def cost(level, runs):
    latency = [value for run in runs for value in run["latency_ms"]]
    sent = sum(run["sent"] for run in runs)
    middle = lambda key: quantile([run[key] for run in runs], 0.5)
    return {
        "level": level, "runs": len(runs), "sent": sent, "received": len(latency),
        "mean_ms": round(math.fsum(latency) / len(latency), 3),
        **{f"p{round(100 * share)}_ms": round(quantile(latency, share), 3) for share in (0.5, 0.95, 0.99)},
        "sender_cpu_s": middle("sender_cpu_s"), "receiver_cpu_s": middle("receiver_cpu_s"),
        "first_match_ms": sorted(run["first_match_ms"] for run in runs),
        "load": [round(run["load"], 2) for run in runs],
    }


def costs(runs):
    return [cost(level, mine) for level in LEVELS if (mine := [run for run in runs if run["level"] == level])]
