//! A contact sheet: frames in every modality with the stages' output, as one SVG.
//!
//! A row is a frame; columns are colour, depth, thermal and LiDAR from above. Over the colour image a thin white box is the truth; a thick
//! one is a detection, solid where the other modalities bear it out, dashed where they contradict it, dotted where they are silent. Over the
//! thermal image are the warm regions, in the colour of their class, and over the LiDAR's scan its clusters.

use std::fmt::Write as _;

use base64::Engine as _;
use perception::corroborate::{CorroborationLimits, Judgement, corroborate};
use perception::lidar::returns;
use perception::stages::{StageClaims, Stages};
use wire::sensor::{Blob, Candidates, Class, Modalities, Modality, PixelBox};

use crate::coco::picture;
use crate::example::Example;

/// Pixels of the sheet for one of the frame.
const SCALE: u32 = 2;
/// Space for words, and between pictures.
const TITLE: u32 = 22;
const GAP: u32 = 8;
/// Half the side of the view from above, metres.
const ABOVE_M: f32 = 30.0;

/// A frame with its title.
pub struct SheetFrame<'a> {
    /// Title.
    pub title: String,
    /// The frame.
    pub example: &'a Example,
}

/// Draws the sheet.
///
/// # Errors
/// A plane is not of its size.
pub fn draw(entries: &[SheetFrame<'_>], stages: &Stages) -> Result<String, png::EncodingError> {
    let camera = stages.sensors().camera;
    let (w, h) = (u32::from(camera.width) * SCALE, u32::from(camera.height) * SCALE);
    let (width, row) = (3 * (w + GAP) + h + 2 * GAP, h + TITLE + GAP);
    let height = row * entries.len() as u32 + GAP;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"14\"><rect width=\"100%\" height=\"100%\" fill=\"#15181c\"/>"
    );
    for (k, entry) in entries.iter().enumerate() {
        let limits = CorroborationLimits::default();
        let StageClaims { candidates, disputed } = stages.candidates(&entry.example.frames(), limits.score);
        let judged = corroborate(&camera, &limits, Modalities::default(), &candidates, disputed);
        let top = k as u32 * row + GAP;
        // Writing to a String cannot fail.
        let _ = write!(svg, "<text x=\"{GAP}\" y=\"{}\" fill=\"#e8e8e8\">{}</text>", top + 15, entry.title);
        let frame = &entry.example.frame;
        let rgb = picture((frame.width, frame.height), png::ColorType::Rgb, png::BitDepth::Eight, &frame.rgb)?;
        let pictures = [
            (rgb, colour_marks(entry.example, &candidates, &judged)),
            depth(entry.example)?,
            thermal(entry.example, &candidates)?,
        ];
        for (column, (png, marks)) in pictures.into_iter().enumerate() {
            let x = GAP + column as u32 * (w + GAP);
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let _ = write!(
                svg,
                "<g transform=\"translate({x} {})\"><image width=\"{w}\" height=\"{h}\" style=\"image-rendering:pixelated\" \
                 href=\"data:image/png;base64,{data}\"/><g transform=\"scale({SCALE})\" fill=\"none\">{marks}</g></g>",
                top + TITLE
            );
        }
        let x = GAP + 3 * (w + GAP);
        let _ = write!(
            svg,
            "<svg x=\"{x}\" y=\"{}\" width=\"{h}\" height=\"{h}\" viewBox=\"-{ABOVE_M} -{ABOVE_M} {} {}\">\
             <rect x=\"-{ABOVE_M}\" y=\"-{ABOVE_M}\" width=\"100%\" height=\"100%\" fill=\"#0b0d10\"/>{}</svg>",
            top + TITLE,
            2.0 * ABOVE_M,
            2.0 * ABOVE_M,
            draw_top_view(entry.example, &candidates)
        );
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}

fn outline(bounds: &PixelBox, style: &str) -> String {
    let (w, h) = (bounds.x1.saturating_sub(bounds.x0), bounds.y1.saturating_sub(bounds.y0));
    format!("<rect x=\"{}\" y=\"{}\" width=\"{w}\" height=\"{h}\" {style}/>", bounds.x0, bounds.y0)
}

fn colour(class: Class) -> &'static str {
    match class {
        Class::Vehicle => "#ff5a4d",
        Class::Person => "#ffd23f",
        Class::Decoy => "#c78bff",
        Class::Obstacle => "#5ec8ff",
    }
}

