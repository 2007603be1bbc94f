//! Attacks on the detector's file: swapped, edited, cut, or with parts that no detector needs. A runtime's behaviour on
//! files that pass is tested in their own processes, by `campaign`'s command tests.

use std::fs;
use std::path::{Path, PathBuf};

use holdsafe_tests::root;
use perception::brought::Brought;
use perception::detector::{Detector, DetectorError};
use perception::head::Head;
use perception::letterbox::{HEIGHT, WIDTH};
use perception::model::{MAX_MODEL, ModelError};
use perception::onnx::OnnxError;
use perception::process::{LoadError, load, pin};
use scenario::parse_labels;
use wire::sensor::Class;

/// A file of `fuzz/corpus/model`, which `fuzz/models.py` makes.
fn seed(name: &str) -> PathBuf {
    root().join("fuzz/corpus/model").join(name)
}

/// Meaning of the classes of those files: red is a vehicle, green none, blue a person.
fn colours(head: &str) -> Head {
    let text = format!("head = \"{head}\"\n[classes]\ncount = 3\nvehicle = [0]\nperson = [2]\n");
    parse_labels("colours.toml", &text).expect("labels").head
}

fn brought(path: &Path, head: Head) -> Brought {
    Brought::new(pin(path).expect("a small file"), head)
}

fn refused(path: &Path, head: Head) -> LoadError {
    load(&brought(path, head)).expect_err("it is refused")
}

/// A camera's image with a square of this colour in it.
fn square(left: usize, top: usize, side: usize, colour: [u8; 3]) -> Vec<u8> {
    let inside = |k: usize| (left..left + side).contains(&(k % WIDTH)) && (top..top + side).contains(&(k / WIDTH));
    (0..HEIGHT * WIDTH).flat_map(|k| if inside(k) { colour } else { [90, 90, 90] }).collect()
}

/// A model that was edited after it was pinned is refused as well.
#[test]
fn swapped_model_is_refused_before_reading() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("detector.onnx");
    fs::copy(seed("yolo-v8"), &file).expect("a copy");
    let pinned = brought(&file, colours("yolo-v8"));
    assert!(load(&pinned).is_ok(), "as it was pinned");
    let good = fs::read(&file).expect("the copy");
    let mut edited = good.clone();
    edited[good.len() / 2] ^= 1;
    let swapped = fs::read(seed("yolo-v5")).expect("a seed");
    for bytes in [&edited[..], &swapped, &good[..good.len() - 1], b""] {
        fs::write(&file, bytes).expect("a write");
        let error = load(&pinned).expect_err("another file");
        assert!(matches!(error, LoadError::Pin { why: ModelError::Changed { .. }, .. }), "{error}");
        assert!(error.to_string().contains(&pinned.model.sha256), "{error}");
    }
    fs::File::create(&file).and_then(|f| f.set_len(MAX_MODEL as u64 + 1)).expect("a large file");
    assert!(matches!(load(&pinned), Err(LoadError::Pin { why: ModelError::TooLarge { .. }, .. })));
}

/// Forbidden are weights in other files, loops, random numbers and half floats.
#[test]
fn model_with_forbidden_parts_is_refused() {
    for (name, said) in [
        ("hostile-external-data", "weights in another file"),
        ("hostile-endless-loop", "the operator `Loop`"),
        ("hostile-random", "the operator `RandomUniform`"),
        ("hostile-half-floats", "float16"),
        ("few", "no ONNX model"),
        ("onnx-head", "no ONNX model"),
    ] {
        let error = refused(&seed(name), colours("yolo-v8"));
        assert!(matches!(&error, LoadError::Detector(DetectorError::Onnx(_))), "{name}: {error}");
        assert!(error.to_string().contains(said), "{name}: {error}");
    }
}

/// The models have another shape, type or head.
#[test]
fn mismatched_model_is_refused_before_first_frame() {
    let cases = [
        ("other-gives-integers", "yolo-v8", "expected one float32 tensor [1, 7, N]"),
        ("other-takes-any-size", "yolo-v8", "with H and W fixed"),
        ("other-shape", "yolo-v8", "detector gives Tensor<f32>(1, 9, 9), expected one float32 tensor [1, 7, N]"),
        ("yolo-v8", "yolo-v5", "detector gives Tensor<f32>(1, 7, 320), expected one float32 tensor [1, N, 8]"),
        ("yolo-v5", "yolo-v8", "detector gives Tensor<f32>(1, 320, 8), expected one float32 tensor [1, 7, N]"),
    ];
    for (name, head, said) in cases {
        let error = refused(&seed(name), colours(head));
        assert!(error.to_string().contains(said), "{name} as {head}: {error}");
    }
    let error = refused(&seed("yolo-v8"), Head::Grid);
    assert!(error.to_string().contains("expected one float32 tensor [1, 3, 120, 160]"), "{error}");
}

#[test]
fn truncated_file_is_no_model() {
    for name in ["yolo-v8", "yolo-v5"] {
        let whole = fs::read(seed(name)).expect("a seed");
        for cut in 0..whole.len() {
            let bytes = &whole[..cut];
            let model = perception::model::Model::pinned(bytes, &perception::model::hex_digest(bytes));
            let inspected = perception::onnx::Inspected::new(model.expect("under its own hash"));
            // What comes after the graph, the version of its operators, may be gone: the runtime then takes its own.
            let refused = matches!(inspected, Err(OnnxError::Malformed { .. } | OnnxError::Empty));
            assert!(refused || cut + 8 > whole.len(), "{name} cut to {cut} of {} bytes", whole.len());
        }
    }
}

/// Control: a custom model by itself is no reason for the refusals above.
#[test]
fn honest_custom_detector_works_with_either_head() {
    for head in ["yolo-v8", "yolo-v5"] {
        let detector: Detector = load(&brought(&seed(head), colours(head))).expect("an honest model");
        for (colour, class) in
            [([255, 0, 0], Some(Class::Vehicle)), ([0, 255, 0], None), ([0, 0, 255], Some(Class::Person))]
        {
            let found = detector.detect(&square(72, 40, 16, colour), 350).expect("an image of the camera's size");
            assert_eq!(found.first().map(|d| d.class), class, "{head} {colour:?}: {found:?}");
            let is_inside = |d: &wire::sensor::Detection| {
                let (x, y) = ((d.bounds.x0 + d.bounds.x1) / 2, (d.bounds.y0 + d.bounds.y1) / 2);
                (72..88).contains(&x) && (40..56).contains(&y)
            };
            assert!(found.iter().all(is_inside), "{head} {colour:?}: {found:?}");
        }
    }
}
