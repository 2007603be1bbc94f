//! `lab dataset`: labelled frames of random scenes, for a detector to learn from or be judged on; and a contact sheet.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use config::platform::Sensors;
use dataset::cells::{self, Cell, Split};
use dataset::coco::{Coco, Found};
use dataset::example::Example;
use dataset::quality::LEAST;
use dataset::sheet::{self, SheetFrame};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use perception::detector::Detector;
use perception::model::hex_digest;
use perception::stages::Stages;
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde::Serialize;
use wire::sensor::Camera;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Write here; the folder is made.
    #[arg(value_name = "DIR", required_unless_present = "sheet")]
    dir: Option<PathBuf>,
    /// Conditions, as in measurements/dataset/cells.toml; all of them without it.
    #[arg(long, value_name = "NAME")]
    cell: Vec<String>,
    /// Split of seeds, shapes, paints and grounds.
    #[arg(long, value_name = "SPLIT", default_value = "training")]
    split: Split,
    /// Frames of each cell; the first has the number that --seed gives.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    frames: u64,
    /// Also write detections.json: the built-in detector's findings there, as COCO's evaluation reads results.
    #[arg(long)]
    detect: bool,
    /// Draw one frame of each cell, in every modality and with the stages' detections, into this SVG file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["dir", "detect"])]
    sheet: Option<PathBuf>,
}

/// Inputs of a set: the same inputs give the same digests.
#[derive(Debug, Serialize)]
struct Manifest {
    schema_version: u32,
    version: &'static str,
    split: String,
    cells: Vec<String>,
    /// Number of each cell's first frame, and the number of frames.
    numbers: [u64; 2],
    frames: usize,
    objects: usize,
    cells_sha256: String,
    /// SHA-256 of each file, by its path below the folder.
    files: BTreeMap<String, String>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let cells = cells::chosen(&args.cell).map_err(|e| Failure::new(Exit::Usage, e.to_string()))?;
    match (&args.sheet, &args.dir) {
        (Some(file), _) => sheet(context, file, &cells, args.split),
        (None, Some(dir)) => write(context, args, dir, &cells),
        (None, None) => Err(Failure::new(Exit::Usage, "name a folder, or --sheet FILE")),
    }
}

fn write(context: &Context, args: &Args, dir: &Path, cells: &[&Cell]) -> Result<Exit, Failure> {
    let split = args.split;
    let manifest_path = dir.join("manifest.json");
    if manifest_path.exists() {
        let name = format!("{} is there already; name another folder", manifest_path.display());
        return Err(Failure::new(Exit::Usage, name));
    }
    std::fs::create_dir_all(dir).map_err(|e| Failure::new(Exit::Usage, format!("{}: {e}", dir.display())))?;
    let names: Vec<String> = cells.iter().map(|cell| cell.name.clone()).collect();
    let described = format!("simulated scenes, {} cells {}", split.name(), names.join(", "));
    let mut coco = Coco::new(described, env!("CARGO_PKG_VERSION"));
    let detector =
        if args.detect { Some(Detector::built_in(&Camera::GROUND).map_err(Failure::internal)?) } else { None };
    let (mut files, mut found) = (BTreeMap::new(), Vec::new());
    let progress = Progress::new("frames", cells.len() * args.frames as usize, context.talk);
    for number in (0..args.frames).map(|k| context.seed + k) {
        for cell in cells {
            if context.stop.is_requested() {
                return Err(Failure::new(Exit::Interrupted, format!("interrupted; {} has no manifest", dir.display())));
            }
            let example = Example::new(&Sensors::GROUND, cell, split, number).map_err(Failure::internal)?;
            for (path, content) in coco.add(&cell.name, number, &example).map_err(Failure::internal)? {
                keep(dir, &path, &content, &mut files)?;
            }
            if let Some(detector) = &detector {
                let detections = detector.detect(&example.frame.rgb, LEAST).map_err(Failure::internal)?;
                found.extend(detections.iter().map(|d| Found::new(coco.images.len() as u64, d)));
            }
            progress.step();
        }
    }
    progress.finish();
    let annotations = serde_json::to_vec(&coco).map_err(Failure::internal)?;
    keep(dir, "annotations.json", &annotations, &mut files)?;
    if detector.is_some() {
        keep(dir, "detections.json", &serde_json::to_vec(&found).map_err(Failure::internal)?, &mut files)?;
    }
    keep(dir, "cells.toml", cells::text().as_bytes(), &mut files)?;
    let manifest = Manifest {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION"),
        split: split.name().to_owned(),
        cells: names,
        numbers: [context.seed, args.frames],
        frames: coco.images.len(),
        objects: coco.annotations.len(),
        cells_sha256: hex_digest(cells::text().as_bytes()),
        files,
    };
    // Last, so that a folder with a manifest is whole.
    out::write_result(dir, "manifest.json", "dataset", &manifest)?;
    if context.json {
        out::print_json("dataset", &manifest)?;
    } else {
        let (frames, objects) = (manifest.frames, manifest.objects);
        out::say(format_args!("{frames} frames with {objects} objects in {}", dir.display()));
    }
    Ok(Exit::Fine)
}

fn keep(dir: &Path, path: &str, content: &[u8], files: &mut BTreeMap<String, String>) -> Result<(), Failure> {
    let file = dir.join(path);
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(file, content)?;
    files.insert(path.to_owned(), hex_digest(content));
    Ok(())
}

fn sheet(context: &Context, file: &Path, cells: &[&Cell], split: Split) -> Result<Exit, Failure> {
    let stages = Stages::shipped(&Sensors::GROUND).map_err(Failure::internal)?;
    let examples =
        cells.iter().map(|cell| Example::new(&Sensors::GROUND, cell, split, context.seed).map_err(Failure::internal));
    let examples = examples.collect::<Result<Vec<_>, _>>()?;
    let title = |cell: &Cell| format!("{}, {} frame {}", cell.name, split.name(), context.seed);
    let entries = cells.iter().zip(&examples).map(|(cell, example)| SheetFrame { title: title(cell), example });
    let entries: Vec<SheetFrame<'_>> = entries.collect();
    let drawn = sheet::draw(&entries, &stages).map_err(Failure::internal)?;
    std::fs::write(file, drawn).map_err(|e| Failure::new(Exit::Usage, format!("--sheet {}: {e}", file.display())))?;
    out::say(format_args!("{}", file.display()));
    Ok(Exit::Fine)
}
