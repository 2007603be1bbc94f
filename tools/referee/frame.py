"""A referee for what a frame and a step cost: the same rays and scene in MuJoCo, the same image and model in Python's onnxruntime.

Called by `cargo bench --manifest-path measurements/Cargo.toml --bench frame -- --python PYTHON` with a file that holds both. Needs numpy, mujoco and onnxruntime (PyPI).
Says rays a second and how far the ranges are apart, simulated seconds a second of a vehicle of the same size on the same ground, and
the time of one inference with one thread. CPU time.
"""

import json
import sys
import time
from math import atan2

import mujoco
import numpy as np
import onnxruntime

BASE = 1.0  # a height field has to stand on something, metres


def world(told, vehicle=False):
    """The scene as MuJoCo builds it: a height field, boxes and capsules, all of them standing; with a vehicle where one is asked for."""
    heights = np.array(told["terrain"], dtype=np.float32)
    low, high, half = heights.min(), heights.max(), told["side"] / 2
    spec = mujoco.MjSpec()
    share = (heights - low) / (high - low)
    spec.add_hfield(name="ground", nrow=heights.shape[0], ncol=heights.shape[1], size=[half, half, high - low, BASE], userdata=share.ravel().tolist())
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ground", pos=[0, 0, low])
    for thing in told["objects"]:
        turn = atan2(thing["facing"][1], thing["facing"][0])
        size = np.array(thing["size"]) / 2
        capsule = thing["class"] == "person"
        if capsule:
            radius = size[:2].min()
            size = np.array([radius, max(size[2] - radius, 0.01), 0])
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE if capsule else mujoco.mjtGeom.mjGEOM_BOX
        quaternion = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
        spec.worldbody.add_geom(type=kind, size=size.tolist(), pos=thing["centre"], quat=quaternion)
    if vehicle:
        spec.option.timestep = told["step"]
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        add_vehicle(spec, told)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def add_vehicle(spec, told):
    """Chassis, springs and wheels of `sim::plant`'s size and weight. Its wheels are bodies that touch the ground, where ours are rays."""
    half = told["yaw"] / 2
    up = np.array(told["at"]) + [0, 0, 0.65]
    chassis = spec.worldbody.add_body(name="chassis", pos=up.tolist(), quat=[np.cos(half), 0, 0, np.sin(half)])
    chassis.add_freejoint()
    chassis.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.8, 0.45, 0.22], mass=260)
    for number, (x, y) in enumerate([(0.6, 0.45), (0.6, -0.45), (-0.6, 0.45), (-0.6, -0.45)]):
        wheel = chassis.add_body(pos=[x, y, -0.3])
        wheel.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], stiffness=[9000.0, 0, 0], damping=[1500.0, 0, 0])
        wheel.add_joint(name=f"wheel{number}", axis=[0, 1, 0])
        wheel.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.3, 0, 0], mass=10, friction=[1.0, 0.005, 0.0001])
        spec.add_actuator(
            target=f"wheel{number}", trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED, biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            gainprm=[200.0] + [0] * 9, biasprm=[0, 0, -200.0] + [0] * 7,
        )
    spec.add_exclude(bodyname1="world", bodyname2="chassis")


def step(told):
    model, data = world(told, vehicle=True)
    # It settles first, as ours has.
    mujoco.mj_step(model, data, 200)
    start = data.qpos[:3].copy()
    data.ctrl[:] = told["speed"] / 0.3
    before = time.process_time()
    mujoco.mj_step(model, data, told["steps"])
    took = time.process_time() - before
    way = np.linalg.norm(data.qpos[:3] - start)
    print("MuJoCo %s: %.0f simulated seconds a CPU second by mj_step alone, %.1f m of way" % (mujoco.__version__, told["steps"] * told["step"] / took, way))


def cast(told):
    model, data = world(told)
    rays = np.array(told["rays"], dtype=np.float64)
    lengths = np.linalg.norm(rays, axis=1)
    flat, count = (rays / lengths[:, None]).ravel(), len(rays)
    hit, far = np.zeros(count, dtype=np.int32), np.zeros(count)
    eye = np.array(told["eye"], dtype=np.float64)
    reach = told["reach"] * lengths.max()
    # Newer releases have one more argument, for normals.
    normals = [None] if "normal" in mujoco.mj_multiRay.__doc__ else []
    once = lambda: mujoco.mj_multiRay(model, data, eye, flat, None, 1, -1, hit, far, *normals, count, reach)
    once()
    before = time.process_time()
    for _ in range(told["casts"]):
        once()
    rate = count * told["casts"] / (time.process_time() - before)
    ours = np.array([np.nan if r is None else r for r in told["ranges"]]) * lengths
    theirs = np.where(hit >= 0, far, np.nan)
    theirs[theirs > told["reach"] * lengths] = np.nan
    both = ~np.isnan(ours) & ~np.isnan(theirs)
    apart = np.abs(ours - theirs)[both]
    print(
        "MuJoCo %s: %.2f million rays a second; hits of %d rays: both %d, one %d; apart: median %.4f m, 99 of 100 below %.4f m"
        % (mujoco.__version__, rate / 1e6, count, both.sum(), (np.isnan(ours) != np.isnan(theirs)).sum(), np.median(apart), np.quantile(apart, 0.99))
    )


def infer(told):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(told["model"], options, providers=["CPUExecutionProvider"])
    name, (_, _, rows, columns) = session.get_inputs()[0].name, session.get_inputs()[0].shape
    image = np.array(told["image"], dtype=np.uint8).reshape(rows, columns, 3)
    took = []
    for _ in range(told["images"]):
        before = time.process_time()
        tensor = (image.transpose(2, 0, 1)[None].astype(np.float32)) / 255
        session.run(None, {name: tensor})
        took.append(time.process_time() - before)
    print("onnxruntime %s: an inference from bytes to raw numbers %.3f ms" % (onnxruntime.__version__, 1e3 * np.median(took)))


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        told = json.load(file)
    cast(told)
    step(told)
    infer(told)
