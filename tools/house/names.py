#!/usr/bin/env python3
"""Figures of the names and comments of the Rust sources: by crate, and in total.

    tools/house/names.py                 the table
    tools/house/names.py --list CRATE    each offending name and comment of a crate, with file and line
    tools/house/names.py --blocks CRATE  30 comment blocks of a crate, drawn at random, each with the code after it

Sources are `crates/**/*.rs` by crate, and `tests`, `measurements` and `fuzz` as a row each. A scanner of regular expressions reads them; text in
string literals is left out. Columns of the table:

fn %       functions whose whole name is an idiom: a word of IDIOMS, or of RELATIONS (a preposition that needs its noun), in per cent of all
           functions (`fn NAME`). Methods that a foreign trait names (FOREIGN) are left out.
one %      functions whose name is one word, in per cent of all functions: a figure to compare, not a fault by itself.
local %    locals whose whole name is a word of IDIOMS or RELATIONS and not of EXPECTED_LOCALS, in per cent of all locals. A local is a name that
           `let` or the parameters of a function or closure bind. `at` counts unless it is declared as `usize`: readers expect it for an index.
idiom      IDIOM_PHRASES and IDIOM_WORDS in 1,000 words of comments (`//`, `///`, `//!`).
open %     comment blocks that open with a word of OPENINGS, in per cent of all blocks. A block is adjacent lines of one marker.
meanings   names that more than MEANINGS public types (`pub struct`, `enum`, `trait`, `type`) of the whole project have, by their definitions;
           CONVENTIONS are left out.
"""

import argparse
import random
import re
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MEANINGS = 3
# Public names that have one meaning in every module: options of its command, configuration of its process.
CONVENTIONS = {"Args", "ProcessConfig"}

# Words of everyday speech that leave out which thing is meant.
IDIOMS = set(
    """
    told tell tells telling kept said says owed owes why what whose who how again otherwise gone away nothing nobody others other another anew
    ours theirs mine hers own alike apart alone once twice here there else likewise meanwhile then than thus yet still ever never far
    stands meant asked given taken came comes goes went got had has
    """.split()
)
# Prepositions and conjunctions that stand without their noun.
RELATIONS = set(
    """
    of at by with without within over under below above beside besides between among around along across behind through against about after
    before since until towards toward beyond near off on up down to upon via per because whether while where when
    """.split()
)
# Locals that a Rust reader expects: the other of two (`other: &Self`), `expected` and `got`, the ends of a range or an interval, two states that
# are compared, directions and the axes of a body or a track.
EXPECTED_LOCALS = set("other got to before after since until up down on off near far above below along across".split())
# Methods that a foreign trait, or a convention of the standard library, names.
FOREIGN = {"from", "into", "as", "then"}
OPENINGS = ("Of", "Those", "The same", "By", "From", "In")
IDIOM_WORDS = ("told", "owed", "owes", "whoever", "whosoever", "thereof", "therein", "wherein", "anew", "how-manyth", "befallen", "befalls",
               "befell", "hitherto")
IDIOM_PHRASES = (
    "stands in", "stand in", "stood in", "stands for", "stand for", "so many", "so much", "so long as", "of its own", "of their own", "those of",
    "as it were", "says so", "said so", "say so", "word of", "has a say", "of somebody", "of whoever", "for good", "goes by", "go by", "comes of",
    "is put to", "has it that", "what it is to", "whose own",
)

FN = re.compile(r"\bfn\s+([a-z_][A-Za-z0-9_]*)")
LET = re.compile(r"\blet\s+((?:[^=;{}\n]|\{[^{}=;]*\})+?)\s*(?::[^=;]*)?(?==|;)")
CLOSURE = re.compile(r"(?<![|\w)\]])(?:move\s+)?\|([^|\n;{}=]{1,160})\|")
TYPE = re.compile(r"\bpub\s+(?:struct|enum|trait|type)\s+([A-Z]\w*)")
BINDING = re.compile(r"(?<![\w:.&'])&?(?:ref\s+)?(?:mut\s+)?([a-z_][a-z0-9_]*)\b(?!\s*(?:::|\(|!|\{))")
COMMENT = re.compile(r"^\s*(//[/!]?)(?!/)(.*)$")
WORD = re.compile(r"[A-Za-z][A-Za-z']*(?:-[A-Za-z]+)*")
KEYWORDS = {"mut", "ref", "let", "if", "else", "dyn", "impl", "move", "self", "true", "false", "as", "in", "box", "_"}


