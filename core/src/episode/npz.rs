//! `beliefs/NNN.npz` and `truth/NNN.npz`: NumPy archives of a belief and of a truth.
//!
//! `numpy.load` reads them: a belief has `occupancy` `[W, D, H, 2]` (a_occ, a_free) and `semantics` `[W, D, 15]`, little
//! endian float16 or float32; a truth has `occupancy` `[W, D, H]` and `labels` `[W, D]`, uint8, and `objects` `[W, D]`,
//! uint16. Archives are deflated at the fastest level and carry no time of day: the same arrays make the same bytes.

use crate::belief::Belief;
use crate::grid::Grid;
use crate::scene::CLASS_COUNT;
use crate::wall::guarded;
use crate::world::TruthMap;
use crate::{Error, Result};
use half::f16;
use half::slice::HalfFloatSliceExt;
use npyz::WriterBuilder;
use npyz::zip::write::FileOptions;
use npyz::zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};
use std::io::{Cursor, Read, Seek, Write};
use std::path::Path;

/// No header of a `.npy` is longer, bytes.
const MAX_NPY_HEADER: u64 = 1 << 16;
/// No number of a `.npy` that is read is longer, bytes.
const LARGEST_NUMBER: u64 = 8;

/// How a belief's evidence is kept in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// float16: 11 bits, relative error below 0.05 %.
    #[default]
    Half,
    /// float32: exact.
    Single,
}

impl Precision {
    /// `values` as they are after writing and reading. Evidence beyond the largest float16 becomes that.
    pub fn round_trip(self, values: &[f32]) -> Vec<f32> {
        match self {
            Self::Half => to_half(values).to_f32_vec(),
            Self::Single => values.to_vec(),
        }
    }
}

fn to_half(values: &[f32]) -> Vec<f16> {
    let mut halves = vec![f16::ZERO; values.len()];
    halves.convert_from_f32_slice(values);
    halves.iter_mut().filter(|half| half.is_infinite()).for_each(|half| *half = f16::MAX);
    halves
}

/// A truth as files keep it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredTruth {
    /// Numbers of voxels along x, y, z.
    pub dims: [usize; 3],
    /// 1 where a voxel's centre is inside an object.
    pub occupancy: Vec<u8>,
    /// Class of the tallest occupied voxel above a floor cell, else background.
    pub labels: Vec<u8>,
    /// Object with the tallest occupied voxel above a floor cell, [`u16::MAX`] where none; not in files of programs before
    /// format 2 of `episode.json`.
    pub objects: Option<Vec<u16>>,
}

impl From<&TruthMap> for StoredTruth {
    fn from(truth: &TruthMap) -> Self {
        let (occupancy, labels) = (truth.occupancy.clone(), truth.labels.clone());
        Self { dims: truth.dims, occupancy, labels, objects: Some(truth.objects.clone()) }
    }
}

impl StoredTruth {
    /// The whole map; what is asked for the objects if the file does not tell, and if nobody does there are none.
    pub fn into_map(self, objects: impl FnOnce() -> Option<Vec<u16>>) -> TruthMap {
        let nobody = || vec![u16::MAX; self.labels.len()];
        let objects = self.objects.or_else(objects).unwrap_or_else(nobody);
        TruthMap { dims: self.dims, occupancy: self.occupancy, labels: self.labels, objects }
    }
}

/// The archive of a belief.
pub fn belief_archive(belief: &Belief, precision: Precision) -> Vec<u8> {
    let [w, d, h] = belief.grid.dims;
    let occupancy: &[f32] = belief.occupancy.as_flattened();
    let semantics: &[f32] = belief.semantics.as_flattened();
    let mut archive = Archive::new();
    match precision {
        Precision::Half => {
            archive.add("occupancy", &[w, d, h, 2], &to_half(occupancy));
            archive.add("semantics", &[w, d, CLASS_COUNT], &to_half(semantics));
        }
        Precision::Single => {
            archive.add("occupancy", &[w, d, h, 2], occupancy);
            archive.add("semantics", &[w, d, CLASS_COUNT], semantics);
        }
    }
    archive.finish()
}

/// The archive of a truth.
pub fn truth_archive(truth: &TruthMap) -> Vec<u8> {
    let [w, d, h] = truth.dims;
    let mut archive = Archive::new();
    archive.add("occupancy", &[w, d, h], &truth.occupancy);
    archive.add("labels", &[w, d], &truth.labels);
    archive.add("objects", &[w, d], &truth.objects);
    archive.finish()
}

