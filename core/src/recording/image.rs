//! One image, wherever it is: a file of its own, or a message of an MCAP file.

use super::entry::Place;
use super::mcap_file::message;
use super::pixels::Pixels;
use super::ros;
use crate::wall::guarded;
use crate::{Error, Result};

/// Reads an image.
///
/// # Errors
/// Those of [`Pixels::read_file`], and of reading a message.
pub(super) fn image(place: &Place) -> Result<Pixels> {
    match place {
        Place::File(path) => Pixels::read_file(path),
        Place::Message { address, kind } => {
            let bytes = message(address)?;
            let read = guarded(|| ros::pixels(kind, &bytes));
            read.map_err(|words| Error::input(place.file(), address.topic.to_string(), words))
        }
    }
}
