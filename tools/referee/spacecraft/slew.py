"""Slews of 77 degrees against Basilisk 2.12.1 (spacecraft + reactionWheelStateEffector) under the same torques, and,
where torques from outside count, against scipy on the momentum in the inertial frame.
Run: python slew.py
"""

import numpy as np
from scipy.integrate import solve_ivp
from Basilisk.architecture import messaging
from Basilisk.simulation import reactionWheelStateEffector, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

from crate_trace import trace


def basilisk(said, step=0.01):
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("p")
    process.addTask(sim.CreateNewTask("t", macros.sec2nano(step)))
    body = spacecraft.Spacecraft()
    body.hub.mHub = 10.0
    body.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    body.hub.IHubPntBc_B = np.diag(said["inertia"]).tolist()
    factory = simIncludeRW.rwFactory()
    body.hub.omega_BN_BInit = [[rate] for rate in said["w"]]
    for axis, momentum in zip(np.eye(3), said["h"]):
        factory.create(
            "BCT_RWP015",
            axis.tolist(),
            Omega=momentum / said["wheel"] / macros.RPM,
            RWModel=messaging.BalancedWheels,
            useRWfriction=False,
            useMinTorque=False,
        )
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    factory.addToSpacecraft("rw", effector, body)
    wheels = list(factory.rwList.values())
    for wheel in wheels:
        assert abs(wheel.Js - said["wheel"]) < 1e-12 and abs(wheel.u_max - said["max_torque"]) < 1e-12, (
            wheel.Js,
            wheel.u_max,
        )
    command = messaging.ArrayMotorTorqueMsg()
    effector.rwMotorCmdInMsg.subscribeTo(command)
    sim.AddModelToTask("t", effector, 2)
    sim.AddModelToTask("t", body, 1)
    payload = messaging.ArrayMotorTorqueMsgPayload()
    sim.InitializeSimulation()
    found = []
    first = True
    for i, row in enumerate(said["steps"]):
        # A motor's torque on its wheel is the opposite of the wheel's on the body.
        payload.motorTorque = [-torque for torque in row["torques"]]
        command.write(payload)
        # The task at the end of a step moves the body up to its time: the first one, at zero, moves it by nothing.
        if first:
            sim.ConfigureStopTime(0)
            sim.ExecuteSimulation()
            command.write(payload)
            first = False
        sim.ConfigureStopTime(macros.sec2nano(round(row["t"], 6)))
        sim.ExecuteSimulation()
        state = body.scStateOutMsg.read()
        speeds = effector.rwSpeedOutMsg.read().wheelSpeeds[:3]
        found.append((np.array(state.sigma_BN), np.array(state.omega_BN_B), np.array(speeds) * said["wheel"]))
    return found


def scipy(said):
    """Body axes in TEME, momentum of the whole in TEME, momentum of each wheel against the stars; per step."""
    inertia, wheel = np.array(said["inertia"]), said["wheel"]
    field, position, dipole = (np.array(said[name]) for name in ("field", "position", "dipole"))

    def rates_of(axes, whole, spin):
        # Along its axis a wheel's momentum against the stars is its own and its share of the body's.
        return (axes.T @ whole - spin) / (inertia - wheel)

    def change(t, y, torques):
        axes, whole, spin = y[:9].reshape(3, 3), y[9:12], y[12:]
        omega = rates_of(axes, whole, spin)
        wx, wy, wz = omega
        turning = axes @ np.array([[0, -wz, wy], [wz, 0, -wx], [-wy, wx, 0]])
        outside = np.cross(axes @ dipole, field)
        distance = np.linalg.norm(position)
        if distance > 0:
            up = position / distance
            outside = outside + 3 * 3.986004418e14 / distance**3 * np.cross(up, axes @ (inertia * (axes.T @ up)))
        return np.concatenate([turning.ravel(), outside, -np.array(torques)])

    omega, relative = np.array(said["w"]), np.array(said["h"])
    y = np.concatenate([np.eye(3).ravel(), inertia * omega + relative, relative + wheel * omega])
    found, before = [], 0.0
    for row in said["steps"]:
        y = solve_ivp(change, (before, row["t"]), y, method="RK45", rtol=1e-11, atol=1e-14, args=(row["torques"],)).y[
            :, -1
        ]
        before = row["t"]
        axes = y[:9].reshape(3, 3)
        omega = rates_of(axes, y[9:12], y[12:])
        found.append((mrp_of(axes), omega, y[12:] - wheel * omega))
    return found


def mrp_of(axes):
    w = np.sqrt(max(0.0, 1 + np.trace(axes))) / 2
    x = np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]) / (4 * w)
    return x / (1 + w)


def quaternion(mrp):
    square = mrp @ mrp
    return np.concatenate([[1 - square], 2 * mrp]) / (1 + square)


def angle(a, b):
    # Vector part of the inverse of one times the other.
    part = a[0] * b[1:] - b[0] * a[1:] - np.cross(a[1:], b[1:])
    return 2 * np.arcsin(min(1.0, np.linalg.norm(part)))


for name, said in trace("slew").items():
    referee, found = ("scipy", scipy(said)) if name == "outside" else ("Basilisk", basilisk(said))
    off, rates, momenta, turned = [], [], [], []
    for row, (mrp, omega, wheels) in zip(said["steps"], found):
        off.append(np.degrees(angle(np.array(row["q"]), quaternion(mrp))))
        rates.append(np.degrees(np.linalg.norm(omega - row["w"])))
        momenta.append(np.abs(wheels - row["h"]).max())
        turned.append(77.0 - np.degrees(row["left"]))
    peak = max(np.degrees(np.linalg.norm(row["w"])) for row in said["steps"])
    used = max(np.abs(row["h"]).max() for row in said["steps"])
    torque = max(np.abs(row["torques"]).max() for row in said["steps"])
    settled = next(
        row["t"] for i, row in enumerate(said["steps"]) if all(np.degrees(r["left"]) < 0.1 for r in said["steps"][i:])
    )
    print(
        f"{name}: 77 deg, peak {peak:.2f} deg/s, wheels to {used * 1e3:.2f} mN m s, {torque * 1e3:.2f} mN m, within 0.1"
        f" deg after {settled:.1f} s, at the end {np.degrees(said['steps'][-1]['left']):.2e} deg"
    )
    print(
        f"  against {referee}: attitude at most {max(off):.2e} deg ({max(off) / 77 * 100:.2e} % of the slew), at the"
        f" end {off[-1]:.2e} deg; rates at most {max(rates):.2e} deg/s ({max(rates) / peak * 100:.2e} % of the peak);"
        f" wheels at most {max(momenta):.2e} N m s"
    )
