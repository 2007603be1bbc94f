"""Follower: pure pursuit along the route, trusting its position without question.

Written for holdsafe as the simplest guest that drives: the arc through a point one lookahead ahead on the way (Coulter, "Implementation
of the Pure Pursuit Path Tracking Algorithm", CMU-RI-TR-92-01), at a speed that the curve and the end of the route allow. Naive by
intention: the newest fix is the place, whatever odometry says, and the last one stays the place when none comes any more. Obstacles,
tracks, teammates and the fence are not looked at.
"""

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "python"))

from holdsafe_guest import Guest, Reply, Start, Step, run

LOOKAHEAD_S, LOOKAHEAD_M = 0.9, (1.5, 4.0)
MAX_CURVATURE, SIDEWAYS, COMFORT = 0.4, 1.2, 1.0  # 1/m, m/s², m/s²
REACHED_M = 0.8


class Follower(Guest):
    def start(self, start: Start) -> None:
        self.mission = start
        self.ahead = list(start.route)
        self.fix = None
        self.speed = 0.0

    def step(self, step: Step) -> Reply:
        self.fix = step.fix or self.fix
        if self.fix is None:
            return Reply(0.0, 0.0, state="WAITING", place=(0.0, 0.0))
        here = self.fix.at
        if self.ahead and math.dist(here, self.ahead[0]) < REACHED_M:
            reached = self.ahead.pop(0)
            if self.mission.looped:
                self.ahead.append(reached)
        if not self.ahead:
            return Reply(0.0, 0.0, state="ARRIVED", place=here)
        self.speed, curvature = self.pursue(here, self.fix.yaw_rad, min(step.limit_m_s, self.mission.max_speed_m_s))
        return Reply(self.speed, curvature, state="DRIVING", place=here)

    def pursue(self, here, yaw, limit):
        """Speed and curvature of the arc through the point one lookahead along the way."""
        reach = min(max(self.speed * LOOKAHEAD_S, LOOKAHEAD_M[0]), LOOKAHEAD_M[1])
        left, carrot, at = 0.0, None, here
        for point in self.ahead:
            leg = math.dist(at, point)
            if carrot is None and left + leg >= reach:
                share = (reach - left) / leg
                carrot = (at[0] + share * (point[0] - at[0]), at[1] + share * (point[1] - at[1]))
            left, at = left + leg, point
        carrot = carrot or at
        bearing = math.atan2(carrot[1] - here[1], carrot[0] - here[0]) - yaw
        arc = 2.0 * math.sin(bearing) / math.dist(here, carrot)
        if math.cos(bearing) < 0.0:
            arc = math.copysign(MAX_CURVATURE, arc)
        curvature = min(max(arc, -MAX_CURVATURE), MAX_CURVATURE)
        slow = math.sqrt(SIDEWAYS / max(abs(curvature), 1e-9))
        stop = math.inf if self.mission.looped else math.sqrt(2.0 * COMFORT * left)
        return min(limit, slow, stop), curvature


if __name__ == "__main__":
    run(Follower)
