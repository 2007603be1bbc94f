"""A referee for what a frame costs: the same rays in MuJoCo, the same image and model in Python's onnxruntime.

Called by `cargo bench --bench frame -- --python PYTHON` with a file that holds both. Needs numpy, mujoco and onnxruntime (PyPI).
Says rays a second and how far the ranges are apart, and the time of one inference with one thread. CPU time.
"""

import json
import sys
import time
from math import atan2

import mujoco
import numpy as np
import onnxruntime

BASE = 1.0  # a height field has to stand on something, metres


def world(told):
    """The scene as MuJoCo builds it: a height field, boxes and capsules."""
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
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


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
    infer(told)