/// Reads the archive of a belief over `grid`, and how it was kept. `path` is the file that errors name.
pub fn read_belief(bytes: &[u8], path: &Path, grid: Grid) -> Result<(Belief, Precision)> {
    let [w, d, h] = grid.dims;
    let mut archive = OpenArchive::new(bytes, path)?;
    let (occupancy, precision) = archive.evidence("occupancy", &[w, d, h, 2])?;
    let (semantics, _) = archive.evidence("semantics", &[w, d, CLASS_COUNT])?;
    let belief =
        Belief { grid, occupancy: occupancy.as_chunks().0.to_vec(), semantics: semantics.as_chunks().0.to_vec() };
    Ok((belief, precision))
}

/// Reads the archive of a truth over `grid`. `path` is the file that errors name.
pub fn read_truth(bytes: &[u8], path: &Path, grid: Grid) -> Result<StoredTruth> {
    let [w, d, h] = grid.dims;
    let mut archive = OpenArchive::new(bytes, path)?;
    let occupancy = archive.bytes("occupancy", &[w, d, h])?;
    let labels = archive.bytes("labels", &[w, d])?;
    if let Some(label) = labels.iter().find(|label| usize::from(**label) >= CLASS_COUNT) {
        return Err(Error::input(path, "array labels", format!("class {label} of {CLASS_COUNT}")));
    }
    let objects = archive.has("objects").then(|| archive.words("objects", &[w, d])).transpose()?;
    Ok(StoredTruth { dims: grid.dims, occupancy, labels, objects })
}

/// Checks that the file is a whole archive with the named arrays, without reading them.
pub fn check_archive(path: &Path, arrays: &[&str]) -> Result<()> {
    let file = std::fs::File::open(path).map_err(|error| Error::io(path, error))?;
    let mut zip = opened(std::io::BufReader::new(file), path)?;
    for name in arrays {
        zip.by_name(&npyz::npz::file_name_from_array_name(name))
            .map_err(|error| Error::input(path, format!("array {name}"), error.to_string()))?;
    }
    Ok(())
}

fn opened<R: Read + Seek>(from: R, path: &Path) -> Result<ZipArchive<R>> {
    guarded(|| ZipArchive::new(from).map_err(|error| error.to_string()))
        .map_err(|error| Error::input(path, "", format!("not a whole NumPy archive ({error})")))
}

/// An archive being written into memory.
pub(crate) struct Archive {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl Archive {
    pub(crate) fn new() -> Self {
        Self { zip: ZipWriter::new(Cursor::new(Vec::new())) }
    }

    pub(crate) fn add<T: npyz::AutoSerialize + Copy>(&mut self, name: &str, shape: &[usize], values: &[T]) {
        let options = FileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(1))
            .last_modified_time(DateTime::default());
        let shape: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
        let mut npy = Vec::with_capacity(128 + size_of_val(values));
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(&shape)
            .writer(&mut npy)
            .begin_nd()
            .expect("an array header goes into memory");
        writer.extend(values.iter().copied()).and_then(|()| writer.finish()).expect("an array goes into memory");
        self.zip
            .start_file(npyz::npz::file_name_from_array_name(name), options)
            .expect("an archive entry goes into memory");
        self.zip.write_all(&npy).expect("an archive goes into memory");
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.zip.finish().expect("an archive goes into memory").into_inner()
    }
}

/// An archive being read.
pub(crate) struct OpenArchive<'a> {
    zip: ZipArchive<Cursor<&'a [u8]>>,
    path: &'a Path,
}

impl<'a> OpenArchive<'a> {
    pub(crate) fn new(bytes: &'a [u8], path: &'a Path) -> Result<Self> {
        Ok(Self { zip: opened(Cursor::new(bytes), path)?, path })
    }

    /// The bytes of an array's `.npy`, checksum verified. An archive may promise more than memory holds: no more is
    /// unpacked than an array of so many numbers can have.
    fn entry(&mut self, name: &str, numbers: usize) -> Result<Vec<u8>> {
        let fail = |message: String| Error::input(self.path, format!("array {name}"), message);
        let entry =
            self.zip.by_name(&npyz::npz::file_name_from_array_name(name)).map_err(|error| fail(error.to_string()))?;
        let most = MAX_NPY_HEADER + LARGEST_NUMBER * numbers as u64;
        let mut npy = Vec::new();
        entry.take(most + 1).read_to_end(&mut npy).map_err(|error| fail(error.to_string()))?;
        if npy.len() as u64 > most {
            return Err(fail(format!("has more than the {numbers} numbers that the scene's grid needs")));
        }
        Ok(npy)
    }

