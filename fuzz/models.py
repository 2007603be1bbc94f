#!/usr/bin/env python3
"""Makes the ONNX seeds of the target `model`, which the tests of detectors use too (docs/researcher/detector.md).

    pip install onnx==1.23.2 numpy && fuzz/models.py

The honest two find what is of one bright colour: they average cells of 8 x 8 pixels and weigh the colours against each
other. Class 0 is red, 1 is green, 2 is blue. The others are what a detector must not be.
"""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto as T, helper as h, numpy_helper as nh

OUT = Path(__file__).parent / "corpus" / "model"
HEIGHT, WIDTH, CELL = 128, 160, 8
ROWS, COLUMNS = HEIGHT // CELL, WIDTH // CELL
BOXES = ROWS * COLUMNS


def f32(name, values):
    return nh.from_array(np.asarray(values, dtype=np.float32), name)


def i64(name, values):
    return nh.from_array(np.asarray(values, dtype=np.int64), name)


def save(name, nodes, weights, output, kind=T.FLOAT, image=(1, 3, HEIGHT, WIDTH), input_kind=T.FLOAT, check=True):
    inputs = [h.make_tensor_value_info("images", input_kind, image)]
    outputs = [h.make_tensor_value_info("output0", kind, output)]
    graph = h.make_graph(nodes, name, inputs, outputs, weights)
    model = h.make_model(graph, opset_imports=[h.make_opsetid("", 17)], ir_version=8, producer_name="holdsafe")
    if check:
        onnx.checker.check_model(model, full_check=True)
    (OUT / name).write_bytes(model.SerializeToString())


def colours():
    """Nodes and weights that give the boxes [1, 4, N] and the scores [1, 3, N]."""
    row, column = np.mgrid[0:ROWS, 0:COLUMNS].reshape(2, -1).astype(np.float32)
    side = np.full(BOXES, 2.0 * CELL, dtype=np.float32)
    places = np.stack([(column + 0.5) * CELL, (row + 0.5) * CELL, side, side])[None]
    weigh = 20.0 * (2.0 * np.eye(3) - 1.0).reshape(3, 3, 1, 1)
    weights = [f32("places", places), f32("weigh", weigh), f32("bias", [-10.0] * 3), i64("flat", [1, 3, BOXES])]
    nodes = [
        h.make_node("AveragePool", ["images"], ["cells"], kernel_shape=[CELL, CELL], strides=[CELL, CELL]),
        h.make_node("Conv", ["cells", "weigh", "bias"], ["logits"], kernel_shape=[1, 1]),
        h.make_node("Sigmoid", ["logits"], ["likely"]),
        h.make_node("Reshape", ["likely", "flat"], ["scores"]),
    ]
    return nodes, weights


def v8(name="yolo-v8", **other):
    nodes, weights = colours()
    nodes.append(h.make_node("Concat", ["places", "scores"], ["output0"], axis=1))
    save(name, nodes, weights, [1, 7, BOXES], **other)


def v5():
    nodes, weights = colours()
    weights.append(f32("object", np.full((1, 1, BOXES), 0.9)))
    nodes += [
        h.make_node("Concat", ["places", "object", "scores"], ["all"], axis=1),
        h.make_node("Transpose", ["all"], ["output0"], perm=[0, 2, 1]),
    ]
    save("yolo-v5", nodes, weights, [1, BOXES, 8])


def instead(name, node, weights=(), output=(1, 7, BOXES), **other):
    """A model whose output is one node's."""
    save(name, [node], list(weights), output, **other)


