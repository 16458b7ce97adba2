//! MCAP files, record by record: everything is read once in order, and single messages again when they are asked for, so that
//! a recording of any size takes no more memory than its largest chunk.
//!
//! A file is `MAGIC`, then records: an opcode, the length of the body as eight bytes, the body (specification at mcap.dev). Chunks,
//! compressed or not, hold records of the same kind. The crate `mcap` unpacks them.

use crate::wall::guarded;
use crate::{Error, Result};
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// A chunk or message that is larger than this is refused, bytes: twice what the largest image needs.
const MAX_BYTES: u64 = 1 << 27;

/// What a channel carries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Channel {
    pub(super) topic: String,
    /// The message's type, `sensor_msgs/msg/Image`.
    pub(super) kind: String,
}

/// Where a message is: in which record of the file, and which message of that record's.
#[derive(Clone, Debug)]
pub(super) struct Address {
    pub(super) file: Arc<PathBuf>,
    pub(super) topic: Arc<str>,
    start: u64,
    length: u64,
    opcode: u8,
    /// Position among the messages of a chunk.
    nth: usize,
}

/// What is done with a message: its channel, its address and its bytes.
type Each<'a> = dyn FnMut(&Channel, Address, &[u8]) -> Result<()> + 'a;

/// Calls `each` with the channel, the address and the bytes of every message, in the order of the file.
///
/// # Errors
/// [`Error::Input`] for what is no MCAP file, is cut short, or has a chunk that cannot be unpacked; what `each` says.
pub(super) fn scan(path: &Path, each: &mut Each<'_>) -> Result<()> {
    let mut file = BufReader::new(File::open(path).map_err(|error| Error::io(path, error))?);
    let size = file.get_ref().metadata().map_err(|error| Error::io(path, error))?.len();
    let fail = |words: String| Error::input(path, "", words);
    let cut = || fail("is cut short: it ends in the middle of a record".to_owned());
    let mut magic = [0; 8];
    if file.read_exact(&mut magic).is_err() || magic != MAGIC {
        return Err(fail("is no MCAP file".to_owned()));
    }
    let shared = Arc::new(path.to_owned());
    let mut scan = Scan { path: shared, schemas: BTreeMap::new(), channels: BTreeMap::new(), each };
    let mut at = MAGIC.len() as u64;
    let mut ended = false;
    while at < size {
        let mut head = [0; 9];
        file.read_exact(&mut head).map_err(|_| cut())?;
        let opcode = head[0];
        let length = u64::from_le_bytes(std::array::from_fn(|byte| head[byte + 1]));
        if matches!(opcode, op::DATA_END | op::FOOTER) {
            ended = true;
            break;
        }
        let start = at + 9;
        if length > size - start.min(size) {
            return Err(cut());
        }
        if matches!(opcode, op::CHUNK | op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            let body = body(&mut file, length).map_err(|words| if words.is_empty() { cut() } else { fail(words) })?;
            scan.record(opcode, &body, start, length)?;
        } else {
            file.seek_relative(length as i64).map_err(|error| Error::io(path, error))?;
        }
        at = start + length;
    }
    if ended { Ok(()) } else { Err(cut()) }
}

/// A record's body; empty words where the file ends first.
fn body(file: &mut impl Read, length: u64) -> std::result::Result<Vec<u8>, String> {
    if length > MAX_BYTES {
        return Err(format!("has a record of {length} bytes; at most {MAX_BYTES} are read"));
    }
    let mut body = vec![0; length as usize];
    file.read_exact(&mut body).map_err(|_| String::new())?;
    Ok(body)
}

/// What a record says that a recording needs. (The crate's own reader asks for as much memory as a bent length says.)
enum Record<'a> {
    Schema { id: u16, name: String },
    Channel { id: u16, schema: u16, topic: String },
    Message { channel: u16, data: &'a [u8] },
    Other,
}

impl<'a> Record<'a> {
    /// The record of a body, or in words that there is none.
    fn read(opcode: u8, body: &'a [u8]) -> std::result::Result<Self, String> {
        Self::parse(opcode, body).ok_or_else(|| format!("has a record that is damaged (of opcode {opcode})"))
    }

