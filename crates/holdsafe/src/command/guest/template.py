"""NAME: drives straight at each way point in turn, by the newest fix. One line of JSON in, one out."""

import json
import math
import sys


def main():
    route = []
    for line in sys.stdin:
        request = json.loads(line)
        if "start" in request:
            route = request["start"]["route"]
            answer = {"ready": {}}
        else:
            answer = {"reply": step(request["step"], route)}
        print(json.dumps(answer), flush=True)


def step(step, route):
    speed, curvature, place = 0.0, 0.0, None
    fix = step["fix"]
    if fix is not None:
        place = fix["at"]
        while route and math.dist(place, route[0]) < 1.0:
            route.pop(0)
        if route:
            bearing = math.atan2(route[0][1] - place[1], route[0][0] - place[0]) - fix["yaw_rad"]
            curvature = max(-0.4, min(0.4, math.sin(bearing)))
            speed = min(1.5, step["limit_m_s"])
    state = "DRIVING" if speed > 0.0 else "STOPPED"
    return {"number": step["number"], "speed_m_s": speed, "curvature_per_m": curvature, "state": state, "place": place}


main()
