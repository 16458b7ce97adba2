//! Going on with the recording of a run that was stopped: what it holds is copied, message by message.

use super::disk::Disk;
use super::paths;
use rerun::StoreId;
use rerun::external::re_log_encoding::Decoder;
use rerun::log::{Chunk, LogMsg};
use rerun::sink::LogSink;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Copies what the recording `from` holds of the first `steps` steps, and tells whose recording it is. `None` for one that does
/// not hold all of them.
pub(super) fn copy(from: &Path, to: &Disk, steps: usize) -> Option<StoreId> {
    let (mut store, mut last) = (None, None);
    for message in Decoder::<LogMsg>::decode_lazy(BufReader::new(File::open(from).ok()?)).map_while(Result::ok) {
        if let LogMsg::SetStoreInfo(info) = &message
            && info.info.store_id.is_recording()
        {
            store = Some(info.info.store_id.clone());
        }
        if let LogMsg::ArrowMsg(of, arrow) = &message
            && of.is_recording()
            && let Some([first, end]) = steps_of(&Chunk::from_arrow_msg(arrow).ok()?)
        {
            // The step in which the run was stopped is done and recorded again.
            if first > steps as i64 {
                continue;
            }
            last = last.max(Some(end));
        }
        to.send(message);
    }
    store.filter(|_| last >= Some(steps as i64))
}

/// First and last step that a chunk is about.
fn steps_of(chunk: &Chunk) -> Option<[i64; 2]> {
    let range = chunk.timelines().iter().find(|(name, _)| name.as_str() == paths::TIMELINE)?.1.time_range();
    Some([range.min().as_i64(), range.max().as_i64()])
}
