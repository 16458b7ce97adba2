//! Depth images as few bytes, to the bit.
//!
//! Over a flat surface the inverse of the depth is linear in the pixel's coordinates, whatever its pose. So every depth is
//! predicted from its neighbours above and to the left as if the surface went on: five ways of going on are tried, each
//! weighed by how well it did at the neighbours. What is kept is how many float32 numbers the true depth is off the
//! prediction, split into the four bytes of that count, byte by byte, so that a compressor finds the zeros together.
//! Arithmetic is float64 without library functions, the same on every machine.

/// Ways of going on.
const WAYS: usize = 5;
/// Columns beside the image that predictions may look at.
const MARGIN: usize = 2;
/// Squared relative error of a prediction that is as good as exact: half of a float32's last digit.
const EXACT: f64 = 1e-15;

/// Inverse depths and the errors of their predictions in the rows that are still of use.
struct Surface {
    /// This row, the one above, the one above that; with a margin at both ends.
    rows: [Vec<f64>; 3],
    /// Relative errors in this row and in the one above.
    errors: [Vec<[f64; WAYS]>; 2],
    /// The predictions at the pixel that is next.
    ways: [f64; WAYS],
    column: usize,
}

impl Surface {
    fn new(width: usize) -> Self {
        let row = || vec![1.0; width + 2 * MARGIN];
        let errors = || vec![[0.0; WAYS]; width + 2 * MARGIN];
        Self { rows: [row(), row(), row()], errors: [errors(), errors()], ways: [1.0; WAYS], column: 0 }
    }

    fn begin_row(&mut self) {
        self.rows.rotate_right(1);
        self.errors.rotate_right(1);
        let first = self.rows[1][MARGIN];
        self.rows[0][..MARGIN].fill(first);
        self.errors[0][..MARGIN].fill([0.0; WAYS]);
        self.column = 0;
    }

    /// The depth to be expected of the next pixel of the row, metres.
    fn predict(&mut self) -> f32 {
        let at = self.column + MARGIN;
        let [row, above, top] = &self.rows;
        let (left, up, corner) = (row[at - 1], above[at], above[at - 1]);
        self.ways = [
            left + up - corner,
            2.0 * left - row[at - 2],
            2.0 * up - top[at],
            left + 0.5 * (above[at + 1] - corner),
            up + 0.5 * (left - top[at - 1]),
        ];
        let (mut sum, mut weights) = (0.0, 0.0);
        for (way, value) in self.ways.iter().enumerate() {
            let error = self.errors[0][at - 1][way] + self.errors[1][at][way] + self.errors[1][at + 1][way];
            let weight = 1.0 / (error * error + EXACT);
            sum += weight * value;
            weights += weight;
        }
        let inverse = sum / weights;
        if inverse > 1e-6 { (1.0 / inverse) as f32 } else { 1.0 }
    }

    /// Takes the depth that the pixel really has; 0 for none, and then the prediction stands in for it.
    fn take(&mut self, depth_m: f32, predicted_m: f32) {
        let at = self.column + MARGIN;
        let inverse = 1.0 / f64::from(if depth_m > 0.0 { depth_m } else { predicted_m });
        self.rows[0][at] = inverse;
        let error = |way: f64| (way - inverse).abs() / inverse;
        self.errors[0][at] = if depth_m > 0.0 { self.ways.map(error) } else { [0.0; WAYS] };
        self.column += 1;
        if at + MARGIN + 1 == self.rows[0].len() {
            self.rows[0][at + 1..].fill(inverse);
            self.errors[0][at + 1..].fill([0.0; WAYS]);
        }
    }
}