def hostile():
    nodes, weights = colours()
    outside = T(name="places", data_type=T.FLOAT, dims=[1, 4, BOXES], data_location=T.EXTERNAL)
    for key, value in [("location", "Cargo.toml"), ("offset", "0"), ("length", str(16 * BOXES))]:
        outside.external_data.add(key=key, value=value)
    nodes.append(h.make_node("Concat", ["places", "scores"], ["output0"], axis=1))
    save("hostile-external-data", nodes, [outside, *weights[1:]], [1, 7, BOXES], check=False)

    body = h.make_graph(
        [h.make_node("Identity", ["go"], ["on"]), h.make_node("Identity", ["v"], ["w"])],
        "body",
        [h.make_tensor_value_info(n, k, s) for n, k, s in [("i", T.INT64, []), ("go", T.BOOL, []), ("v", T.FLOAT, [1, 7, BOXES])]],
        [h.make_tensor_value_info("on", T.BOOL, []), h.make_tensor_value_info("w", T.FLOAT, [1, 7, BOXES])],
    )
    many = [i64("many", 2**62), nh.from_array(np.array(True), "go"), f32("first", np.zeros((1, 7, BOXES)))]
    instead("hostile-endless-loop", h.make_node("Loop", ["many", "go", "first"], ["output0"], body=body), many)

    instead("hostile-random", h.make_node("RandomUniform", [], ["output0"], shape=[1, 7, BOXES]))
    half = nh.from_array(np.zeros((1, 7, BOXES), dtype=np.float16), "half")
    instead("hostile-half-floats", h.make_node("Cast", ["half"], ["output0"], to=T.FLOAT), [half])
    instead("other-gives-integers", h.make_node("Cast", ["z"], ["output0"], to=T.INT32), [f32("z", np.zeros((1, 7, 9)))],
            output=(1, 7, 9), kind=T.INT32)
    instead("other-takes-any-size", h.make_node("Identity", ["z"], ["output0"]), [f32("z", np.zeros((1, 7, 9)))],
            output=(1, 7, 9), image=(1, 3, "height", "width"))
    instead("other-shape", h.make_node("Identity", ["z"], ["output0"]), [f32("z", np.zeros((1, 9, 9)))], output=(1, 9, 9))
    most = h.make_node("ReduceMax", ["images"], ["most"], keepdims=0)
    last = h.make_node("Expand", ["one"], ["output0"])
    last.input.append("shape")
    shape = i64("shape", [1, 7, 9])
    # The backend looks it up without asking whether it is there.
    instead_many("hostile-output-of-nobody", [h.make_node("Identity", ["images"], ["elsewhere"])], [], (1, 7, 9))
    # Twice the numbers with each step: 2 ** 45 at last.
    grow = [h.make_node("Concat", [f"m{k}", f"m{k}"], [f"m{k + 1}"], axis=3) for k in range(1, 30)]
    grow = [h.make_node("Concat", ["images", "images"], ["m1"], axis=3), *grow,
            h.make_node("ReduceMax", ["m30"], ["one"], keepdims=0), last]
    instead_many("hostile-grows", grow, [shape], (1, 7, 9))
    # An index out of its table on every image that is neither black nor noise: fine on what a model is tried on, and not in a run.
    grey = [
        h.make_node("ReduceMean", ["images"], ["mean"], keepdims=0),
        h.make_node("Sub", ["mean", "half"], ["off"]),
        h.make_node("Abs", ["off"], ["away"]),
        h.make_node("Sub", ["away", "little"], ["over"]),
        h.make_node("Relu", ["over"], ["unlike_noise"]),
        h.make_node("Sub", ["mean", "little"], ["above"]),
        h.make_node("Relu", ["above"], ["unlike_black"]),
        h.make_node("Mul", ["unlike_noise", "unlike_black"], ["share"]),
        h.make_node("Mul", ["share", "large"], ["index"]),
        h.make_node("Cast", ["index"], ["at"], to=T.INT64),
        h.make_node("Gather", ["images", "at"], ["picked"], axis=0),
        h.make_node("ReduceMax", ["picked"], ["one"], keepdims=0),
        last,
    ]
    numbers = [f32("half", 0.5), f32("little", 0.05), f32("large", 1e9), shape]
    instead_many("hostile-index-by-image", grey, numbers, (1, 7, 9))
    for name, side, many in [("other-slow", 512, 40), ("hostile-endless-products", 4096, 200)]:
        products = [most, h.make_node("Expand", ["most", "size"], ["m0"])]
        products += [h.make_node("MatMul", [f"m{k}", f"m{k}"], [f"m{k + 1}"]) for k in range(many)]
        products += [h.make_node("ReduceMax", [f"m{many}"], ["one"], keepdims=0), last]
        instead_many(name, products, [i64("size", [side, side]), shape], (1, 7, 9))


def instead_many(name, nodes, weights, output):
    save(name, nodes, weights, output, check=False)


if __name__ == "__main__":
    v8()
    v5()
    hostile()