class Figures:
    """Counts of one crate."""

    def __init__(self):
        self.functions, self.one_word, self.bare = 0, 0, []
        self.locals, self.bare_locals = 0, []
        self.words, self.idioms = 0, []
        self.blocks, self.openings = 0, []
        self.types = []
        self.prose = []

    def add(self, other):
        """Adds the counts of another crate."""
        for name, value in vars(other).items():
            setattr(self, name, getattr(self, name) + value)


def blank(source):
    """The source with the text of comments, strings and characters as spaces; line breaks stay."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|b?r(#*)".*?"\1|b?"(?:\\.|[^"\\])*"|b?\'(?:\\[^\n]{1,8}?|[^\\\n])\'', re.DOTALL)
    return pattern.sub(lambda found: re.sub(r"[^\n]", " ", found.group(0)), source)


def matching(code, start, pair="()"):
    """Index of the bracket that closes the one at `start`."""
    depth = 0
    for at in range(start, len(code)):
        if code[at] == pair[0]:
            depth += 1
        elif code[at] == pair[1]:
            depth -= 1
            if depth == 0:
                return at
    return len(code)


def split_arguments(text):
    """Parameters between commas that no bracket encloses, each with its offset."""
    depth, start, parts = 0, 0, []
    for at, char in enumerate(text):
        depth += {"(": 1, "[": 1, "{": 1, "<": 1, ")": -1, "]": -1, "}": -1}.get(char, 0)
        if char == ">" and text[at - 1 : at] not in ("-", "="):
            depth -= 1
        if char == "," and depth == 0:
            parts.append((start, text[start:at]))
            start = at + 1
    return parts + [(start, text[start:])]


def split_type(parameter):
    """The pattern of a parameter, and its type or an empty text."""
    found = re.search(r"(?<!:):(?!:)", parameter)
    return (parameter[: found.start()], parameter[found.end() :].strip()) if found else (parameter, "")


def bindings(pattern):
    """Names that a pattern binds, with their offsets."""
    return [(m.group(1), m.start(1)) for m in BINDING.finditer(pattern) if m.group(1) not in KEYWORDS]


def locals_of(code):
    """Names that `let`, functions and closures bind: name, offset, declared type."""
    for found in LET.finditer(code):
        declared = split_type(code[found.start(1) : found.end()].rstrip("=; "))[1] if ":" in found.group(0) else ""
        for name, offset in bindings(found.group(1)):
            yield name, found.start(1) + offset, declared
    for found in FN.finditer(code):
        opening = code.find("(", found.end())
        if code[found.end() : found.end() + 1] == "<":
            opening = code.find("(", matching(code, found.end(), "<>"))
        if opening < 0:
            continue
        for offset, parameter in split_arguments(code[opening + 1 : matching(code, opening)]):
            pattern, declared = split_type(parameter)
            for name, inner in bindings(pattern):
                if declared:
                    yield name, opening + 1 + offset + inner, declared
    for found in CLOSURE.finditer(code):
        for offset, parameter in split_arguments(found.group(1)):
            pattern, declared = split_type(parameter)
            for name, inner in bindings(pattern):
                yield name, found.start(1) + offset + inner, declared


def comment_blocks(source):
    """Adjacent comment lines of one marker: line number, text."""
    blocks, last = [], None
    for number, line in enumerate(source.splitlines(), 1):
        found = COMMENT.match(line)
        if not found:
            last = None
            continue
        if last == found.group(1):
            blocks[-1][1].append(found.group(2).strip())
        else:
            blocks.append((number, [found.group(2).strip()]))
        last = found.group(1)
    return [(number, " ".join(text)) for number, text in blocks]


def idioms(text):
    """Idioms in a comment."""
    low = " ".join(re.sub(r"`[^`]*`", " ", text).lower().split())
    hits = [word for word in IDIOM_WORDS for _ in re.findall(rf"(?<![\w-]){word}(?![\w-])", low)]
    return hits + [phrase for phrase in IDIOM_PHRASES for _ in re.findall(rf"(?<![\w-]){phrase}(?![\w-])", low)]


def opening(text):
    """The word of OPENINGS that a block opens with, or none."""
    return next((word for word in OPENINGS if re.match(rf"{word}\b", text)), None)


def read(path, figures):
    """Adds the figures of a file."""
    source = path.read_text()
    code = blank(source)
    where = str(path.relative_to(ROOT))
    line = lambda offset: code.count("\n", 0, offset) + 1
    for found in FN.finditer(code):
        name = found.group(1)
        figures.functions += 1
        figures.one_word += "_" not in name
        if name in (IDIOMS | RELATIONS) - FOREIGN:
            figures.bare.append((name, where, line(found.start(1))))
    for name, offset, declared in locals_of(code):
        figures.locals += 1
        if name in (IDIOMS | RELATIONS) - FOREIGN - EXPECTED_LOCALS and not (name == "at" and declared in ("usize", "&usize")):
            figures.bare_locals.append((name, where, line(offset)))
    for found in TYPE.finditer(code):
        figures.types.append((found.group(1), where, line(found.start(1))))
    for number, text in comment_blocks(source):
        figures.blocks += 1
        figures.words += len(WORD.findall(text))
        figures.prose.append((text, where, number))
        figures.idioms += [(idiom, where, number) for idiom in idioms(text)]
        if opening(text):
            figures.openings.append((opening(text), where, number))


def collect():
    """Figures by crate, in the order of names."""
    folders = {path.parent.name: path.parent for path in sorted((ROOT / "crates").rglob("Cargo.toml"))}
    folders |= {name: ROOT / name for name in ("tests", "measurements", "fuzz")}
    result = {}
    for name, folder in folders.items():
        figures = result[name] = Figures()
        for path in sorted(folder.rglob("*.rs")):
            if "target" not in path.relative_to(folder).parts:
                read(path, figures)
    return result


def share(part, whole, scale=100.0):
    """A part in per cent of the whole, or in another scale."""
    return scale * part / whole if whole else 0.0


def row(name, figures):
    """A line of the table."""
    return (
        f"{name:14}{figures.functions:7}{share(len(figures.bare), figures.functions):7.1f}{share(figures.one_word, figures.functions):7.0f}"
        f"{figures.locals:8}{share(len(figures.bare_locals), figures.locals):8.1f}{figures.words:9}"
        f"{share(len(figures.idioms), figures.words, 1000.0):7.1f}{figures.blocks:8}{share(len(figures.openings), figures.blocks):7.1f}"
    )


def several(types):
    """Names with more than MEANINGS definitions, most first."""
    counts = Counter(name for name, _, _ in types)
    return [(name, count) for name, count in counts.most_common() if count > MEANINGS and name not in CONVENTIONS]


def table(crates):
    """The table of every crate, and the names that stand for several types."""
    print(f"{'crate':14}{'fns':>7}{'fn %':>7}{'one %':>7}{'locals':>8}{'local %':>8}{'words':>9}{'idiom':>7}{'blocks':>8}{'open %':>7}")
    total = Figures()
    for name, figures in crates.items():
        print(row(name, figures))
        total.add(figures)
    print(row("total", total))
    for title, hits in (("functions", total.bare), ("locals", total.bare_locals), ("idioms", total.idioms)):
        print(f"{title}: " + ", ".join(f"{name} {count}" for name, count in Counter(hit[0] for hit in hits).most_common(24)))
    print("meanings: " + ", ".join(f"{name} {count}" for name, count in several(total.types)))


def offences(name, crates):
    """Each offending name and comment of a crate."""
    figures = crates[name]
    shared = dict(several([kind for each in crates.values() for kind in each.types]))
    types = [hit for hit in figures.types if hit[0] in shared]
    for kind, hits in (("fn", figures.bare), ("local", figures.bare_locals), ("idiom", figures.idioms), ("open", figures.openings), ("type", types)):
        for word, path, line in hits:
            print(f"{path}:{line}: {kind} {word}")


def blocks(name, crates, seed):
    """30 comment blocks of a crate, each with the three lines after it."""
    files = defaultdict(list)
    for text, path, line in random.Random(seed).sample(crates[name].prose, min(30, len(crates[name].prose))):
        files[path].append((line, text))
    for path in sorted(files):
        lines = (ROOT / path).read_text().splitlines()
        for line, text in sorted(files[path]):
            after = [each for each in lines[line - 1 :] if not COMMENT.match(each)][:3]
            print(f"{path}:{line}: {text}\n" + "\n".join(f"    {each}" for each in after))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", metavar="CRATE", help="each offending name and comment of a crate, with file and line")
    parser.add_argument("--blocks", metavar="CRATE", help="30 comment blocks of a crate, drawn at random")
    parser.add_argument("--seed", type=int, default=1, help="seed of the draw of --blocks")
    arguments = parser.parse_args()
    crates = collect()
    for chosen in (arguments.list, arguments.blocks):
        if chosen and chosen not in crates:
            parser.error(f"no crate {chosen}: {', '.join(crates)}")
    if arguments.list:
        offences(arguments.list, crates)
    elif arguments.blocks:
        blocks(arguments.blocks, crates, arguments.seed)
    else:
        table(crates)


if __name__ == "__main__":
    main()
