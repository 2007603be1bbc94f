"""An independent multirotor model as referee of the physics: `lab plant air | python multirotor.py`.

RotorPy (PyPI rotorpy 3.0.0) integrates the rigid body and the rotors by its own equations; the controller here is written from the text of
crates/sim/src/plant/multirotor.rs. Prints, for each flight, the largest difference of velocity and position, in per cent of the step.
"""

import json
import math
import sys

import numpy as np
from rotorpy.vehicles.multirotor import Multirotor
from scipy.spatial.transform import Rotation

G, DT = 9.81, 0.01
VELOCITY, TILT, RATE, INTEGRAL, MOST = 2.5, 6.0, 16.0, 2.5, 4.0
K_ETA = 1e-5  # thrust by the square of a rotor's speed; any value will do


class Referee:
    """RotorPy's body with linear drag about the wind, which RotorPy has no term for, as an outer force."""

    def __init__(self, n):
        a, most = n["arm_m"], n["thrust_n"]
        self.n, self.top = n, math.sqrt(most / K_ETA)
        self.hover = math.sqrt(n["mass_kg"] * G / 4 / K_ETA)
        params = {
            "mass": n["mass_kg"], "Ixx": n["inertia_kg_m2"][0], "Iyy": n["inertia_kg_m2"][1], "Izz": n["inertia_kg_m2"][2],
            "Ixy": 0.0, "Iyz": 0.0, "Ixz": 0.0, "num_rotors": 4,
            "rotor_pos": {"r1": np.array([a, -a, 0]), "r2": np.array([-a, a, 0]), "r3": np.array([a, a, 0]), "r4": np.array([-a, -a, 0])},
            "rotor_directions": np.array([-1, -1, 1, 1]), "rI": np.array([0, 0, 0]),
            "c_Dx": 0.0, "c_Dy": 0.0, "c_Dz": 0.0, "k_eta": K_ETA, "k_m": K_ETA * n["torque_n_m"] / most,
            "k_d": 0.0, "k_z": 0.0, "k_h": 0.0, "k_flap": 0.0, "tau_m": n["rotor_s"],
            "rotor_speed_min": 0.0, "rotor_speed_max": self.top, "motor_noise_std": 0.0,
            "k_w": 1, "k_v": 1, "kp_att": 1, "kd_att": 1,
        }
        state = {
            "x": np.zeros(3), "v": np.zeros(3), "q": np.array([0.0, 0, 0, 1]), "w": np.zeros(3), "wind": np.zeros(3),
            "rotor_speeds": np.full(4, self.hover),
        }
        self.vehicle = Multirotor(params, initial_state=state, control_abstraction="cmd_motor_speeds", aero=False)
        self.state = state

    def step(self, speeds, wind):
        v = self.state["v"]
        spin = Rotation.from_quat(self.state["q"])
        self.state = self.vehicle.step(self.state, {"cmd_motor_speeds": speeds}, DT)
        drag = self.n["drag_n_s_m"] / self.n["mass_kg"]
        still = math.exp(-drag * DT)
        self.state["v"] = wind + (self.state["v"] - wind) * still
        self.state["x"] = self.state["x"] + (still - 1) * (v - wind) * DT / 2
        slow = self.n["spin_drag_n_m_s"] / np.array(self.n["inertia_kg_m2"])
        self.state["w"] = self.state["w"] * np.exp(-slow * DT)
        return spin


class Controller:
    def __init__(self, n):
        self.n, self.reference, self.integral = n, np.zeros(3), np.zeros(3)

    def speeds(self, referee, along, turn):
        n, s = self.n, referee.state
        faster, slower = n["acceleration_m_s2"]
        change = np.array(along) - self.reference
        most = (slower if np.linalg.norm(along) < np.linalg.norm(self.reference) else faster) * DT
        step = change * (most / max(np.linalg.norm(change), most))
        self.reference = self.reference + step
        R = Rotation.from_quat(s["q"]).as_matrix()
        yaw = math.atan2(R[1, 0], R[0, 0])
        level = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
        wanted = level @ self.reference
        error = wanted - s["v"]
        self.integral = self.integral + error * INTEGRAL * DT
        size = np.linalg.norm(self.integral)
        self.integral *= min(1.0, MOST / size) if size else 1.0
        asked = level @ step / DT + np.cross([0, 0, 1], wanted) * turn + error * VELOCITY + self.integral
        lean = G * math.tan(math.radians(n["tilt_deg"]))
        flat = math.hypot(asked[0], asked[1])
        asked[:2] *= min(1.0, lean / max(flat, lean))
        asked[2] = min(max(asked[2], -0.6 * G), 0.8 * G)
        force = asked + np.array([0, 0, G])
        thrust = min(max(n["mass_kg"] * force @ R[:, 2], 0.4 * n["thrust_n"]), 3.6 * n["thrust_n"])
        tilt = np.cross([0, 0, 1], R.T @ (force / np.linalg.norm(force)))
        rates = np.array([tilt[0] * TILT, tilt[1] * TILT, turn])
        torque = np.array(n["inertia_kg_m2"]) * (rates - s["w"]) * RATE + rates * n["spin_drag_n_m_s"]
        t = thrust / (4 * n["thrust_n"])
        x, y = torque[:2] / (4 * n["arm_m"] * n["thrust_n"])
        z = torque[2] / (4 * n["torque_n_m"])
        shares = np.clip([t - x - y - z, t + x + y - z, t + x - y + z, t - x + y + z], 0, 1)
        return np.sqrt(shares * n["thrust_n"] / K_ETA)


def fly(n, flight):
    referee, controller, wind = Referee(n), Controller(n), np.array([flight["wind"], 0, 0])
    rows = []
    for k in range(1, 801):
        referee.step(controller.speeds(referee, flight["along"], flight["turn"]), wind)
        if k % 5 == 0:
            rows.append((referee.state["v"].copy(), referee.state["x"].copy()))
    return rows


def main():
    given = json.load(sys.stdin)
    n = given["body"]["multirotor"]
    worst = 0.0
    for flight in given["flights"]:
        size = max(np.linalg.norm(flight["along"]), flight["wind"], 1e-9)
        theirs = fly(n, flight)
        dv = max(np.linalg.norm(np.array(s["velocity"]) - v) for s, (v, _) in zip(flight["samples"], theirs))
        dx = max(np.linalg.norm(np.array(s["position"]) - x) for s, (_, x) in zip(flight["samples"], theirs))
        way = max(np.linalg.norm(s["position"]) for s in flight["samples"])
        worst = max(worst, dv / size)
        print(f"{flight['name']:14} velocity off by at most {dv:.3f} m/s ({100 * dv / size:.1f} % of {size:.1f}), position by {dx:.3f} m of {way:.2f}")
    print(f"worst: {100 * worst:.1f} %")


main()
