"""Objects made to look like something else: the sim says where they stand, perception what it takes them for or doubts."""

from math import atan2, cos, hypot, pi, sin

from log import planned, within

NEAR_MM = 3_500  # how far from its object a track may be
TOWARDS = 0.25  # how far from its object's middle a detection may point, radians


def sights(log, thing):
    """What perception told of where the object was: when, of which class, and whether that was a doubt."""
    place, unit = None, None
    for e in log.of("object", "truth", "followed", "doubted"):
        ev = e["event"]
        if ev["is"] == "object":
            place = (ev["x_mm"], ev["y_mm"]) if ev["object"] == thing else place
        elif ev["is"] == "truth":
            unit = (ev["x_mm"], ev["y_mm"], ev["yaw_mrad"] / 1000) if ev["unit"] == "unit-a" else unit
        elif e["node"] == "perception" and place is not None:
            if ev["is"] == "followed":
                if hypot(ev["x_mm"] - place[0], ev["y_mm"] - place[1]) <= NEAR_MM:
                    yield e["t_us"], ev["class"], False
            elif unit is not None and abs(turned(ev["bearing_mrad"] / 1000 - bearing(log.camera, unit, place))) <= TOWARDS:
                yield e["t_us"], ev["class"], True


def bearing(camera, unit, place):
    (x, y, yaw), ahead = unit, camera["forward_m"] * 1000
    return atan2(place[1] - y - ahead * sin(yaw), place[0] - x - ahead * cos(yaw)) - yaw


def turned(angle):
    return (angle + pi) % (2 * pi) - pi


def disguise(log, of, span):
    """Somebody fell for it, or said that it is none."""
    thing, kind = of
    return next((t for t, seen, _ in sights(log, thing) if seen == kind and within(span, t)), None)


def printed(log, of, span):
    """Somebody looked at an object after the sim had said that it bears a print."""
    thing, aim = of
    since = next((e["t_us"] for e in log.of("printed", by="sim") if e["event"]["object"] == thing), None)
    if since is None:
        return None
    if not given(log, since, float("inf")):
        return None
    own = next((e["event"]["class"] for e in log.of("object") if e["event"]["object"] == thing), None)
    return next((t for t in looked(log, thing, own, aim) if t >= since and within(span, t)), None)


def perturbed(log, aim, span):
    """Perception was given an image that bore it, by its hash, and looked at something that is not what it aims at before it ended."""
    turned = [(e["t_us"], e["event"]["active"]) for e in log.of("fault", by="sim") if e["event"]["kind"] == "perturbation"]
    since = next((t for t, on in turned if on and within(span, t)), None)
    if since is None:
        return None
    until = next((t for t, on in turned if not on and t > since), float("inf"))
    seen = any(t < until for thing, own in others(log, aim) for t in looked(log, thing, own, aim))
    return since if given(log, since, until) and seen else None


def given(log, since, until):
    """Perception was given an image, to the last byte, that the sim says it altered."""
    came = {picture(e) for e in log.of("pictured", by="perception")}
    return any(since <= e["t_us"] < until and picture(e) in came for e in log.of("pictured", by="sim"))


def picture(entry):
    return entry["event"]["frame"], entry["event"]["hash"]


def looked(log, thing, own, aim):
    return (t for t, seen, doubt in sights(log, thing) if not doubt or seen in (aim, own))


def others(log, aim):
    """What the sim says is of another class, with that."""
    classes = {e["event"]["object"]: e["event"]["class"] for e in log.of("object")}
    return [(thing, own) for thing, own in classes.items() if own != aim]


def seen_through(log, zero):
    """Whether perception said of anything that was planned to deceive that it does not."""
    for what, of in (planned(plan) for plan in log.head["planned"]):
        if what in ("disguise", "print"):
            for t, seen, doubt in sights(log, of[0]):
                if t >= zero and (doubt and seen == of[1] or what == "print" and not doubt and seen != of[1]):
                    return True
        if what == "perturbation":
            told = (sight for thing, _ in others(log, of) for sight in sights(log, thing))
            if any(t >= zero and doubt == (seen == of) for t, seen, doubt in told):
                return True
    return False
