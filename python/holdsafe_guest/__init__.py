"""Guests of holdsafe in Python: the messages of the protocol `jsonl/1`, and the loop that answers them."""

from .messages import (
    MAX_LINE,
    PROTOCOL,
    Block,
    Disc,
    Fix,
    Odometry,
    Place,
    ProtocolError,
    Reply,
    Start,
    Step,
    Track,
)
from .serve import Guest, run, serve

__all__ = [
    "MAX_LINE",
    "PROTOCOL",
    "Block",
    "Disc",
    "Fix",
    "Guest",
    "Odometry",
    "Place",
    "ProtocolError",
    "Reply",
    "Start",
    "Step",
    "Track",
    "run",
    "serve",
]
