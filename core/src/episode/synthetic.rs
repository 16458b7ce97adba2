//! Episodes for tests: a small made-up one for files, without camera, world or planner in it, and a real one on a
//! coarse grid.

use super::judgement::Judgement;
use super::machine::Episode;
use super::record::{EpisodeConfig, EpisodeRecord, FORMAT, StepRecord, StepSeconds};
use crate::belief::{Belief, Classical};
use crate::camera::ViewId;
use crate::made_by::{Build, MadeBy};
use crate::plan::{Action, CandidateRecord, Decision, PlannerSettings, PolicyKind, Reason, Rule};
use crate::rng;
use crate::scene::{BACKGROUND, CLASS_COUNT, Catalog, Object, Scene, Shelf};
use crate::score::{ObjectVerdict, Scores, Verdict};
use crate::skill::{Push, Rejection, Stage};
use crate::world::TruthMap;
use rand::Rng;
use std::sync::Arc;

/// A shelf of 12 x 8 x 6 voxels of 1 cm with one can.
pub fn scene() -> Scene {
    let mut shelf = Shelf::new([0.12, 0.08, 0.06]);
    shelf.voxel_m = 0.01;
    Scene {
        name: "made up".to_owned(),
        description: "one can, \u{201c}quoted\u{201d}".to_owned(),
        shelf,
        objects: vec![Object::new("tomato_can", [0.0, 0.04], 12.5)],
        meshes: Default::default(),
        robot: Default::default(),
    }
}

/// The record of `steps` steps, of which the second is a push.
pub fn record(steps: usize) -> EpisodeRecord {
    let scores = |index: usize| Scores {
        occupancy_iou: 0.1 * index as f64,
        occupied_iou: 1.0 / 3.0,
        semantic_miou: 0.25,
        entropy_nats: 1e5 / (1.0 + index as f64),
        mece_occupancy: 0.2,
        mece_semantics: 0.1,
    };
    let step = |index: usize| {
        let mut rng = rng::stream(3, "synthetic", index as u64);
        let push = Push { start: [0.01, 0.02, 0.06], direction_deg: 87.3, length_m: 0.1 };
        let action = if index == 2 { Action::Manipulate(push.into()) } else { Action::Look { view: ViewId(17) } };
        let gains: Vec<f32> = (0..300).map(|_| rng.random_range(0.0..5000.0)).collect();
        let weighed = CandidateRecord {
            gain: Some(gains[0]),
            view: Some(ViewId(3)),
            reg: Some(-0.7),
            motion_s: Some(6.25),
            ..CandidateRecord::of(push)
        };
        let rejection = Some(Rejection::Unreachable { stage: Stage::Start });
        let candidates = vec![weighed, CandidateRecord { rejection, ..CandidateRecord::of(push) }];
        StepRecord {
            index,
            action,
            decision: Decision {
                action,
                reason: Reason::LookTellsMore,
                igv: gains[0] + gains[1],
                igm: gains[2],
                reg: -gains[3],
                pair: vec![ViewId(17), ViewId(4)],
                gains,
                candidates,
                best_push: Some(0),
                motion: None,
                rule: Some(Rule::default()),
            },
            entropy_nats: scores(index).entropy_nats,
            judgement: Some(Judgement {
                scores: scores(index),
                objects: vec![ObjectVerdict {
                    object: Some(0),
                    class: "tomato_can".to_owned(),
                    verdict: Verdict::NotFound,
                    position: [0.0, 0.04],
                }],
                dropped: if index == 2 { vec!["tomato_can#0".to_owned()] } else { Vec::new() },
                displacement_m: 0.01 * index as f64,
            }),
            motion_s: 1.5 * index as f64,
            push: None,
            seconds: StepSeconds { decide: 0.1, act: 0.2, update: 0.3, record: 0.4 },
        }
    };
    EpisodeRecord {
        format: FORMAT,
        version: crate::VERSION.to_owned(),
        made_by: Some(MadeBy::new(Build::default(), None, PlannerSettings::default(), 1)),
        also_made_by: Vec::new(),
        scene: scene(),
        config: EpisodeConfig {
            policy: PolicyKind::RandomPush5Blind,
            belief: "classical".to_owned(),
            seed: u64::MAX,
            budget: 4,
            views: "standard300".to_owned(),
            planner: PlannerSettings::default(),
            noise: None,
        },
        recorded_views: None,
        prior: scores(0).into(),
        steps: (1..=steps).map(step).collect(),
    }
}

/// A belief that is another for every `index`, 0 the prior.
pub fn belief(index: usize) -> Belief {
    let mut belief = Belief::uniform(scene().grid());
    if index > 0 {
        let mut rng = rng::stream(5, "synthetic", index as u64);
        belief.occupancy.iter_mut().flatten().for_each(|a| *a = rng.random_range(0.0..40.0));
        belief.semantics.iter_mut().flatten().for_each(|a| *a = rng.random_range(1.0..300.0));
    }
    belief
}

/// A truth that is another for every `index`.
pub fn truth(index: usize) -> TruthMap {
    let grid = scene().grid();
    let mut rng = rng::stream(6, "synthetic", index as u64);
    TruthMap {
        dims: grid.dims,
        occupancy: (0..grid.voxel_count()).map(|_| rng.random_range(0..2)).collect(),
        labels: (0..grid.cell_count())
            .map(|_| if rng.random() { BACKGROUND.0 } else { rng.random_range(0..CLASS_COUNT as u8) })
            .collect(),
        objects: vec![u16::MAX; grid.cell_count()],
    }
}

/// A shelf with 1 cm voxels and six objects, some behind others.
pub fn cluttered_scene() -> Scene {
    let mut shelf = Shelf::new([0.80, 0.40, 0.40]);
    shelf.voxel_m = 0.01;
    let objects = [
        ("cracker_box", [-0.20, 0.15], 80.0),
        ("tomato_can", [-0.20, 0.28], 0.0),
        ("pasta_box", [0.02, 0.18], 10.0),
        ("coffee_can", [0.03, 0.31], 0.0),
        ("mustard_bottle", [0.22, 0.12], 30.0),
        ("meat_can", [0.25, 0.28], 5.0),
    ];
    let objects = objects.into_iter().map(|(class, position, yaw_deg)| Object::new(class, position, yaw_deg)).collect();
    Scene {
        name: "cluttered".to_owned(),
        description: String::new(),
        shelf,
        objects,
        meshes: Default::default(),
        robot: Default::default(),
    }
}

/// The configuration of a classical episode.
pub fn config(policy: PolicyKind, budget: usize) -> EpisodeConfig {
    EpisodeConfig {
        policy,
        belief: "classical".to_owned(),
        seed: 11,
        budget,
        views: "standard300".to_owned(),
        planner: PlannerSettings { candidates: 12, ..PlannerSettings::default() },
        noise: None,
    }
}

/// A classical episode on the cluttered scene.
pub fn episode(policy: PolicyKind, budget: usize) -> Episode {
    episode_with(config(policy, budget))
}

/// A classical episode on the cluttered scene with the given configuration.
pub fn episode_with(config: EpisodeConfig) -> Episode {
    Episode::new(cluttered_scene(), Arc::new(Catalog::standard()), config, Arc::new(Classical)).expect("an episode")
}
