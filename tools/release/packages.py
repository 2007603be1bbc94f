"""The packages of a release of the program `holdsafe`: for `sbom` and `unsafe`.

Those on one platform with the named features, as cargo resolves them for a build of the program alone. Build scripts and their dependencies are
left out; a package that runs in the compiler alone (a procedural macro, or needed by these only) is marked. Python 3.11, standard library only.
"""

import argparse, json, pathlib, re, subprocess, tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
# A line of `cargo tree`: its depth, the package, and perhaps its folder and marks.
LINE = re.compile(r"(\d+) (\S+) v(\S+)")


class Package:
    def __init__(self, about, checksum):
        self.name, self.version, self.licence = about["name"], about["version"], about["license"]
        self.ours = about["source"] is None
        self.folder = pathlib.Path(about["manifest_path"]).parent
        self.checksum = checksum
        self.linked = False
        self.needs = set()


def options(description):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--target", default="x86_64-unknown-linux-gnu", help="platform")
    parser.add_argument("--features", default="", help="features of the program, with commas; none")
    return parser.parse_args()


def cargo(*words):
    return subprocess.run(["cargo", *words], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def tree(wanted, edges):
    """Pairs of a package and the one that needs it, by name and version; the program itself is needed by None."""
    chosen = ["--target", wanted.target, "--features", wanted.features]
    lines = cargo("tree", "--locked", "-p", "holdsafe", "-e", edges, "--prefix", "depth", "-f", " {p}", *chosen)
    above = []
    for line in lines.splitlines():
        depth, name, version = LINE.match(line).groups()
        del above[int(depth):]
        yield (name, version), above[-1] if above else None
        above.append((name, version))


def packages(wanted):
    """By name and version, in this order."""
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    checksums = {(one["name"], one["version"]): one.get("checksum") for one in lock}
    metadata = json.loads(cargo("metadata", "--locked", "--all-features", "--format-version", "1"))["packages"]
    every = {(one["name"], one["version"]): one for one in metadata}
    found = {}
    for key, needed_by in tree(wanted, "normal"):
        if key not in found:
            found[key] = Package(every[key], checksums[key])
        if needed_by:
            found[needed_by].needs.add(key)
    for key, _ in tree(wanted, "normal,no-proc-macro"):
        found[key].linked = True
    return dict(sorted(found.items()))
