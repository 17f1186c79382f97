//! The maker's binary calibration files: a cursor over their numbers.

use crate::error::UnitError;
use crate::packet::unit::UnitFile;

/// First bytes of all of them.
const MAGIC: [u8; 2] = [0xEE, 0xFF];

/// Major and minor version of a binary file; `None` for another file.
pub fn version(file: &UnitFile) -> Option<(u8, u8)> {
    let is_binary = file.content.starts_with(&MAGIC) && file.content.len() > 64;
    is_binary.then(|| (file.content[2], file.content[3]))
}

/// Reads numbers one after the other.
pub struct Cursor<'a> {
    file: &'a UnitFile,
    at: usize,
}

impl<'a> Cursor<'a> {
    /// Starts at a byte.
    pub fn new(file: &'a UnitFile, at: usize) -> Self {
        Self { file, at }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], UnitError> {
        let rest = self.file.content.get(self.at..).unwrap_or_default();
        let bytes = rest.first_chunk::<N>().copied();
        self.at += N;
        let len = self.file.content.len();
        bytes.ok_or_else(|| {
            let expected = format!("at least {} bytes", self.at);
            self.file.refuse(None, expected, format!("{len} bytes"))
        })
    }

    /// A byte.
    pub fn u8(&mut self) -> Result<u8, UnitError> {
        Ok(self.take::<1>()?[0])
    }

    /// Two bytes.
    pub fn u16(&mut self) -> Result<u16, UnitError> {
        Ok(u16::from_le_bytes(self.take()?))
    }

    /// So many signed bytes.
    pub fn i8s(&mut self, count: usize) -> Result<Vec<f64>, UnitError> {
        (0..count)
            .map(|_| Ok(f64::from(self.u8()? as i8)))
            .collect()
    }

    /// So many signed pairs of bytes.
    pub fn i16s(&mut self, count: usize) -> Result<Vec<f64>, UnitError> {
        (0..count)
            .map(|_| Ok(f64::from(self.u16()? as i16)))
            .collect()
    }

    /// So many signed quadruples of bytes.
    pub fn i32s(&mut self, count: usize) -> Result<Vec<f64>, UnitError> {
        let read = |_| Ok(f64::from(i32::from_le_bytes(self.take()?)));
        (0..count).map(read).collect()
    }

    /// So many quadruples of bytes.
    pub fn u32s(&mut self, count: usize) -> Result<Vec<f64>, UnitError> {
        let read = |_| Ok(f64::from(u32::from_le_bytes(self.take()?)));
        (0..count).map(read).collect()
    }
}
