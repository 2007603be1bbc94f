"""Reads MCAP files with the libraries of others: what `holdsafe report --format mcap` wrote, or a run's recording.

    python3 tools/referee/mcap_reader.py run.mcap [exported.json]
    python3 tools/referee/mcap_reader.py RUN/recording/*.mcap

Needs `mcap`, `mcap-protobuf-support`, `foxglove-sdk` and `numpy` from PyPI. Every message is decoded by its schema, chunk by chunk with their
checksums; messages are counted by topic and held against what `holdsafe report --format mcap --json` printed, where that is given. Names and numbers of
the fields of each Foxglove schema are compared with those that Foxglove's own package knows, as far as it has that message. Where there are
clouds, their points go through the transforms and the camera's calibration into the depth image, as a viewer would draw them.
"""

import json
import sys
from collections import Counter

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def foreign(name):
    """What Foxglove's package has under this name: its fields by their names."""
    try:
        import foxglove.messages as theirs
    except ImportError:
        import foxglove.schemas as theirs
    return getattr(theirs, name, None)


def unknown_fields(schema):
    """Fields of the schema that Foxglove's class does not take, and whether there is such a class."""
    files = FileDescriptorSet.FromString(schema.data)
    short = schema.name.split(".")[-1]
    message = next(m for f in files.file for m in f.message_type if m.name == short)
    theirs = foreign(short)
    if theirs is None:
        return None
    refused = []
    for field in message.field:
        try:
            theirs(**{field.name: None})
        except TypeError as why:
            if "unexpected keyword" in str(why):
                refused.append(field.name)
    return refused


def read(path):
    counts, schemas, first, last = Counter(), {}, None, None
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages():
            if schema is None:
                decoded = message.data
            elif schema.encoding == "protobuf":
                decoded = DecoderFactory().decoder_for(channel.message_encoding, schema)(message.data)
            else:
                decoded = json.loads(message.data)
            assert decoded is not None and decoded != b"", (channel.topic, "an empty message")
            counts[channel.topic] += 1
            schemas[channel.topic] = schema
            first, last = first if first is not None else message.log_time, message.log_time
        summary = reader.get_summary()
    if summary is not None:
        assert sum(counts.values()) == summary.statistics.message_count, "the index counts otherwise"
    return counts, schemas, first, last


def turn(q):
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def shift(transform):
    return np.array([transform.translation.x, transform.translation.y, transform.translation.z])


def geometry(path):
    """By how far the points of clouds miss what the depth image has at their pixel and those around it, metres along the optical axis: seen
    at a grazing angle, the ground within one pixel is metres deep."""
    now, places, missed = {}, {}, []
    factory = DecoderFactory()
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=["/tf", "/lidar", "/camera/depth", "/camera/calibration"]):
            decoded = factory.decoder_for(channel.message_encoding, schema)(message.data)
            now[channel.topic] = (message.log_time, decoded)
            if channel.topic == "/tf":
                places.update({t.child_frame_id: t for t in decoded.transforms})
            here = [now.get(t, (None, None)) for t in ("/lidar", "/camera/depth", "/camera/calibration")]
            if any(at != message.log_time for at, _ in here):
                continue
            cloud, depth, camera = (of for _, of in here)
            lidar, eye = places[cloud.frame_id], places[camera.frame_id]
            points = np.frombuffer(cloud.data, np.float32).reshape(-1, 3).astype(float)
            body = points @ turn(lidar.rotation).T + shift(lidar)
            seen = (body - shift(eye)) @ turn(eye.rotation)
            seen = seen[seen[:, 2] > 0.5]
            u, v, w = (seen @ np.array(list(camera.K)).reshape(3, 3).T).T
            column, row = u / w, v / w
            inside = (column >= 0) & (column < depth.width) & (row >= 0) & (row < depth.height)
            image = np.frombuffer(depth.data, np.uint16).reshape(depth.height, depth.width) / 1e3
            padded = np.pad(np.where(image > 0, image, np.nan), 1, constant_values=np.nan)
            around = np.stack([padded[i:i + depth.height, j:j + depth.width] for i in range(3) for j in range(3)])
            around = around[:, row[inside].astype(int), column[inside].astype(int)]
            known = ~np.isnan(around).all(0)
            near, far = np.nanmin(around[:, known], 0), np.nanmax(around[:, known], 0)
            z = seen[inside, 2][known]
            missed.append(np.maximum(0.0, np.maximum(near - z, z - far)))
    return np.concatenate(missed) if missed else np.array([])


def main(paths, expected):
    wrong = 0
    for path in paths:
        counts, schemas, first, last = read(path)
        told = {c["topic"]: (c["schema"], c["messages"]) for c in expected["channels"]} if expected else None
        for topic, n in sorted(counts.items()):
            schema = schemas[topic]
            name = schema.name if schema else "-"
            note = ""
            if told is not None and told.get(topic) != (name, n):
                note, wrong = f"holdsafe said {told.get(topic)}", wrong + 1
            if schema and schema.encoding == "protobuf":
                refused = unknown_fields(schema)
                if refused is None:
                    note += " not in Foxglove's package"
                elif refused:
                    note, wrong = note + f" fields that Foxglove's class does not take: {refused}", wrong + 1
            print(f"{topic:32} {name:28} {n:8} {note}")
        if told is not None and set(told) - set(counts):
            print(f"missing: {sorted(set(told) - set(counts))}")
            wrong += 1
        missed = geometry(path)
        if len(missed):
            near = float(np.mean(missed < 0.3))
            print(f"{len(missed)} points of clouds in depth images: {100 * near:.1f} % within 0.3 m of what is seen there")
            wrong += near < 0.95
        print(f"{path}: {sum(counts.values())} messages in {len(counts)} channels, {((last or 0) - (first or 0)) / 1e9:.3f} s")
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    files = [a for a in sys.argv[1:] if a.endswith(".mcap")]
    objects = [json.load(open(a)) for a in sys.argv[1:] if a.endswith(".json")]
    sys.exit(main(files, objects[0] if objects else None))
