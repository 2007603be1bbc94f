"""The three programs as processes, and their reports."""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import threading
import time

from credentials import DOMAIN

HERE = pathlib.Path(__file__).resolve().parent
BUILD = HERE / ".build"
# A program that reports less than this long is taken for hung.
PATIENCE_S = 12
# Escape sequences of the library's coloured lines.
COLOURS = re.compile("\x1b\\[[0-9;]*m")


class Process:
    """One program; its lines are read as they come."""

    def __init__(self, program, options, credentials=None, preload=None, is_live=True):
        words = [str(BUILD / program), "--domain", str(DOMAIN), *map(str, options)]
        if credentials:
            words += ["--credentials", str(credentials)]
        if is_live:
            words += ["--lines", "yes"]
        environment = {**os.environ, **({"LD_PRELOAD": str(preload)} if preload else {})}
        self.lines, self.log = [], tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True, env=environment
        )
        self.reading = threading.Thread(target=self.read, daemon=True)
        self.reading.start()

    def read(self):
        for line in self.process.stdout:
            self.lines.append(json.loads(line))

    def all(self, event, **fields):
        lines = list(self.lines)
        return [l for l in lines if l["event"] == event and all(l.get(key) == value for key, value in fields.items())]

    def wait_for(self, event, patience=PATIENCE_S, **fields):
        """The first such line; none if the program ends or the patience does."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            if found := self.all(event, **fields):
                return found[0]
            if self.process.poll() is not None and not self.reading.is_alive():
                return None
            time.sleep(0.01)
        return None

    def guid(self, event, topic=None):
        """GUID of the participant, or of its writer or reader of a topic, as bytes; empty where its library refused it."""
        fields = {"topic": topic} if topic else {}
        found = self.wait_for(event, **fields)
        return bytes.fromhex(found["guid"]) if found else b""

    def contents(self, event, since=0.0, **fields):
        return [bytes.fromhex(line["bytes"]) for line in self.all(event, **fields) if line["t"] >= since]

    def printed(self):
        self.log.seek(0)
        return [COLOURS.sub("", line) for line in self.log.read().splitlines() if line.strip()]

    def complaints(self):
        """Lines that the library printed."""
        return [line for line in self.printed() if not line.startswith("key ")]

    def handed_keys(self):
        """Lines of keys.so: they end with the run, as its keys do."""
        return [line for line in self.printed() if line.startswith("key ")]

    def signal(self):
        try:
            self.process.stdin.write("\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass

    def stop(self):
        """Tells the program to end, and kills it if it does not."""
        self.signal()
        try:
            self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.reading.join(PATIENCE_S)
        return self.process.returncode
