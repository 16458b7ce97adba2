//! RVL (Wilson 2017, "Fast lossless depth image compression"), as `compressed_depth_image_transport` uses it.
//!
//! Runs of zeros and of others alternate. The others are differences to the one before, zigzag. Every number is told in groups
//! of three bits, the lowest first, each with a bit that says whether more follow; eight groups are a 32-bit word, the first
//! in its highest bits.

/// The values of an image of so many pixels.
///
/// # Errors
/// In words, for bytes that end too early or tell more pixels.
pub(super) fn decode(bytes: &[u8], pixels: usize) -> Result<Vec<u16>, String> {
    let mut groups = Groups { words: bytes.as_chunks().0, word: 0, left: 0 };
    let mut values = Vec::with_capacity(pixels);
    let mut before = 0_i32;
    while values.len() < pixels {
        let fits =
            |run: u32| (run as usize <= pixels - values.len()).then_some(run as usize).ok_or("tells too many pixels");
        let zeros = fits(groups.number()?)?;
        values.resize(values.len() + zeros, 0);
        let fits =
            |run: u32| (run as usize <= pixels - values.len()).then_some(run as usize).ok_or("tells too many pixels");
        let others = fits(groups.number()?)?;
        for _ in 0..others {
            let zigzag = groups.number()?;
            let step = (zigzag >> 1) as i32 ^ -((zigzag & 1) as i32);
            before = before.wrapping_add(step);
            values.push(before as u16);
        }
        if zeros == 0 && others == 0 && values.len() < pixels {
            return Err("tells no pixels".to_owned());
        }
    }
    Ok(values)
}

struct Groups<'a> {
    words: &'a [[u8; 4]],
    word: u32,
    left: u32,
}

impl Groups<'_> {
    fn number(&mut self) -> Result<u32, String> {
        let (mut value, mut shift) = (0_u32, 0);
        loop {
            if self.left == 0 {
                let (first, rest) = self.words.split_first().ok_or("ends too early")?;
                (self.word, self.words, self.left) = (u32::from_le_bytes(*first), rest, 8);
            }
            let group = self.word >> 28;
            self.word <<= 4;
            self.left -= 1;
            if shift > 30 {
                return Err("has a number that is too long".to_owned());
            }
            value |= (group & 7) << shift;
            shift += 3;
            if group & 8 == 0 {
                return Ok(value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_by_hand() {
        // Two zeros, then 5, 3, 300: 2 | 3 | zigzag 10, 3, 594; in groups of three bits, the lowest first.
        let groups: [u32; 9] = [2, 3, 8 + 2, 1, 3, 8 + 2, 8 + 2, 8 + 1, 1];
        let mut bytes = Vec::new();
        for word in groups.chunks(8) {
            let packed = word.iter().enumerate().fold(0, |packed, (at, group)| packed | group << (28 - 4 * at));
            bytes.extend(packed.to_le_bytes());
        }
        assert_eq!(decode(&bytes, 5), Ok(vec![0, 0, 5, 3, 300]));
        assert_eq!(decode(&bytes[..4], 5), Err("ends too early".to_owned()));
        assert_eq!(decode(&bytes, 3), Err("tells too many pixels".to_owned()));
        assert_eq!(decode(&[0; 4], 3), Err("tells no pixels".to_owned()));
        assert_eq!(decode(&[0xff; 64], 3), Err("has a number that is too long".to_owned()));
    }
}
