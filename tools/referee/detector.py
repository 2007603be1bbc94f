"""A referee for the detector's figures: the same model in another runtime, and average precision by another program.

    lab dataset frames --cell clear --split held-out --frames 200 --seed 0 --detect
    python3 tools/referee/detector.py frames crates/perception/models/detector.onnx

Needs numpy, pillow, onnxruntime and pycocotools (PyPI). It decodes the network's output by the model card's description, sets
the detections beside those of detections.json, and has pycocotools evaluate them.
"""

import contextlib
import io
import json
import sys
from pathlib import Path

import numpy as np
import onnxruntime
from PIL import Image
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

CELL, UNIT, SAME, LEAST, MOST = 4.0, 16.0, 0.45, 0.001, 32


def detections(raw, least=0.02):
    """Boxes of one frame from a score on, best first: (class from 1, score, left, top, right, bottom)."""
    channels, rows, columns = raw.shape
    row, column = np.mgrid[0:rows, 0:columns]
    logits = raw[1:5] - raw[1:5].max(0)
    sure = 1.0 / np.exp(logits).sum(0)
    score = (0.5 + 0.5 * sure) / (1.0 + np.exp(-raw[0]))
    x, y = (raw[5] + column + 0.5) * CELL, (raw[6] + row + 0.5) * CELL
    w = np.minimum(UNIT * np.exp(np.minimum(raw[7], 4.0)), columns * CELL)
    h = np.minimum(UNIT * np.exp(np.minimum(raw[8], 4.0)), rows * CELL)
    boxes = np.stack([x - w / 2, y - h / 2, x + w / 2, y + h / 2], -1).reshape(-1, 4)
    score, kind = score.ravel(), raw[1:5].argmax(0).ravel() + 1
    kept = []
    for k in np.argsort(-score, kind="stable"):
        if score[k] < least:
            break
        if all(shared(boxes[k], boxes[other]) <= SAME for other in kept):
            kept.append(k)
    edge = lambda value, most: int(min(max(value + 0.5, 0), most))
    found = []
    for k in kept:
        x0, y0, x1, y1 = boxes[k]
        bounds = edge(x0, columns * CELL), edge(y0, rows * CELL), edge(x1, columns * CELL), edge(y1, rows * CELL)
        if bounds[0] < bounds[2] and bounds[1] < bounds[3]:
            found.append((int(kind[k]), float(score[k]), *bounds))
    return found[:MOST]


def shared(a, b):
    area = lambda e: max(e[2] - e[0], 0) * max(e[3] - e[1], 0)
    both = area((max(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), min(a[3], b[3])))
    return both / max(area(a) + area(b) - both, 1e-6)


def main(folder, model):
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name
    ours = json.loads((folder / "detections.json").read_text())
    by_image = {}
    for one in ours:
        x, y, w, h = one["bbox"]
        by_image.setdefault(one["image_id"], []).append((one["category_id"], one["score"], x, y, x + w, y + h))
    same, apart, worst, total = 0, 0, 0.0, 0
    for image in json.loads((folder / "annotations.json").read_text())["images"]:
        pixels = np.asarray(Image.open(folder / image["file_name"]), dtype=np.float32) / 255.0
        raw = session.run(None, {name: pixels.transpose(2, 0, 1)[None]})[0][0]
        theirs, mine = detections(raw, LEAST), by_image.get(image["id"], [])
        total += max(len(theirs), len(mine))
        for one in theirs:
            near = [m for m in mine if m[0] == one[0] and max(abs(p - q) for p, q in zip(m[2:], one[2:])) <= 1]
            if near:
                same += 1
                worst = max(worst, min(abs(m[1] - one[1]) for m in near))
            else:
                apart += 1
    print(f"{same} of {total} detections are the same in onnxruntime {onnxruntime.__version__} to a pixel, {apart} are not; "
          f"scores differ by at most {worst:.4f}")
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO(str(folder / "annotations.json"))
        evaluation = COCOeval(truth, truth.loadRes(ours), "bbox")
        evaluation.params.iouThrs = np.array([0.5])
        evaluation.params.maxDets = [1, 10, MOST]
        evaluation.evaluate()
        evaluation.accumulate()
    precision = evaluation.eval["precision"][0, :, :, 0, 2]
    by_class = [float(p[p > -1].mean()) for p in precision.T]
    print(f"mean average precision at 0.5 by pycocotools: {np.mean(by_class):.3f}; by class {[round(p, 3) for p in by_class]}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