    fn parse(opcode: u8, body: &'a [u8]) -> Option<Self> {
        let mut rest = body;
        let mut take = |count: usize| -> Option<&'a [u8]> { rest.split_off(..count) };
        let mut u16 = || take(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
        match opcode {
            op::SCHEMA => Some(Self::Schema { id: u16()?, name: string(body.get(2..)?)? }),
            op::CHANNEL => Some(Self::Channel { id: u16()?, schema: u16()?, topic: string(body.get(4..)?)? }),
            // Its channel, its number (4 bytes) and two times (8 bytes each).
            op::MESSAGE => Some(Self::Message { channel: u16()?, data: body.get(22..)? }),
            _ => Some(Self::Other),
        }
    }
}

/// A string behind its length.
fn string(bytes: &[u8]) -> Option<String> {
    let (length, bytes) = bytes.split_first_chunk()?;
    let bytes = bytes.get(..u32::from_le_bytes(*length) as usize)?;
    std::str::from_utf8(bytes).ok().map(str::to_owned)
}

struct Scan<'a> {
    path: Arc<PathBuf>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, (Channel, Arc<str>)>,
    each: &'a mut Each<'a>,
}

impl Scan<'_> {
    fn record(&mut self, opcode: u8, body: &[u8], start: u64, length: u64) -> Result<()> {
        let path = self.path.clone();
        let address = |nth: usize, topic: &Arc<str>| Address {
            file: path.clone(),
            topic: topic.clone(),
            start,
            length,
            opcode,
            nth,
        };
        let mut nth = 0;
        for_each(opcode, body, &path, &mut |record| {
            match record {
                Record::Schema { id, name } => {
                    self.schemas.insert(id, name);
                }
                Record::Channel { id, schema, topic } => {
                    let kind = self.schemas.get(&schema).cloned().unwrap_or_default();
                    let shared: Arc<str> = topic.as_str().into();
                    self.channels.insert(id, (Channel { topic, kind }, shared));
                }
                Record::Message { channel, data } => {
                    if let Some((channel, topic)) = self.channels.get(&channel) {
                        (self.each)(channel, address(nth, topic), data)?;
                    }
                    nth += 1;
                }
                Record::Other => {}
            }
            Ok(true)
        })
    }
}

/// Hands over the record, or those of a chunk, until `take` has enough.
fn for_each(opcode: u8, body: &[u8], path: &Path, take: &mut dyn FnMut(Record<'_>) -> Result<bool>) -> Result<()> {
    let broken = |error: &mcap::McapError| format!("has a chunk that is damaged ({error})");
    let mut outcome = Ok(());
    let read = guarded(|| {
        if opcode != op::CHUNK {
            outcome = take(Record::read(opcode, body)?).map(drop);
            return Ok(());
        }
        // A chunk may say of itself that it unpacks to any size, and so may the records in it: only this reader has a limit.
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(MAX_BYTES as usize);
        let mut reader = LinearReader::new_with_options(options);
        let mut head = vec![opcode];
        head.extend((body.len() as u64).to_le_bytes());
        let mut source = head.as_slice().chain(body);
        while let Some(event) = reader.next_event() {
            match event.map_err(|error| broken(&error))? {
                LinearReadEvent::ReadRequest(need) => {
                    let buffer = reader.insert(need.min(head.len() + body.len()));
                    let count = source.read(buffer).map_err(|error| broken(&error.into()))?;
                    reader.notify_read(count);
                }
                LinearReadEvent::Record { data, opcode } => match take(Record::read(opcode, data)?) {
                    Ok(true) => {}
                    Ok(false) => break,
                    Err(error) => {
                        outcome = Err(error);
                        break;
                    }
                },
            }
        }
        Ok(())
    });
    read.map_err(|words| Error::input(path, "", words))?;
    outcome
}

/// Reads a message again.
pub(super) fn message(address: &Address) -> Result<Vec<u8>> {
    let path = address.file.as_path();
    let io = |error| Error::io(path, error);
    let mut file = File::open(path).map_err(io)?;
    file.seek(SeekFrom::Start(address.start)).map_err(io)?;
    let gone = || Error::input(path, "", "has changed while it was read");
    let body = body(&mut file, address.length).map_err(|_| gone())?;
    let (mut nth, mut found) = (0, None);
    for_each(address.opcode, &body, path, &mut |record| {
        if let Record::Message { data, .. } = record {
            if nth == address.nth {
                found = Some(data.to_vec());
                return Ok(false);
            }
            nth += 1;
        }
        Ok(true)
    })?;
    found.ok_or_else(gone)
}
