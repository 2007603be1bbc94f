"""A referee for the attack on the colour detector's pixels: the same model, the same frames, another program's attack.

    lab dataset frames --split held-out --frames 60 --seed 10000 --cell clear --cell dusk --cell haze --cell rain --cell shake --cell crossover
    python3 tools/referee/attack.py frames crates/perception/models/detector.onnx

Needs numpy, pillow, onnxruntime and adversarial-robustness-toolbox (PyPI). The Adversarial Robustness Toolbox has decoys called vehicles
by its Square attack (Andriushchenko et al. 2020), which asks for scores alone, within the strengths of `trainer pixels` and on its
frames: number k of 60 from the k-th of the six cells in turn. Images are rounded to whole bytes within the bound before they are judged.
"""

import json
import logging
import math
import sys
from pathlib import Path

import numpy as np
import onnxruntime
from art.attacks.evasion import SquareAttack
from art.estimators.classification import BlackBoxClassifierNeuralNetwork
from PIL import Image

from detector import CELL, UNIT, detections, shared

CELLS = ("clear", "dusk", "haze", "rain", "shake", "crossover")
FIRST, FRAMES, STRENGTHS, STEPS = 10_000, 60, (1, 2, 4, 8), 400
VEHICLE, DECOY, SURE, SAME = 1, 3, 0.5, 0.5


def boxes(raw):
    _, rows, columns = raw.shape
    row, column = np.mgrid[0:rows, 0:columns]
    x, y = (raw[5] + column + 0.5) * CELL, (raw[6] + row + 0.5) * CELL
    w, h = UNIT * np.exp(np.minimum(raw[7], 4.0)), UNIT * np.exp(np.minimum(raw[8], 4.0))
    return np.stack([x - w / 2, y - h / 2, x + w / 2, y + h / 2], -1)


def overlap(all_boxes, box):
    area = lambda b: np.clip(b[..., 2] - b[..., 0], 0, None) * np.clip(b[..., 3] - b[..., 1], 0, None)
    low, high = np.maximum(all_boxes[..., :2], box[:2]), np.minimum(all_boxes[..., 2:], box[2:])
    both = area(np.concatenate([low, high], -1))
    return both / np.maximum(area(all_boxes) + area(np.asarray(box, dtype=float)) - both, 1e-6)


class Target:
    """The detector as a classifier of one object: its best score for each class among the cells whose box is of the object."""

    def __init__(self, session, box):
        self.session, self.name, self.box, self.asked = session, session.get_inputs()[0].name, box, 0

    def scores(self, images):
        return np.stack([self.one(image) for image in images])

    def one(self, image):
        self.asked += 1
        raw = self.session.run(None, {self.name: image[None].astype(np.float32)})[0][0]
        near = overlap(boxes(raw), self.box) >= 0.3
        if not near.any():
            return np.full(4, 1e-6, dtype=np.float32)
        logits = raw[1:5] - raw[1:5].max(0)
        shares = np.exp(logits) / np.exp(logits).sum(0)
        best = (shares / (1.0 + np.exp(-raw[0])))[:, near].max(1)
        return np.maximum(best, 1e-6).astype(np.float32)


def margin(scores):
    """Logarithm of the best score of another class over that of the vehicle."""
    others = np.delete(scores, VEHICLE - 1, 1).max(1)
    return np.log(others) - np.log(scores[:, VEHICLE - 1])


def called_vehicle(session, pixels, box):
    raw = session.run(None, {session.get_inputs()[0].name: (pixels / 255.0).astype(np.float32)[None]})[0][0]
    return any(kind == VEHICLE and score >= SURE and shared(at, box) >= SAME for kind, score, *at in detections(raw))


def wilson(hits, n, z=1.959964):
    middle, spread = hits + z * z / 2, z * math.sqrt(hits * (n - hits) / n + z * z / 4)
    return (middle - spread) / (n + z * z), (middle + spread) / (n + z * z)


def decoys(folder):
    """Image and box of each decoy that the frames show."""
    truth = json.loads((folder / "annotations.json").read_text())
    by_image = {}
    for one in truth["annotations"]:
        if one["category_id"] == DECOY and not one["iscrowd"]:
            x, y, w, h = one["bbox"]
            by_image.setdefault(one["image_id"], []).append((x, y, x + w, y + h))
    images = {(image["cell"], image["number"]): image for image in truth["images"]}
    for k in range(FRAMES):
        image = images[CELLS[k % len(CELLS)], FIRST + k]
        for box in by_image.get(image["id"], []):
            yield image, box


def plane(folder, name):
    return np.asarray(Image.open(folder / name))


def moved(target, clean, strength):
    """The image, channels first in 0 to 1, at which the attack on `target` ends."""
    classifier = BlackBoxClassifierNeuralNetwork(target.scores, clean.shape, 4, clip_values=(0.0, 1.0), channels_first=True)
    # The goal is one class; what is minimised is how far the detector is from it.
    away = lambda images, _: margin(classifier.predict(images))
    reached = lambda scores, _: (margin(scores) < 0.0) & (scores[:, VEHICLE - 1] >= SURE + 0.02)
    attack = SquareAttack(classifier, norm=np.inf, adv_criterion=reached, loss=away, eps=strength / 255.0,
                          max_iter=STEPS, p_init=0.3, verbose=False)
    return attack.generate(clean.astype(np.float32)[None], np.eye(4, dtype=np.float32)[[VEHICLE - 1]])[0]


def main(folder, model):
    logging.getLogger("art").setLevel(logging.ERROR)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    there = [(plane(folder, image["file_name"]).astype(np.float64).transpose(2, 0, 1), box) for image, box in decoys(folder)]
    clean = sum(called_vehicle(session, pixels, box) for pixels, box in there)
    print(f"unchanged: {clean} of {len(there)} decoys called vehicles")
    for strength in STRENGTHS:
        hits, asked = 0, 0
        for k, (pixels, box) in enumerate(there):
            np.random.seed(k)
            target = Target(session, box)
            ends = moved(target, pixels / 255.0, strength) * 255.0
            rounded = np.clip(np.round(ends), np.maximum(pixels - strength, 0), np.minimum(pixels + strength, 255))
            hits += called_vehicle(session, rounded, box)
            asked += target.asked
        low, high = wilson(hits, len(there))
        print(f"strength {strength} of 255: {hits} of {len(there)} called vehicles ({low:.0%} to {high:.0%}), "
              f"{asked / len(there):.0f} looks each")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
