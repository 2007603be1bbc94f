"""A detector of a public framework, from frames that `lab dataset` writes: converted, trained from nothing, exported, labelled.

    cells="--cell clear --cell dusk --cell haze --cell rain --cell shake --cell crossover"
    lab dataset training --split training --frames 400 $cells
    lab dataset tuning --split tuning --frames 25 $cells
    python3 tools/yolo/train.py training tuning out
    lab detector --frames 300 --detector out/yolo.onnx --labels out/labels.toml

Needs ultralytics, onnx and onnxslim (PyPI); no weights are downloaded. Frames of a cell that no model may learn from are refused, and
those of the held-out and novel splits. The tuning frames choose the epoch whose weights are kept. Objects too small to be asked for
are left out of the truth: the framework has no regions to ignore. Options: --model, --epochs, --batch, --size, --seed, --opset, and
--device and --workers for a GPU.
"""

import argparse
import hashlib
import json
import os
import shutil
import sys
import tomllib
from pathlib import Path

os.environ.update(YOLO_OFFLINE="true", YOLO_AUTOINSTALL="false")


def frames(folder, split):
    """Images and annotations of a folder of `lab dataset`, refused where nothing may be learnt from them."""
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest = manifest.get("dataset", manifest)
    learnt = {cell["name"] for cell in tomllib.loads((folder / "cells.toml").read_text())["cell"] if cell["learnt"]}
    if manifest["split"] != split:
        sys.exit(f"{folder} has frames of the split {manifest['split']}, wanted is {split}")
    if others := set(manifest["cells"]) - learnt:
        sys.exit(f"{folder} has cells that no model may learn from: {', '.join(sorted(others))}; name the others with --cell")
    truth = json.loads((folder / "annotations.json").read_text())
    of_image = {}
    for one in truth["annotations"]:
        if not one["iscrowd"]:
            of_image.setdefault(one["image_id"], []).append(one)
    return truth, of_image


def convert(folder, split, out):
    """One text file an image: class from 0, middle and sides of each box as shares of the image."""
    truth, of_image = frames(folder, split)
    for kind in ("images", "labels"):
        (out / kind / split).mkdir(parents=True)
    for image in truth["images"]:
        name, w, h = f"{image['cell']}-{image['number']}", image["width"], image["height"]
        shutil.copy(folder / image["file_name"], out / "images" / split / f"{name}.png")
        rows = []
        for one in of_image.get(image["id"], []):
            x, y, across, down = one["bbox"]
            rows.append(f"{one['category_id'] - 1} {(x + across / 2) / w:.6f} {(y + down / 2) / h:.6f} {across / w:.6f} {down / h:.6f}\n")
        (out / "labels" / split / f"{name}.txt").write_text("".join(rows))
    return [one["name"] for one in sorted(truth["categories"], key=lambda one: one["id"])]


def labels(model, names):
    """What the detector's output means to the platform; its classes have the platform's names."""
    pin = hashlib.sha256(model.read_bytes()).hexdigest()
    lines = ['head = "yolo-v8"', f'sha256 = "{pin}"', "", "[classes]", f"count = {len(names)}"]
    return "\n".join(lines + [f"{name} = [{k}]" for k, name in enumerate(names)]) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("training", type=Path)
    parser.add_argument("tuning", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--model", default="yolov8n.yaml")
    parser.add_argument("--epochs", type=int, default=12)
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--opset", type=int, default=17)
    args = parser.parse_args()
    out = args.out.resolve()
    names = convert(args.training, "training", out / "frames")
    convert(args.tuning, "tuning", out / "frames")
    words = {"path": str(out / "frames"), "train": "images/training", "val": "images/tuning", "names": dict(enumerate(names))}
    (out / "frames.yaml").write_text(json.dumps(words))

    os.environ["YOLO_CONFIG_DIR"] = str(out)
    from ultralytics import YOLO, settings

    settings.update({"sync": False})
    model = YOLO(args.model)
    model.train(data=str(out / "frames.yaml"), epochs=args.epochs, imgsz=args.size, batch=args.batch, seed=args.seed, deterministic=True,
                device=args.device, workers=args.workers, pretrained=False, plots=False, project=str(out), name="train", exist_ok=True)
    best = YOLO(out / "train" / "weights" / "best.pt")
    exported = best.export(format="onnx", imgsz=args.size, opset=args.opset)
    shutil.copy(exported, out / "yolo.onnx")
    (out / "labels.toml").write_text(labels(out / "yolo.onnx", names))
    print(f"{out / 'yolo.onnx'} and {out / 'labels.toml'}")


if __name__ == "__main__":
    main()