/// The bytes of a depth image, to be compressed: a bit per pixel for whether there is a depth, the lowest first, and then for
/// those with one the first byte of every count, all second bytes, and so on.
pub(super) fn encode(depth_m: &[f32], width: usize) -> Vec<u8> {
    let mut there = vec![0_u8; depth_m.len().div_ceil(8)];
    let mut counts = Vec::with_capacity(depth_m.len());
    let mut surface = Surface::new(width);
    for (at, depth) in depth_m.iter().enumerate() {
        if at % width == 0 {
            surface.begin_row();
        }
        let predicted = surface.predict();
        if *depth > 0.0 {
            there[at / 8] |= 1 << (at % 8);
            let off = (depth.to_bits() as i32).wrapping_sub(predicted.to_bits() as i32);
            // Small numbers of either sign become small numbers.
            counts.push(((off << 1) ^ (off >> 31)) as u32);
        }
        surface.take(*depth, predicted);
    }
    let mut bytes = there;
    for byte in 0..4 {
        bytes.extend(counts.iter().map(|count| (count >> (8 * byte)) as u8));
    }
    bytes
}

/// The depth image of [`encode`]'s bytes, and how many of them there are; `None` for bytes that are of no such image.
pub(super) fn decode(bytes: &[u8], width: usize, height: usize) -> Option<(Vec<f32>, usize)> {
    let pixels = width * height;
    let (there, planes) = bytes.split_at_checked(pixels.div_ceil(8))?;
    let has = |at: usize| there[at / 8] >> (at % 8) & 1 == 1;
    let readings = (0..pixels).filter(|at| has(*at)).count();
    let planes = planes.get(..4 * readings)?;
    let mut depth_m = Vec::with_capacity(pixels);
    let mut surface = Surface::new(width);
    let mut next = 0;
    for at in 0..pixels {
        if at % width == 0 {
            surface.begin_row();
        }
        let predicted = surface.predict();
        let mut depth = 0.0;
        if has(at) {
            let count = (0..4).map(|byte| u32::from(planes[byte * readings + next]) << (8 * byte)).sum::<u32>();
            next += 1;
            let off = (count >> 1) as i32 ^ -((count & 1) as i32);
            depth = f32::from_bits((predicted.to_bits() as i32).wrapping_add(off) as u32);
            // No depth would be a pixel that is not there.
            if !(depth > 0.0 && depth.is_finite()) {
                return None;
            }
        }
        surface.take(depth, predicted);
        depth_m.push(depth);
    }
    Some((depth_m, pixels.div_ceil(8) + 4 * readings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::stream;
    use rand::Rng;

    fn round_trip(depth_m: &[f32], width: usize) -> Vec<u8> {
        let bytes = encode(depth_m, width);
        let (back, length) = decode(&bytes, width, depth_m.len() / width).expect("decodes");
        let bits = |depths: &[f32]| depths.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
        assert!(bits(&back) == bits(depth_m) && length == bytes.len());
        bytes
    }

    #[test]
    fn any_depths_come_back_to_the_bit() {
        let mut rng = stream(3, "depths", 0);
        for (width, height) in [(1, 1), (1, 9), (9, 1), (17, 13)] {
            let any: Vec<f32> = (0..width * height)
                .map(|_| if rng.random::<f32>() < 0.3 { 0.0 } else { 10.0_f32.powf(rng.random_range(-6.0..3.0)) })
                .collect();
            round_trip(&any, width);
        }
        round_trip(&[0.0; 12], 4);
    }

    #[test]
    fn a_plane_is_told_in_a_few_bits_a_pixel() {
        let (width, height) = (200, 100);
        let plane = |at: usize| {
            let (x, y) = ((at % width) as f32, (at / width) as f32);
            1.0 / (1.7 + 0.0031 * x - 0.0017 * y)
        };
        let depths: Vec<f32> = (0..width * height).map(plane).collect();
        let packed = zstd::encode_all(&round_trip(&depths, width)[..], 3).expect("in memory");
        assert!(packed.len() * 8 < 4 * width * height, "{} bytes", packed.len());
    }

    #[test]
    fn bytes_of_no_image_are_refused() {
        let bytes = encode(&[0.5, 0.4, 0.0, 0.7], 2);
        assert!(decode(&bytes[..bytes.len() - 1], 2, 2).is_none() && decode(&[], 2, 2).is_none());
        // Counts that lead to a negative depth.
        let mut wrong = bytes.clone();
        let last = wrong.len() - 1;
        wrong[last] = 0xff;
        assert!(decode(&wrong, 2, 2).is_none());
    }
}
