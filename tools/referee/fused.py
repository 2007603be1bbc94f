"""A referee for the fused network under attack: the same model, the same frames, another program's attack on two of its senses.

    cells="--cell clear --cell dusk --cell haze --cell rain --cell shake --cell crossover"
    lab dataset frames --split held-out --frames 60 --seed 10000 $cells
    for k in $(seq 10000 10059); do lab dataset --sheet sheet-$k.svg --split held-out --seed $k $cells; done
    python3 tools/referee/fused.py frames crates/perception/models sheet-*.svg

Needs what attack.py needs. It makes the network's seven planes of the frames' files (`perception::fused`), sets its detections beside those
that the sheets, if any, show, and has decoys called vehicles as attack.py does: by colour alone, and by colour and warmth. A strength of
one is 1 of 255 in a byte of colour, and 80 K / 255 = 0.31 K in a pixel of the thermal image, one step of the widest of the bands made of
it. Depth is as it was. *Undisputed* are the decoys whose vehicle the colour detector, looking at the same image, leaves undisputed.
"""

import json
import logging
import re
import sys
from pathlib import Path

import numpy as np
import onnxruntime

from attack import SAME, STRENGTHS, SURE, VEHICLE, Target, decoys, moved, plane, wilson
from detector import detections, shared

BANDS = ((-2000, 6000), (-400, 1200), (25_000, 35_000))
KELVIN = 8000.0  # hundredths of a kelvin that the whole of a channel's range stands for
SAY, ONE_OBJECT = 0.3, 0.45
NAMES = ("vehicle", "person", "decoy", "obstacle")


DEPTHS = np.arange(1, 4096, dtype=np.float32) * np.float32(16)  # of 16 mm each; a depth of nought is no return
SHARES = (np.log(np.float32(60_000) / DEPTHS) / np.log(np.float32(60))).clip(0, 1)
NEAR = np.concatenate([[0], (np.float32(1) + np.float32(254) * SHARES).astype(np.uint8)])


