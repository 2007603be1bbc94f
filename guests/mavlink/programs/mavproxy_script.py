"""MAVProxy with a script of its commands, typed as a person would: a line `#wait WORDS` waits until MAVProxy has printed the words.

    mavproxy_script.py PORT FOLDER SCRIPT...

MAVProxy itself takes such lines for comments. A line may have variables of the environment, as ${MAVLINK_WAYPOINTS}. `PASSPHRASE` is that
of a signed link. Output of MAVProxy goes to standard error, its files to the folder.
"""

import os
import string
import subprocess
import sys
from pathlib import Path
from typing import Iterator

WAIT = "#wait "
#: Modules of MAVProxy that a mission needs: without the rest it starts in a second.
MODULES = "log,signing,wp,mode,arm,cmdlong,link,param,misc"


def started(port: str, folder: str) -> "subprocess.Popen[bytes]":
    proxy = Path(sys.executable).with_name("mavproxy.py")
    # Its logs need 200 MB of free disk, more than a guest has.
    options = [f"--master=udpin:127.0.0.1:{port}", "--no-state", "--nowait", f"--default-modules={MODULES}"]
    return subprocess.Popen(
        [sys.executable, str(proxy), *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "HOME": folder},
        cwd=folder,
    )


def wait_for(words: str, output: "Iterator[str]", text: str) -> str:
    """Waits for words; the text behind them."""
    while words not in text:
        text += next(output)
    return text[text.index(words) + len(words) :]


def read(process: "subprocess.Popen[bytes]") -> Iterator[str]:
    assert process.stdout is not None
    while data := os.read(process.stdout.fileno(), 4096):
        sys.stderr.buffer.write(data)
        sys.stderr.flush()
        yield data.decode(errors="replace")


def main(port: str, folder: str, *scripts: str) -> None:
    key = os.environ.get("MAVLINK_KEY")
    words = {**os.environ, "PASSPHRASE": Path(key).read_text(encoding="utf-8").strip() if key else ""}
    process = started(port, folder)
    assert process.stdin is not None
    output, text = read(process), ""
    for line in "\n".join(Path(script).read_text(encoding="utf-8") for script in scripts).splitlines():
        if line.startswith(WAIT):
            text = wait_for(line[len(WAIT) :], output, text)
        elif line and not line.startswith("#"):
            process.stdin.write(string.Template(line).substitute(words).encode() + b"\n")
            process.stdin.flush()
    for _ in output:
        # It goes on as the other end of the link until it is ended.
        pass


if __name__ == "__main__":
    main(*sys.argv[1:])
