//! The messages of ROS 2 that a recording is made of.
//!
//! Images of one channel: `16UC1`, `mono16`, `32FC1`, `8UC1`, `mono8`; compressed as PNG, or by `compressedDepth` (twelve bytes:
//! the kind and two numbers, then PNG or RVL). A `32FC1` image is compressed as `A / depth + B`.

use super::cdr::Cdr;
use super::pixels::{MAX_SIDE, Pixels, Values, png};
use super::rvl;

/// When and in which frame something was measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) time_ns: i64,
    pub(super) frame: String,
}

/// A camera's intrinsics.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CameraInfo {
    pub(super) frame: String,
    pub(super) size: [usize; 2],
    pub(super) model: String,
    pub(super) distortion: Vec<f64>,
    /// fx, fy, cx, cy.
    pub(super) k: [f64; 4],
}

/// A frame in another, as numbers: position, and quaternion x y z w.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placed {
    pub(super) position: [f64; 3],
    pub(super) quaternion: [f64; 4],
}

pub(super) fn header(cdr: &mut Cdr<'_>) -> Result<Header, String> {
    let (seconds, nanoseconds) = (cdr.i32()?, cdr.u32()?);
    Ok(Header { time_ns: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds), frame: cdr.string()? })
}

/// The header of any message that begins with one.
pub(super) fn header_of(message: &[u8]) -> Result<Header, String> {
    header(&mut Cdr::new(message)?)
}

pub(super) fn camera_info(message: &[u8]) -> Result<CameraInfo, String> {
    let mut cdr = Cdr::new(message)?;
    let frame = header(&mut cdr)?.frame;
    let [height, width] = [cdr.u32()? as usize, cdr.u32()? as usize];
    let model = cdr.string()?;
    let distortion = cdr.f64_sequence()?;
    let [fx, _, cx, _, fy, cy, ..] = cdr.f64s::<9>()?;
    Ok(CameraInfo { frame, size: [width, height], model, distortion, k: [fx, fy, cx, cy] })
}

pub(super) fn pose_stamped(message: &[u8]) -> Result<(Header, Placed), String> {
    let mut cdr = Cdr::new(message)?;
    let header = header(&mut cdr)?;
    Ok((header, Placed { position: cdr.f64s()?, quaternion: cdr.f64s()? }))
}

/// The positions of the joints that a `JointState` names; of a joint without one nothing.
pub(super) fn joint_state(message: &[u8]) -> Result<(Header, Vec<(String, f64)>), String> {
    let mut cdr = Cdr::new(message)?;
    let header = header(&mut cdr)?;
    let (names, positions) = (cdr.strings()?, cdr.f64_sequence()?);
    Ok((header, names.into_iter().zip(positions).collect()))
}

/// The transforms of a `TFMessage`: header with the parent's frame, the child's frame, and where the child is in the parent.
pub(super) fn transforms(message: &[u8]) -> Result<Vec<(Header, String, Placed)>, String> {
    let mut cdr = Cdr::new(message)?;
    let count = cdr.u32()?;
    let mut found = Vec::new();
    for _ in 0..count {
        let header = header(&mut cdr)?;
        let child = cdr.string()?;
        found.push((header, child, Placed { position: cdr.f64s()?, quaternion: cdr.f64s()? }));
    }
    Ok(found)
}

/// What an image message says of itself: its encoding, or its compression.
pub(super) fn encoding(kind: &str, message: &[u8]) -> Result<String, String> {
    let mut cdr = Cdr::new(message)?;
    header(&mut cdr)?;
    if kind.ends_with("/CompressedImage") {
        return cdr.string();
    }
    cdr.u32()?;
    cdr.u32()?;
    cdr.string()
}

/// The pixels of an `Image` or `CompressedImage`.
pub(super) fn pixels(kind: &str, message: &[u8]) -> Result<Pixels, String> {
    let mut cdr = Cdr::new(message)?;
    header(&mut cdr)?;
    if kind.ends_with("/CompressedImage") {
        let format = cdr.string()?;
        let data = cdr.bytes()?;
        if format.contains("compressedDepth") {
            return compressed_depth(&format, data);
        }
        let is_jpeg = data.starts_with(&[0xff, 0xd8]);
        return if is_jpeg { Err("is a JPEG, which keeps no numbers".to_owned()) } else { png(data) };
    }
    let [height, width] = [cdr.u32()? as usize, cdr.u32()? as usize];
    let encoding = cdr.string()?;
    let (is_big, step) = (cdr.u8()? != 0, cdr.u32()? as usize);
    raw(&encoding, [width, height], step, is_big, cdr.bytes()?)
}