fn colour_marks(example: &Example, candidates: &Candidates, judged: &[Judgement]) -> String {
    let truth = example.frame.labels.iter().map(|l| outline(&l.bounds, "stroke=\"#fff\" stroke-width=\"0.5\""));
    let mut marks: String = truth.collect();
    let limits = CorroborationLimits::default();
    let found = candidates.rgb.iter().flat_map(|list| list.iter()).filter(|d| d.score >= limits.score);
    for (detection, judgement) in found.zip(judged) {
        let dashes = match judgement.sighting {
            Some(sighting) if sighting.is_uncontradicted() => "",
            Some(_) => "stroke-dasharray=\"4 2\"",
            None if judgement.vetoed.count() > 0 => "stroke-dasharray=\"4 2\"",
            None => "stroke-dasharray=\"1 1\"",
        };
        let colour = colour(detection.class);
        marks += &outline(&detection.bounds, &format!("stroke=\"{colour}\" stroke-width=\"1\" {dashes}"));
        let texts: Vec<&str> =
            Modality::ALL.into_iter().filter(|m| judgement.vetoed.contains(*m)).map(Modality::name).collect();
        let text = if texts.is_empty() { String::new() } else { format!(" not {}", texts.join(", ")) };
        // Words begin at a box's left edge, or end at its right one where they would run out of the picture.
        let b = detection.bounds;
        let (x, anchor) = if b.x0 > example.frame.width / 2 { (b.x1, "end") } else { (b.x0, "start") };
        let y = b.y0.max(7) - 1;
        let _ = write!(
            marks,
            "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" font-size=\"5.5\" fill=\"{colour}\" stroke=\"#000\" stroke-width=\"1.2\" \
             paint-order=\"stroke\">{} 0.{:03}{text}</text>",
            detection.class.name(),
            detection.score.min(999)
        );
    }
    marks
}

/// Brightness of a depth, millimetres: near is bright; black is no return.
fn depth_brightness(mm: u16) -> u8 {
    if mm == 0 { 0 } else { (255.0 * 3_000.0 / (3_000.0 + f32::from(mm))) as u8 }
}

fn depth(example: &Example) -> Result<(Vec<u8>, String), png::EncodingError> {
    let grey: Vec<u8> =
        example.frame.depth.chunks_exact(2).map(|b| depth_brightness(u16::from_le_bytes([b[0], b[1]]))).collect();
    let size = (example.frame.width, example.frame.height);
    Ok((picture(size, png::ColorType::Grayscale, png::BitDepth::Eight, &grey)?, String::new()))
}

/// Image of 10 K below the ground's temperature (black) to 30 K above it (white).
fn thermal(example: &Example, candidates: &Candidates) -> Result<(Vec<u8>, String), png::EncodingError> {
    let ground = example.scene.ground.kelvin;
    let shade = |b: &[u8]| {
        let kelvin = f32::from(u16::from_le_bytes([b[0], b[1]])) / 100.0;
        ((kelvin - ground + 10.0) / 40.0 * 255.0).clamp(0.0, 255.0) as u8
    };
    let grey: Vec<u8> = example.frame.thermal.chunks_exact(2).map(shade).collect();
    let blobs = candidates.thermal.iter().flat_map(|list| list.iter());
    let mark = |b: &Blob| outline(&b.bounds, &format!("stroke=\"{}\" stroke-width=\"1\"", colour(b.class)));
    let marks = blobs.map(mark).collect();
    let size = (example.frame.width, example.frame.height);
    Ok((picture(size, png::ColorType::Grayscale, png::BitDepth::Eight, &grey)?, marks))
}

/// Returns as dots, clusters as circles; ahead is up.
fn draw_top_view(example: &Example, candidates: &Candidates) -> String {
    let (mut path, mut marks) = (String::new(), String::new());
    for [x, y, _] in returns(example.sensors.lidar, &example.frame.lidar) {
        if libm::hypotf(x, y) < ABOVE_M {
            let _ = write!(path, "M{:.1} {:.1}h.2", -y, -x);
        }
    }
    let _ = write!(marks, "<path d=\"{path}\" stroke=\"#3f6b4a\" stroke-width=\"0.2\" fill=\"none\"/>");
    for cluster in candidates.lidar.iter().flat_map(|list| list.iter()) {
        let (x, y) = (-(cluster.y_mm as f32) / 1000.0, -(cluster.x_mm as f32) / 1000.0);
        let _ = write!(
            marks,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.2\" fill=\"none\" stroke=\"#5ec8ff\" stroke-width=\"0.3\"/>"
        );
    }
    marks += "<path d=\"M0 -1.4L.8 1L-.8 1Z\" fill=\"#e8e8e8\"/>";
    marks
}
