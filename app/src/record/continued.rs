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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driver::{Driver, RECORDING};
    use nudge_core::belief::Classical;
    use nudge_core::episode::{Episode, EpisodeConfig, Frames, Overwrite};
    use nudge_core::plan::{PlannerSettings, PolicyKind};
    use nudge_core::scene::{Catalog, GenerateConfig, Shelf, generate};
    use std::collections::{BTreeMap, BTreeSet};
    use std::sync::Arc;

    /// What a recording holds: its stores, and for every entity the steps with data.
    fn content(path: &Path) -> (BTreeSet<String>, BTreeMap<String, BTreeSet<i64>>) {
        let (mut stores, mut steps) = (BTreeSet::new(), BTreeMap::<String, BTreeSet<i64>>::new());
        let file = BufReader::new(File::open(path).expect("there"));
        for message in Decoder::<LogMsg>::decode_lazy(file).map(|message| message.expect("whole")) {
            let LogMsg::ArrowMsg(store, arrow) = message else { continue };
            if !store.is_recording() {
                continue;
            }
            stores.insert(store.recording_id().to_string());
            let chunk = Chunk::from_arrow_msg(&arrow).expect("a chunk");
            if let Some([first, last]) = steps_of(&chunk) {
                steps.entry(chunk.entity_path().to_string()).or_default().extend(first..=last);
            }
        }
        (stores, steps)
    }

    #[test]
    fn the_recording_of_a_run_that_was_stopped_twice_is_whole() {
        let folder = tempfile::tempdir().expect("folder");
        let catalog = Arc::new(Catalog::standard());
        let shelf = Shelf { voxel_m: 0.01, ..Shelf::new([0.60, 0.35, 0.30]) };
        let around = GenerateConfig { fill: [0.15, 0.25], shelf, ..GenerateConfig::default() };
        let scene = generate(&catalog, &around, 3).expect("scene");
        let config = EpisodeConfig {
            policy: PolicyKind::RandomPush5,
            belief: "classical".to_owned(),
            seed: 1,
            budget: 7,
            views: "real75".to_owned(),
            planner: PlannerSettings { candidates: 8, ..PlannerSettings::default() },
            noise: None,
        };
        let start = |out: &Path| {
            let (scene, config, update) = (scene.clone(), config.clone(), Arc::new(Classical));
            let episode = Episode::new(scene, catalog.clone(), config, update).expect("an episode");
            Driver::start(episode, out, Overwrite::Refuse, Frames::Filed).expect("started")
        };
        let go_on = |out: &Path| {
            let mut repeated = 0;
            let driver = Driver::go_on(out, catalog.clone(), Arc::new(Classical), &mut |_, _| {
                repeated += 1;
                Ok(())
            });
            assert_eq!(repeated, 0, "nothing is repeated");
            driver.expect("goes on")
        };
        let act = |driver: &mut Driver, times: usize| {
            for _ in 0..times {
                let decision = driver.decide();
                driver.act(decision).expect("an action");
            }
        };
        let (whole, stopped) = (folder.path().join("whole"), folder.path().join("stopped"));
        let mut driver = start(&whole);
        act(&mut driver, 7);
        driver.finish().expect("finished");
        let mut driver = start(&stopped);
        act(&mut driver, 2);
        drop(driver);
        let mut driver = go_on(&stopped);
        act(&mut driver, 4);
        drop(driver);
        // What a kill leaves: half a message at the end.
        let recording = stopped.join(RECORDING);
        let bytes = std::fs::read(&recording).expect("read");
        std::fs::write(&recording, [&bytes[..], &bytes[..50]].concat()).expect("written");
        let mut driver = go_on(&stopped);
        act(&mut driver, 1);
        driver.finish().expect("finished");
        let (expected, found) = (content(&whole.join(RECORDING)), content(&recording));
        assert_eq!(found.0.len(), 1, "one recording, not three");
        assert_eq!(found.1, expected.1);
        assert!(!stopped.join("checkpoints").exists() && stopped.join("frames/005.push").is_file());

        // Without its recording the log is repeated, and recorded anew.
        let mut driver = start(&folder.path().join("lost"));
        act(&mut driver, 1);
        drop(driver);
        let lost = folder.path().join("lost");
        std::fs::remove_file(lost.join(RECORDING)).expect("removed");
        let mut repeated = 0;
        let driver = Driver::go_on(&lost, catalog.clone(), Arc::new(Classical), &mut |_, _| {
            repeated += 1;
            Ok(())
        });
        driver.expect("goes on").finish().expect("finished");
        assert_eq!(repeated, 2);
        assert!(content(&lost.join(RECORDING)).1["/belief/occupancy"].contains(&1));
    }
}
