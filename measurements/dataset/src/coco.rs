//! Export of frames: annotations in the form of COCO (Lin et al. 2014), images as PNG, ranges as NPY.
//!
//! Depth and thermal are 16-bit greyscale in the planes' own units (millimetres, centikelvin); a LiDAR scan is an array of
//! rings by azimuths in millimetres. Values unknown to COCO are extra keys, which its readers pass over.

use serde::Serialize;
use wire::sensor::{Class, Detection, Lidar};

use crate::example::{Example, counts};

/// The annotation file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Coco {
    /// Description.
    pub info: Info,
    /// Frames.
    pub images: Vec<Image>,
    /// Objects on them.
    pub annotations: Vec<Annotation>,
    /// Classes.
    pub categories: Vec<Category>,
}

/// Description of the set.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Info {
    /// Description in words.
    pub description: String,
    /// Version of the program that made it.
    pub version: String,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Image {
    /// Counts from 1.
    pub id: u64,
    /// Colour image, below the folder.
    pub file_name: String,
    /// Pixels.
    pub width: u16,
    /// Pixels.
    pub height: u16,
    /// Depth, 16-bit millimetres.
    pub depth: String,
    /// Temperature, 16-bit centikelvin.
    pub thermal: String,
    /// LiDAR ranges.
    pub lidar: String,
    /// Cell that it is of.
    pub cell: String,
    /// Number of the scene within its cell and split.
    pub number: u64,
}

/// One object on a frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Annotation {
    /// Counts from 1.
    pub id: u64,
    /// Frame.
    pub image_id: u64,
    /// Class, from 1.
    pub category_id: u32,
    /// Left, top, width, height, pixels.
    pub bbox: [u16; 4],
    /// Pixels that show it.
    pub area: u32,
    /// Too small to be asked for: COCO's evaluation, and most training too, passes over annotations with this flag.
    pub iscrowd: u8,
    /// Depth of its nearest visible point, metres.
    pub range_m: f32,
}

/// One class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Category {
    /// Index, from 1.
    pub id: u32,
    /// Name.
    pub name: &'static str,
    /// All classes are objects.
    pub supercategory: &'static str,
}

/// One detection, as COCO's evaluation reads results.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Frame.
    pub image_id: u64,
    /// Class, from 1.
    pub category_id: u32,
    /// Left, top, width, height, pixels.
    pub bbox: [u16; 4],
    /// 0 to 1.
    pub score: f32,
}

impl Found {
    /// Counts of a detection on frame `image_id`.
    pub fn new(image_id: u64, detection: &Detection) -> Self {
        let b = detection.bounds;
        Found {
            image_id,
            category_id: detection.class as u32 + 1,
            bbox: [b.x0, b.y0, b.x1.saturating_sub(b.x0), b.y1.saturating_sub(b.y0)],
            score: f32::from(detection.score) / 1000.0,
        }
    }
}

impl Coco {
    /// Without a frame yet.
    pub fn new(description: String, version: &str) -> Self {
        let category = |class: Class| Category { id: class as u32 + 1, name: class.name(), supercategory: "object" };
        Coco {
            info: Info { description, version: version.to_owned() },
            categories: Class::ALL.into_iter().map(category).collect(),
            ..Coco::default()
        }
    }

    /// Adds frame `number` of a cell and gives its files: path below the folder, content.
    ///
    /// # Errors
    /// A plane cannot be written as PNG.
    pub fn add(
        &mut self,
        cell: &str,
        number: u64,
        example: &Example,
    ) -> Result<Vec<(String, Vec<u8>)>, png::EncodingError> {
        let (frame, id) = (&example.frame, self.images.len() as u64 + 1);
        let path = |folder: &str, ending: &str| format!("{folder}/{id:06}.{ending}");
        let image = Image {
            id,
            file_name: path("rgb", "png"),
            width: frame.width,
            height: frame.height,
            depth: path("depth", "png"),
            thermal: path("thermal", "png"),
            lidar: path("lidar", "npy"),
            cell: cell.to_owned(),
            number,
        };
        let size = (frame.width, frame.height);
        let files = vec![
            (image.file_name.clone(), picture(size, png::ColorType::Rgb, png::BitDepth::Eight, &frame.rgb)?),
            (image.depth.clone(), sixteen(size, &frame.depth)?),
            (image.thermal.clone(), sixteen(size, &frame.thermal)?),
            (image.lidar.clone(), array(Lidar::GROUND.rings, Lidar::GROUND.azimuths, &frame.lidar)),
        ];
        for label in &frame.labels {
            let b = label.bounds;
            self.annotations.push(Annotation {
                id: self.annotations.len() as u64 + 1,
                image_id: id,
                category_id: label.class as u32 + 1,
                bbox: [b.x0, b.y0, b.x1 - b.x0, b.y1 - b.y0],
                area: label.pixels,
                iscrowd: u8::from(!counts(label)),
                range_m: label.range_mm as f32 / 1000.0,
            });
        }
        self.images.push(image);
        Ok(files)
    }
}

/// A picture as PNG.
///
/// # Errors
/// The bytes are not of this size and kind.
pub fn picture(
    (width, height): (u16, u16),
    colour: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, u32::from(width), u32::from(height));
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header()?.write_image_data(bytes)?;
    Ok(file)
}

/// PNG has its most significant byte first; the planes have it last.
fn sixteen(size: (u16, u16), plane: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let swapped: Vec<u8> = plane.chunks_exact(2).flat_map(|b| [b[1], b[0]]).collect();
    picture(size, png::ColorType::Grayscale, png::BitDepth::Sixteen, &swapped)
}

/// An array of u16 as NPY 1.0.
fn array(rows: u16, columns: u16, bytes: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '<u2', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // Magic, version, length and header fill a multiple of 64 bytes and end with a line.
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.as_bytes());
    file.extend(bytes);
    file
}

#[cfg(test)]
mod tests {
    use config::platform::Sensors;

    use super::*;
    use crate::cells::{self, Split};

    #[test]
    fn written_frames_read_back_as_rendered() {
        let example = Example::new(&Sensors::GROUND, cells::named("clear").unwrap(), Split::HeldOut, 3).unwrap();
        let mut coco = Coco::new("one frame".to_owned(), "0");
        let files = coco.add("clear", 3, &example).unwrap();
        let decode = |bytes: &[u8]| {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            pixels
        };
        assert_eq!(decode(&files[0].1), example.frame.rgb);
        let depth: Vec<u8> = decode(&files[1].1).chunks_exact(2).flat_map(|b| [b[1], b[0]]).collect();
        assert_eq!(depth, example.frame.depth);
        assert_eq!(files[3].1.len() % 64, example.frame.lidar.len() % 64);
        assert!(files[3].1.ends_with(&example.frame.lidar));
        assert_eq!(coco.annotations.len(), example.frame.labels.len());
        assert!(coco.annotations.iter().all(|a| a.category_id >= 1 && a.bbox[2] > 0 && a.range_m > 0.0));
    }
}