def planes(colour, kelvin, depth):
    """The network's image, whole bytes, channels first: colour, three bands of warmth, nearness."""
    lower = np.sort(kelvin[kelvin.shape[0] // 2 :], axis=None)
    ground = int(lower[lower.size // 2])
    warm = kelvin.astype(np.int64)
    levels = zip((warm - ground, warm - ground, warm), BANDS)
    bands = [(value - low).clip(0, high - low) * 255 // (high - low) for value, (low, high) in levels]
    return np.stack([*colour, *bands, NEAR[depth >> 4]]).astype(np.float64)


class Fused(Target):
    """The fused network as a classifier of one object, by colour or by colour and a change of warmth."""

    def __init__(self, session, box, kelvin, depth):
        super().__init__(session, box)
        self.kelvin, self.depth, self.known = kelvin, depth, {}

    def image(self, given):
        """Planes of three channels of colour, and of a fourth that is a change of warmth, 0.5 for none; all in 0 to 1."""
        kelvin = self.kelvin
        if len(given) == 4:
            kelvin = np.clip(np.round(kelvin + (given[3] - 0.5) * KELVIN), 0, 65_535)
        return planes(given[:3] * 255.0, kelvin, self.depth)

    def one(self, given):
        """The attack asks about each image up to three times; looks are counted once."""
        key = given.tobytes()
        if key not in self.known:
            self.known = {**dict(list(self.known.items())[-3:]), key: super().one(self.image(given) / 255.0)}
        return self.known[key]


def found(session, image):
    """Detections in whole bytes."""
    return detections(session.run(None, {session.get_inputs()[0].name: (image / 255.0).astype(np.float32)[None]})[0][0])


def disputed(proposal, seen):
    """As `perception::fused::claims`: the colour detector names another class at the same place."""
    near = [one for one in seen if one[1] >= SAY and shared(one[2:], proposal[2:]) >= ONE_OBJECT]
    return bool(near) and max(near, key=lambda one: shared(one[2:], proposal[2:]))[0] != proposal[0]


def called(networks, image, box):
    """Whether the fused network calls the object a vehicle, and whether undisputed."""
    fused, colour = networks
    there = [one for one in found(fused, image) if one[0] == VEHICLE and one[1] >= SURE and shared(one[2:], box) >= SAME]
    seen = found(colour, image[:3]) if there else []
    return bool(there), any(not disputed(one, seen) for one in there)


def read(folder, image):
    colour, kelvin, depth = (plane(folder, image[name]) for name in ("file_name", "thermal", "depth"))
    return colour.transpose(2, 0, 1).astype(np.float64), kelvin.astype(np.int64), depth.astype(np.int64)


def check(folder, images, networks, sheets):
    """Claims that the sheets show beside ours: the network's, and those of the colour detector that it does not share."""
    claims, apart, frames = 0, [], 0
    for sheet in sheets:
        for part in sheet.read_text().split('fill="#e8e8e8">')[1:]:
            cell, number = re.match(r"(\w+), held-out frame (\d+)<", part).groups()
            box = r'<rect x="(\d+)" y="(\d+)" width="(\d+)" height="(\d+)" stroke="#\w+" stroke-width="1" [^>]*/><text [^>]*>(\w+) 0\.(\d+)'
            theirs = [(NAMES.index(name) + 1, int(score) / 1000, int(x), int(y), int(x) + int(w), int(y) + int(h))
                      for x, y, w, h, name, score in re.findall(box, part)]
            image = planes(*read(folder, images[cell, int(number)]))
            proposed = [one for one in found(networks[0], image) if one[1] >= SURE]
            known = lambda claim: any(one[0] == claim[0] and shared(one[2:], claim[2:]) >= ONE_OBJECT for one in proposed)
            ours = proposed + [one for one in found(networks[1], image[:3]) if one[1] >= SURE and not known(one)]
            near = lambda a, b: a[0] == b[0] and abs(a[1] - b[1]) <= 0.002 and max(abs(p - q) for p, q in zip(a[2:], b[2:])) <= 1
            for one, others in [(one, theirs) for one in ours] + [(one, ours) for one in theirs]:
                if not any(near(one, other) for other in others):
                    apart.append((cell, number, one))
            claims, frames = claims + len(theirs), frames + 1
    print(f"{frames} frames of the sheets have {claims} claims; {len(apart)} are on one side alone {apart[:4]}")


def attacked(networks, senses, strength, there):
    hits, alone, asked = 0, 0, 0
    for k, (colour, kelvin, depth, box) in enumerate(there):
        np.random.seed(k)
        target = Fused(networks[0], box, kelvin, depth)
        clean = np.concatenate([colour / 255.0, np.full((senses - 3, *kelvin.shape), 0.5)])
        ends = moved(target, clean, strength).astype(np.float64)
        ends[:3] = np.clip(np.round(ends[:3] * 255), np.maximum(colour - strength, 0), np.minimum(colour + strength, 255)) / 255
        yes, undisputed = called(networks, target.image(ends).round(), box)
        hits, alone, asked = hits + yes, alone + undisputed, asked + target.asked
    n, share = len(there), lambda count: "{} of {} ({:.0%} to {:.0%})".format(count, len(there), *wilson(count, len(there)))
    print(f"{'colour' if senses == 3 else 'colour and warmth'}, strength {strength} of 255: {share(hits)} called vehicles, "
          f"{share(alone)} undisputed, {asked / n:.0f} looks each", flush=True)


def main(folder, models, sheets):
    logging.getLogger("art").setLevel(logging.ERROR)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = lambda name: onnxruntime.InferenceSession(models / name, options, providers=["CPUExecutionProvider"])
    networks = session("fused.onnx"), session("detector.onnx")
    truth = json.loads((folder / "annotations.json").read_text())
    images = {(image["cell"], image["number"]): image for image in truth["images"]}
    check(folder, images, networks, sheets)
    there = [(*read(folder, image), box) for image, box in decoys(folder)]
    clean = [called(networks, planes(*sensed), box) for *sensed, box in there]
    vehicles, alone = map(sum, zip(*clean))
    print(f"unchanged: {vehicles} of {len(there)} decoys called vehicles, {alone} undisputed")
    for senses in (3, 4):
        for strength in STRENGTHS:
            attacked(networks, senses, strength, there)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), [Path(name) for name in sys.argv[3:]])
