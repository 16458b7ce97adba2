//! Bytes of ROS 2 messages: CDR (OMG's DDS-XTypes, encoding version 1), as `rmw` writes it.
//!
//! Four bytes say the byte order; behind them every number stands at a multiple of its own size.

/// Longer strings and sequences than what is left are refused.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

/// What a message has to say that ended too early.
const SHORT: &str = "ends too early";

impl<'a> Cdr<'a> {
    /// # Errors
    /// In words, for another encoding.
    pub(super) fn new(message: &'a [u8]) -> Result<Self, String> {
        let (head, bytes) = message.split_at_checked(4).ok_or(SHORT)?;
        match head[1] {
            0 | 1 => Ok(Self { bytes, at: 0, is_little: head[1] == 1 }),
            other => Err(format!("is encoded as {other}, which is no plain CDR")),
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len()).ok_or(SHORT)?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes: [u8; N] = self.take(N)?.try_into().map_err(|_| SHORT)?;
        if !self.is_little {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn u8(&mut self) -> Result<u8, String> {
        self.number::<1>().map(|[byte]| byte)
    }

    pub(super) fn u32(&mut self) -> Result<u32, String> {
        self.number().map(u32::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32, String> {
        self.number().map(i32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, String> {
        self.number().map(f64::from_le_bytes)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    /// A string; its closing zero is counted and left out.
    pub(super) fn string(&mut self) -> Result<String, String> {
        let length = self.u32()? as usize;
        let bytes = self.take(length)?;
        Ok(String::from_utf8_lossy(bytes.strip_suffix(&[0]).unwrap_or(bytes)).into_owned())
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    /// A sequence of strings.
    pub(super) fn strings(&mut self) -> Result<Vec<String>, String> {
        let length = self.u32()? as usize;
        if length > self.bytes.len() / 4 {
            return Err(SHORT.to_owned());
        }
        (0..length).map(|_| self.string()).collect()
    }

    /// A sequence of numbers.
    pub(super) fn f64_sequence(&mut self) -> Result<Vec<f64>, String> {
        let length = self.u32()? as usize;
        if length > self.bytes.len() / 8 {
            return Err(SHORT.to_owned());
        }
        (0..length).map(|_| self.f64()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_at_multiples_of_their_size_in_either_byte_order() {
        let mut little = vec![0, 1, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'a', 0];
        little.extend([0; 6]);
        little.extend(1.0_f64.to_le_bytes());
        let mut cdr = Cdr::new(&little).expect("plain");
        assert_eq!((cdr.u8(), cdr.string(), cdr.f64()), (Ok(7), Ok("a".to_owned()), Ok(1.0)));
        assert!(cdr.u8().is_err_and(|words| words == SHORT));
        let big = [0, 0, 0, 0, 0, 0, 0, 9, 0xff, 0xff, 0xff, 0xfe];
        let mut cdr = Cdr::new(&big).expect("plain");
        assert_eq!((cdr.u32(), cdr.i32()), (Ok(9), Ok(-2)));
        let long = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
        assert!(Cdr::new(&long).expect("plain").bytes().is_err());
        assert!(Cdr::new(&long).expect("plain").f64_sequence().is_err());
        assert!(Cdr::new(&long).expect("plain").strings().is_err());
        assert!(Cdr::new(&[0, 7, 0, 0]).is_err() && Cdr::new(&[0]).is_err());
    }
}
