//! Whether a recording holds anything to show, and whether it is whole: told before the viewer is given it, which shows an
//! empty page for a file that breaks off before its first data.
//!
//! A recording (`.rrd`) is a header and then messages, each with its kind and its length in front. One that was ended has a
//! last message that says so; that of a run that was killed has not, and is good up to its last whole message.

use rerun::external::re_log_encoding::{Decodable, Decoder, MessageHeader, MessageKind, StreamHeader};
use rerun::log::{Chunk, LogMsg};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// How a recording ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It was ended, or stops after a whole message: a run that goes on, or was killed.
    Whole,
    /// It breaks off within a message; so many bytes before that are good.
    CutShort(u64),
}

/// Looks at a recording's messages without reading what is in them, but for the first data.
///
/// # Errors
/// What is wrong with it, as the end of a line that begins with its path: it cannot be read, is no recording, or holds
/// nothing to show.
pub fn check(path: &Path) -> Result<Ending, String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let length = file.metadata().map_err(|error| error.to_string())?.len();
    let ending = walk(&mut BufReader::new(file), length)?;
    if holds_data(path) {
        return Ok(ending);
    }
    Err(match ending {
        Ending::Whole => "holds no data".to_owned(),
        Ending::CutShort(bytes) => format!("is cut short after {bytes} bytes, before its first data"),
    })
}

/// Goes from message to message.
fn walk(file: &mut (impl Read + Seek), length: u64) -> Result<Ending, String> {
    let not_one = || "is not a Rerun recording".to_owned();
    let mut header = [0; StreamHeader::ENCODED_SIZE_BYTES];
    if length < header.len() as u64 {
        return Err(if length == 0 { "is empty".to_owned() } else { not_one() });
    }
    file.read_exact(&mut header).map_err(|error| error.to_string())?;
    StreamHeader::from_rrd_bytes(&header).map_err(|_| not_one())?;
    let mut good = header.len() as u64;
    let mut header = [0; MessageHeader::ENCODED_SIZE_BYTES];
    while good < length {
        if length - good < header.len() as u64 {
            return Ok(Ending::CutShort(good));
        }
        file.read_exact(&mut header).map_err(|error| error.to_string())?;
        let Ok(message) = MessageHeader::from_rrd_bytes(&header) else { return Ok(Ending::CutShort(good)) };
        let end = (good + header.len() as u64).saturating_add(message.len);
        if end > length {
            return Ok(Ending::CutShort(good));
        }
        if message.kind == MessageKind::End {
            return Ok(Ending::Whole);
        }
        file.seek(SeekFrom::Start(end)).map_err(|error| error.to_string())?;
        good = end;
    }
    Ok(Ending::Whole)
}

/// Whether there is a whole message with data of a recording: its name and its layout alone show nothing.
fn holds_data(path: &Path) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let is_shown = |chunk: &Chunk| !chunk.entity_path().to_string().starts_with("/__properties");
    let is_data = |message: &LogMsg| match message {
        LogMsg::ArrowMsg(store, arrow) if store.is_recording() => {
            Chunk::from_arrow_msg(arrow).is_ok_and(|chunk| is_shown(&chunk))
        }
        _ => false,
    };
    Decoder::<LogMsg>::decode_lazy(BufReader::new(file)).map_while(Result::ok).any(|message| is_data(&message))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small recording with its layout, ended or as a killed run leaves it.
    fn recording(path: &Path) {
        let stream = rerun::RecordingStreamBuilder::new("test").send_properties(false).save(path).expect("file");
        stream.send_recording_name("a name").expect("named");
        let layout = crate::record::layout::standard("", crate::picture::FloorPlan { size: [8, 4] });
        layout.send(&stream, "test").expect("layout");
        for step in 0..3_i64 {
            stream.set_time_sequence("step", step);
            stream.log("a", &rerun::Points3D::new([[0.0_f32, 1.0, 2.0]])).expect("logged");
            stream.flush_blocking().expect("flushed");
        }
        stream.disconnect();
    }

    #[test]
    fn a_recording_that_is_cut_short_is_told_from_one_that_shows_something() {
        let folder = tempfile::tempdir().expect("folder");
        let whole = folder.path().join("whole.rrd");
        recording(&whole);
        assert_eq!(check(&whole), Ok(Ending::Whole));
        let bytes = std::fs::read(&whole).expect("read");
        let cut = |length: usize| {
            let path = folder.path().join("cut.rrd");
            std::fs::write(&path, &bytes[..length]).expect("written");
            check(&path)
        };
        assert_eq!(cut(0), Err("is empty".to_owned()));
        assert_eq!(cut(7), Err("is not a Rerun recording".to_owned()));
        // What it begins with is the store's name and the layout.
        let early = cut(200).expect_err("nothing to show");
        assert!(early.starts_with("is cut short after ") && early.ends_with("before its first data"), "{early}");
        let mut kinds = std::collections::BTreeSet::new();
        for length in (200..bytes.len()).step_by(bytes.len() / 97) {
            kinds.insert(match cut(length) {
                Ok(Ending::Whole) => "whole",
                Ok(Ending::CutShort(good)) => {
                    assert!(good < length as u64);
                    "cut, but shows something"
                }
                Err(_) => "shows nothing",
            });
        }
        assert!(kinds.contains("cut, but shows something") && kinds.contains("shows nothing"), "{kinds:?}");
        let text = folder.path().join("text.rrd");
        std::fs::write(&text, "this is no recording at all").expect("written");
        assert_eq!(check(&text), Err("is not a Rerun recording".to_owned()));
        assert!(check(&folder.path().join("none.rrd")).is_err());
    }
}