    /// Opens the array and checks its shape; hands the values to `read`.
    fn array<T>(
        &mut self,
        name: &str,
        shape: &[usize],
        read: impl FnOnce(npyz::NpyFile<&[u8]>) -> std::io::Result<T>,
    ) -> Result<T> {
        let npy = self.entry(name, shape.iter().product())?;
        let fail = |message: String| Error::input(self.path, format!("array {name}"), message);
        let file = guarded(|| npyz::NpyFile::new(&npy[..]).map_err(|error| error.to_string())).map_err(fail)?;
        let found: Vec<usize> = file.shape().iter().map(|n| *n as usize).collect();
        if found != shape {
            return Err(fail(format!("has shape {found:?} where the scene's grid needs {shape:?}")));
        }
        if file.order() != npyz::Order::C {
            return Err(fail("is in Fortran order".to_owned()));
        }
        guarded(|| read(file).map_err(|error| error.to_string())).map_err(fail)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        let file = npyz::npz::file_name_from_array_name(name);
        self.zip.file_names().any(|name| *name == file)
    }

    /// The shape of an array, of which no more than its header is unpacked.
    pub(crate) fn shape(&mut self, name: &str) -> Result<Vec<usize>> {
        let fail = |message: String| Error::input(self.path, format!("array {name}"), message);
        let entry = self.zip.by_name(&npyz::npz::file_name_from_array_name(name));
        let entry = entry.map_err(|error| fail(error.to_string()))?;
        let mut head = Vec::new();
        entry.take(MAX_NPY_HEADER).read_to_end(&mut head).map_err(|error| fail(error.to_string()))?;
        let file = guarded(|| npyz::NpyFile::new(&head[..]).map_err(|error| error.to_string())).map_err(fail)?;
        Ok(file.shape().iter().map(|n| *n as usize).collect())
    }

    /// The numbers of an array of float16, float32 or float64 as float32, of one number whatever its shape.
    pub(crate) fn numbers(&mut self, name: &str, shape: Option<&[usize]>) -> Result<Vec<f32>> {
        let shape = shape.map_or_else(|| self.shape(name), |shape| Ok(shape.to_vec()))?;
        self.array(name, &shape, |file| {
            let descr = file.dtype().descr();
            Ok(if descr.contains("f2") {
                file.into_vec::<f16>()?.to_f32_vec()
            } else if descr.contains("f8") {
                file.into_vec::<f64>()?.into_iter().map(|number| number as f32).collect()
            } else {
                file.into_vec::<f32>()?
            })
        })
    }

    fn words(&mut self, name: &str, shape: &[usize]) -> Result<Vec<u16>> {
        self.array(name, shape, |file| file.into_vec::<u16>())
    }

    fn bytes(&mut self, name: &str, shape: &[usize]) -> Result<Vec<u8>> {
        self.array(name, shape, |file| file.into_vec::<u8>())
    }

    /// Evidence as float32, and how it was kept.
    fn evidence(&mut self, name: &str, shape: &[usize]) -> Result<(Vec<f32>, Precision)> {
        let path = self.path;
        let (values, precision) = self.array(name, shape, |file| {
            if file.dtype().descr().contains("f2") {
                Ok((file.into_vec::<f16>()?.to_f32_vec(), Precision::Half))
            } else {
                Ok((file.into_vec::<f32>()?, Precision::Single))
            }
        })?;
        if let Some(at) = values.iter().position(|value| !value.is_finite() || *value < 0.0) {
            let place = format!("array {name}");
            return Err(Error::input(path, place, format!("entry {at} is {}, not evidence", values[at])));
        }
        Ok((values, precision))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_that_unpacks_to_more_than_its_grid_filled_the_memory() {
        let grid = Grid { voxel_m: 0.01, dims: [4, 3, 2], origin: [0.0; 3] };
        let mut archive = Archive::new();
        archive.add("occupancy", &[4, 3, 2, 2], &[1.0_f32; 48]);
        archive.add("semantics", &[4, 3, CLASS_COUNT], &[1.0_f32; 12 * CLASS_COUNT]);
        assert!(read_belief(&archive.finish(), Path::new("a.npz"), grid).is_ok());
        // A thousandth of it on the disk.
        let mut archive = Archive::new();
        archive.add("occupancy", &[48 << 17], &vec![0.0_f32; 48 << 17]);
        let bytes = archive.finish();
        assert!(bytes.len() < 1 << 18);
        let line = read_belief(&bytes, Path::new("a.npz"), grid).expect_err("refuses").to_string();
        assert_eq!(line, "a.npz: array occupancy: has more than the 48 numbers that the scene's grid needs");
    }
}
