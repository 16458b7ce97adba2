//! Images of one channel: PNGs and NumPy arrays.

use crate::wall::guarded;
use crate::{Error, Result};
use std::io::Cursor;
use std::path::Path;

/// Wider or higher images are refused, pixels: the bound of [`Pinhole`](crate::camera::Pinhole).
pub(super) const MAX_SIDE: usize = 4096;
/// More than an image of that size needs, bytes.
const MAX_BYTES: usize = 192 << 20;

/// A row-major image from the top left.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pixels {
    pub(super) size: [usize; 2],
    pub(super) values: Values,
}

/// What its numbers are.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Values {
    Whole(Vec<u16>),
    Real(Vec<f32>),
}

impl Pixels {
    /// Reads a file, a `.npy` array or a PNG.
    ///
    /// # Errors
    /// One line that names the file: one that is not there, cut short, of colours, or larger than a camera's image.
    pub(super) fn read_file(path: &Path) -> Result<Self> {
        let length = std::fs::metadata(path).map_err(|error| Error::io(path, error))?.len();
        if length > MAX_BYTES as u64 {
            return Err(Error::input(path, "", format!("has {length} bytes; an image has at most {MAX_BYTES}")));
        }
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
        let is_array = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("npy"));
        let read = guarded(|| if is_array { array(&bytes) } else { png(&bytes) });
        read.map_err(|words| Error::input(path, "", words))
    }
}

/// Width and height of a PNG or array, without its pixels.
pub(super) fn size_of(path: &Path) -> Result<[usize; 2]> {
    if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("npy")) {
        return Ok(Pixels::read_file(path)?.size);
    }
    let file = std::fs::File::open(path).map_err(|error| Error::io(path, error))?;
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info();
    let reader = reader.map_err(|error| Error::input(path, "", damaged(&error)))?;
    Ok([reader.info().width as usize, reader.info().height as usize])
}

fn damaged(error: &impl std::fmt::Display) -> String {
    format!("is no whole PNG ({error})")
}

/// A PNG's pixels: grey values, or the positions of palette colours.
pub(super) fn png(bytes: &[u8]) -> std::result::Result<Pixels, String> {
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: MAX_BYTES });
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|error| damaged(&error))?;
    let info = reader.info();
    let (size, color, depth) = ([info.width as usize, info.height as usize], info.color_type, info.bit_depth as usize);
    check_size(size)?;
    if !matches!(color, png::ColorType::Grayscale | png::ColorType::Indexed) {
        return Err("is a picture in colours; one of numbers (grey or with a palette) is needed".to_owned());
    }
    let needed = reader.output_buffer_size().filter(|bytes| *bytes <= MAX_BYTES).ok_or("is too large")?;
    let mut buffer = vec![0; needed];
    let frame = reader.next_frame(&mut buffer).map_err(|error| damaged(&error))?;
    let row = |row: usize| &buffer[row * frame.line_size..][..frame.line_size];
    let mut values = Vec::with_capacity(size[0] * size[1]);
    for row in (0..size[1]).map(row) {
        match depth {
            16 => values.extend(row.as_chunks().0.iter().take(size[0]).map(|pair| u16::from_be_bytes(*pair))),
            8 => values.extend(row.iter().take(size[0]).map(|value| u16::from(*value))),
            bits => values.extend((0..size[0]).map(|at| {
                let bit = at * bits;
                u16::from(row[bit / 8] >> (8 - bits - bit % 8)) & ((1 << bits) - 1)
            })),
        }
    }
    Ok(Pixels { size, values: Values::Whole(values) })
}

/// A NumPy array of two axes, rows first.
fn array(bytes: &[u8]) -> std::result::Result<Pixels, String> {
    let wrong = |error: std::io::Error| format!("is no whole NumPy array ({error})");
    let file = npyz::NpyFile::new(bytes).map_err(wrong)?;
    let shape = file.shape().to_vec();
    let ([height, width] | [height, width, 1]) = shape[..] else {
        return Err(format!("has shape {shape:?}; rows and columns are needed"));
    };
    let size = [width as usize, height as usize];
    check_size(size)?;
    if file.order() != npyz::Order::C {
        return Err("is in Fortran order; NumPy's own order is needed".to_owned());
    }
    let kind = file.dtype().descr();
    let kind = kind.trim_matches('\'').trim_start_matches(['<', '|', '=', '>']).to_owned();
    let values = match kind.as_str() {
        "f4" => Values::Real(file.into_vec::<f32>().map_err(wrong)?),
        "f8" => Values::Real(file.into_vec::<f64>().map_err(wrong)?.into_iter().map(|value| value as f32).collect()),
        "u2" => Values::Whole(file.into_vec::<u16>().map_err(wrong)?),
        "u1" => Values::Whole(file.into_vec::<u8>().map_err(wrong)?.into_iter().map(u16::from).collect()),
        other => return Err(format!("is of type {other}; float32, float64, uint16 and uint8 are read")),
    };
    Ok(Pixels { size, values })
}

fn check_size([width, height]: [usize; 2]) -> std::result::Result<(), String> {
    if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) {
        return Ok(());
    }
    Err(format!("{width} x {height} pixels; 1 to {MAX_SIDE} are allowed"))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A grey PNG of 8 or 16 bits.
    pub(in crate::recording) fn png_of(values: &[u16], width: u32, depth: png::BitDepth) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, values.len() as u32 / width);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(depth);
        let data: Vec<u8> = match depth {
            png::BitDepth::Sixteen => values.iter().flat_map(|value| value.to_be_bytes()).collect(),
            _ => values.iter().map(|value| *value as u8).collect(),
        };
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&data)).expect("in memory");
        bytes
    }

    #[test]
    fn grey_values_and_positions_in_palettes_come_as_they_are() {
        let depth = [0, 1, 10_000, 65_535, 256, 77];
        let read = png(&png_of(&depth, 3, png::BitDepth::Sixteen)).expect("reads");
        assert_eq!(read, Pixels { size: [3, 2], values: Values::Whole(depth.to_vec()) });
        // Four colours in two bits a pixel, as programs save few labels.
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 5, 1);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Two);
        encoder.set_palette(vec![7; 12]);
        let data = [0b00_01_10_11, 0b10_00_00_00];
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&data)).expect("in memory");
        assert_eq!(png(&bytes).expect("reads").values, Values::Whole(vec![0, 1, 2, 3, 2]));
    }

    #[test]
    fn what_is_no_image_of_numbers_is_told_in_words() {
        let good = png_of(&[5; 400], 20, png::BitDepth::Eight);
        assert!(png(&good[..good.len() / 2]).is_err_and(|words| words.starts_with("is no whole PNG")));
        assert!(png(b"prose").is_err_and(|words| words.starts_with("is no whole PNG")));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&[1, 2, 3])).expect("in memory");
        assert!(png(&bytes).is_err_and(|words| words.starts_with("is a picture in colours")));
        assert!(array(b"\x93NUMPY").is_err_and(|words| words.starts_with("is no whole NumPy array")));
    }
}