fn raw(encoding: &str, size: [usize; 2], step: usize, is_big: bool, data: &[u8]) -> Result<Pixels, String> {
    let [width, height] = check(size)?;
    let bytes = match encoding {
        "16UC1" | "mono16" => 2,
        "32FC1" => 4,
        "8UC1" | "mono8" => 1,
        other => return Err(format!("has encoding {other}; 16UC1, 32FC1, mono16, mono8 and 8UC1 are read")),
    };
    if step < width * bytes || data.len() < step * (height - 1) + width * bytes {
        return Err("ends too early".to_owned());
    }
    let rows = (0..height).map(|row| &data[row * step..][..width * bytes]);
    let values = match bytes {
        1 => Values::Whole(rows.flatten().map(|byte| u16::from(*byte)).collect()),
        2 => {
            let value = |pair: &[u8; 2]| if is_big { u16::from_be_bytes(*pair) } else { u16::from_le_bytes(*pair) };
            Values::Whole(rows.flat_map(|row| row.as_chunks().0.iter().map(value)).collect())
        }
        _ => {
            let value = |four: &[u8; 4]| if is_big { f32::from_be_bytes(*four) } else { f32::from_le_bytes(*four) };
            Values::Real(rows.flat_map(|row| row.as_chunks().0.iter().map(value)).collect())
        }
    };
    Ok(Pixels { size, values })
}

fn compressed_depth(format: &str, data: &[u8]) -> Result<Pixels, String> {
    let (head, data) = data.split_at_checked(12).ok_or("ends too early")?;
    let number = |at: usize| f32::from_le_bytes(std::array::from_fn(|byte| head[at + byte]));
    let (a, b) = (number(4), number(8));
    let pixels = if format.contains("rvl") {
        let (size, data) = data.split_at_checked(8).ok_or("ends too early")?;
        let number = |at: usize| u32::from_le_bytes(std::array::from_fn(|byte| size[at + byte])) as usize;
        let size = check([number(0), number(4)])?;
        let values = rvl::decode(data, size[0] * size[1]).map_err(|words| format!("has RVL data that {words}"))?;
        Pixels { size, values: Values::Whole(values) }
    } else {
        png(data)?
    };
    let Values::Whole(values) = pixels.values else { return Err("has depth of real numbers in a PNG".to_owned()) };
    if !format.trim_start().starts_with("32FC1") {
        return Ok(Pixels { size: pixels.size, values: Values::Whole(values) });
    }
    let metres = |value: u16| if value == 0 { f32::NAN } else { a / (f32::from(value) - b) };
    Ok(Pixels { size: pixels.size, values: Values::Real(values.into_iter().map(metres).collect()) })
}

fn check([width, height]: [usize; 2]) -> Result<[usize; 2], String> {
    let is_sound = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    is_sound.then_some([width, height]).ok_or(format!("has {width} x {height} pixels; 1 to {MAX_SIDE} are allowed"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_images_skip_what_pads_their_rows() {
        let data = [1, 0, 2, 0, 9, 9, 3, 0, 4, 1];
        let read = raw("16UC1", [2, 2], 6, false, &data).expect("reads");
        assert_eq!(read.values, Values::Whole(vec![1, 2, 3, 260]));
        assert_eq!(raw("mono16", [2, 1], 4, true, &data).expect("reads").values, Values::Whole(vec![256, 512]));
        assert_eq!(raw("mono8", [2, 1], 2, false, &data).expect("reads").values, Values::Whole(vec![1, 0]));
        assert!(raw("16UC1", [2, 3], 6, false, &data).is_err() && raw("16UC1", [4, 1], 6, false, &data).is_err());
        assert!(raw("rgb8", [1, 1], 3, false, &data).is_err_and(|words| words.starts_with("has encoding rgb8")));
        assert!(raw("16UC1", [0, 1], 6, false, &data).is_err());
    }
}
