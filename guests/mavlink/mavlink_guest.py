"""An unmodified MAVLink program as a guest: the bridge is the vehicle that the program flies, and starts and ends the program.

    mavlink_guest.py [options] -- command of the program

In the command, {port} stands for the port that the program listens on, {route} and {waypoints} for the files with the mission, {folder}
for a folder that is removed at the end. The environment has the same as MAVLINK_PORT, MAVLINK_ROUTE, MAVLINK_WAYPOINTS and
MAVLINK_FOLDER, and the key's file as MAVLINK_KEY.
"""

import argparse
import shutil
import signal
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "python"))

from bridge import Bridge, Options
from holdsafe_guest import run


def parsed() -> Options:
    parser = argparse.ArgumentParser(description="An unmodified MAVLink program as a guest of holdsafe.")
    parser.add_argument("--ardupilot", action="store_true", help="speak as ArduPilot, for MAVProxy; else as PX4")
    parser.add_argument("--factor", type=positive, default=1.0, help="seconds of the vehicle's clock in one of real time")
    parser.add_argument("--sign", metavar="FILE", help="sign the link with the key of the passphrase in FILE, and refuse unsigned messages")
    parser.add_argument("--signs-itself", action="store_true", help="the program signs: no signing end beside it")
    parser.add_argument("--port", type=int, default=0, help="port that the program listens on; by default a free one")
    parser.add_argument("--ready-s", type=positive, default=30.0, help="real time until the program's first message")
    parser.add_argument("--parameter", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the vehicle")
    parser.add_argument("command", nargs="+", help="the program's command, after --")
    asked = parser.parse_args()
    parameters = {name: float(value) for name, _, value in (text.partition("=") for text in asked.parameter)}
    return Options(
        command=asked.command,
        ardupilot=asked.ardupilot,
        factor=asked.factor,
        sign=asked.sign,
        signs_itself=asked.signs_itself,
        port=asked.port,
        ready_s=asked.ready_s,
        parameters=parameters,
    )


def positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"more than 0 expected, got {text}")
    return value


def main() -> None:
    options = parsed()
    folder = tempfile.mkdtemp(prefix="mavlink-guest-")
    # As an exception, so that the program is ended here and not by the warden alone.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    bridge = Bridge(options, folder)
    try:
        run(lambda: bridge)
    except KeyboardInterrupt:
        sys.exit(1)
    finally:
        bridge.end()
        # The program's warden has removed it, if there was a program.
        shutil.rmtree(folder, ignore_errors=True)
        sys.stderr.flush()


if __name__ == "__main__":
    main()
