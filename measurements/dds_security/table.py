"""The result as Markdown: attacks by levels, findings, costs."""

from judge import LEVELS

OWN_LIBRARY = "its own library refuses the endpoint"


def is_of_own_library(cell):
    """INVALID because the insider's unchanged library refused the attack: the plant was not tested."""
    return cell["invalid"] == [OWN_LIBRARY]


def share(k, n):
    if n == 0:
        return "–"
    return "all" if k == n else "0" if k == 0 else f"{k:,} of {n:,}"


def honest_share(cell):
    """Delivered honest messages from the first message of the attack on, in per cent."""
    during, after = cell["honest"]["during"], cell["honest"]["after"]
    return f"{100 * (during[0] + after[0]) / (during[1] + after[1]):.0f} %"


def text(cell):
    if is_of_own_library(cell):
        return "own library"
    if cell["invalid"]:
        return "INVALID"
    attacker = "–" if cell["measured"].startswith("NONE") else share(*cell["delivered"])
    harm = max(cell["harm_m"])
    words = f"{attacker} · {honest_share(cell)}" + (f" · {harm:.1f} m" if harm > 0 else "")
    return words if cell["is_as_required"] else f"**{words}**"


def attack_rows(cells):
    found = {(cell["attack"], cell["level"]): cell for cell in cells}
    for name in dict.fromkeys(cell["attack"] for cell in cells):
        row = [text(found[name, level]) if (name, level) in found else "" for level in LEVELS]
        yield f"| `{name}` | {' | '.join(row)} |"


def difference_rows(cells):
    for cell in cells:
        if cell["invalid"]:
            yield f"- `{cell['attack']}`, {cell['level']}: INVALID, {'; '.join(cell['invalid'])}"
        elif not cell["is_as_required"]:
            known = "as published" if cell["is_as_known"] else "not expected"
            yield f"- `{cell['attack']}`, {cell['level']}: required {cell['required']}, measured {cell['measured']}, {known}"
        if len(set(cell["words_of_runs"])) > 1:
            yield f"- `{cell['attack']}`, {cell['level']}: its runs differ: {', '.join(cell['words_of_runs'])}"
        if cell["crashed"]:
            yield f"- `{cell['attack']}`, {cell['level']}: plant or node crashed in {cell['crashed']} runs"


def cost_rows(costs):
    for cost in costs:
        match = "/".join(f"{value:.0f}" for value in cost["first_match_ms"])
        yield (f"| {cost['level']} | {cost['mean_ms']:.3f} | {cost['p50_ms']:.3f} | {cost['p95_ms']:.3f} | {cost['p99_ms']:.3f} | "
               f"{cost['sender_cpu_s']:.3f} | {cost['receiver_cpu_s']:.3f} | {match} | {cost['received']:,} of {cost['sent']:,} |")


def page(result):
    head = "| attack | " + " | ".join(LEVELS) + " |\n|" + "---|" * (len(LEVELS) + 1)
    cost_head = ("| level | mean ms | p50 | p95 | p99 | sender CPU s | receiver CPU s | first match ms | messages |\n"
                 "|---|---|---|---|---|---|---|---|---|")
    parts = [
        f"# DDS Security, {result['date']}\n\n{len(result['runs'])} runs, {result['seconds']} s.\n",
        "Attacker's messages delivered · honest ones delivered from the attack's start · furthest beyond the wall. "
        "Bold: not as required.\n",
        head, *attack_rows(result["cells"]), "\nDifferences and INVALID cells:\n", *difference_rows(result["cells"]),
        "\n" + cost_head, *cost_rows(result["costs"]),
    ]
    return "\n".join(parts) + "\n"
