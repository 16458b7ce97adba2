//! A scripted episode for tests: real images, real pushes and the classical belief, with made-up gains.

use nudge_core::arm::ArmTool;
use nudge_core::belief::{Belief, BeliefUpdate, Classical};
use nudge_core::camera::{self, ViewArray, ViewId};
use nudge_core::episode::{EpisodeConfig, EpisodeRecord, FORMAT, Judgement, StepOutcome, StepRecord, StepSeconds};
use nudge_core::plan::{Action, CandidateRecord, Decision, PlannerSettings, PolicyKind, Reason};
use nudge_core::rng;
use nudge_core::scene::{Body, Catalog, GenerateConfig, Scene, generate};
use nudge_core::score::{Scores, object_verdicts};
use nudge_core::skill::SweptManipulation;
use nudge_core::skill::push::{PushSampler, sample};
use nudge_core::world::{TruthMap, World};

/// An episode with everything that it went through.
pub struct Played {
    pub catalog: Catalog,
    pub views: ViewArray,
    pub record: EpisodeRecord,
    /// By number of actions, 0 first.
    pub bodies: Vec<Vec<Body>>,
    pub beliefs: Vec<Belief>,
    pub truths: Vec<TruthMap>,
    /// By step, the first action's first.
    pub outcomes: Vec<StepOutcome>,
}

/// Plays `steps` actions: every fifth is a push, the others look from all over the array.
pub fn play(steps: usize) -> Played {
    let catalog = Catalog::standard();
    let mut scene = generate(&catalog, &GenerateConfig::default(), 5).expect("scene");
    scene.name = "demo shelf".into();
    let views = ViewArray::named("standard300").expect("views");
    let (shelf, grid, arm) = (scene.shelf, scene.grid(), ArmTool::standard(scene.shelf));
    let mut world = World::new(shelf, scene.bodies(&catalog).expect("bodies"));
    world.settle();
    let mut belief = Belief::uniform(grid);
    let mut truth = TruthMap::of(&grid, &world.bodies());
    let mut played = Played {
        record: record(scene, Scores::of(&belief, &truth), steps),
        bodies: vec![world.bodies()],
        beliefs: vec![belief.clone()],
        truths: vec![truth.clone()],
        outcomes: Vec::new(),
        catalog,
        views,
    };
    for index in 1..=steps {
        let mut decision = decision(&played.views, index);
        let mut outcome = None;
        if index % 5 == 4 {
            let mut stream = rng::stream(7, "fixture-pushes", index as u64);
            let candidates = sample(PushSampler::Frontier, &belief, None, &arm, 80, &mut stream);
            let mut rank = 0.0;
            decision.candidates = candidates
                .iter()
                .map(|c| {
                    rank += 1.0;
                    let feasible = c.rejection.is_none();
                    CandidateRecord {
                        rejection: c.rejection.clone(),
                        gain: feasible.then_some(900.0 - 7.0 * rank),
                        view: feasible.then_some(ViewId(rank as u16 * 3)),
                        reg: feasible.then_some(-3.0 * rank),
                        ..CandidateRecord::of(c.manipulation)
                    }
                })
                .collect();
            decision.best_push = candidates.iter().position(|c| c.rejection.is_none());
            if let Some(best) = decision.best_push {
                let (manipulation, swept) = (candidates[best].manipulation, candidates[best].swept.clone());
                let swept = SweptManipulation { manipulation, swept };
                let prediction = Classical.predict(&belief, &[swept.intervention(&belief)]).remove(0);
                decision.action = Action::Manipulate(manipulation);
                decision.reason = Reason::PushTellsMore;
                let pushed = world.execute(&arm.arm, candidates[best].motion.as_ref().expect("of a feasible one"));
                belief.apply(&prediction);
                truth = TruthMap::of(&grid, &world.bodies());
                outcome = Some((swept, prediction, pushed));
            }
        }
        let mut frame = None;
        let mut observation = None;
        if let Action::Look { view } = decision.action {
            let view = played.views.view(view).expect("view");
            let taken = camera::render(&shelf, &world.bodies(), view, &played.views.intrinsics).frame;
            let seen = camera::project(&taken, &shelf);
            belief = Classical.observe(&belief, &seen);
            (frame, observation) = (Some(taken), Some(seen));
        }
        let step = StepRecord {
            index,
            action: decision.action,
            decision,
            entropy_nats: Scores::of(&belief, &truth).entropy_nats,
            judgement: Some(Judgement {
                scores: Scores::of(&belief, &truth),
                objects: object_verdicts(&belief, &truth, &played.catalog),
                dropped: Vec::new(),
                displacement_m: 0.0,
            }),
            motion_s: 0.0,
            push: None,
            seconds: StepSeconds::default(),
        };
        played.record.steps.push(step.clone());
        let (swept, prediction, manipulated) = match outcome {
            Some((swept, prediction, pushed)) => (Some(swept), Some(prediction), Some(pushed)),
            None => (None, None, None),
        };
        played.outcomes.push(StepOutcome {
            record: step,
            frame,
            observation,
            swept,
            prediction,
            manipulated,
            motion: None,
        });
        played.bodies.push(world.bodies());
        played.beliefs.push(belief.clone());
        played.truths.push(truth.clone());
    }
    played
}

/// The same as a log of an episode whose truth nobody knows.
pub fn without_truth(record: &EpisodeRecord) -> EpisodeRecord {
    let mut record = record.clone();
    record.scene.objects.clear();
    record.prior.scores = None;
    record.steps.iter_mut().for_each(|step| step.judgement = None);
    record
}

fn record(scene: Scene, prior: Scores, budget: usize) -> EpisodeRecord {
    EpisodeRecord {
        format: FORMAT,
        version: nudge_core::VERSION.to_owned(),
        made_by: None,
        also_made_by: Vec::new(),
        scene,
        config: EpisodeConfig {
            policy: PolicyKind::Mem,
            belief: "classical".into(),
            seed: 1,
            budget,
            views: "standard300".into(),
            planner: PlannerSettings::default(),
            noise: None,
        },
        recorded_views: None,
        prior: prior.into(),
        steps: Vec::new(),
    }
}

fn decision(views: &ViewArray, index: usize) -> Decision {
    let count = views.views.len();
    let view = ViewId((index * 97 % count) as u16);
    let second = ViewId(((index * 97 + 131) % count) as u16);
    let gains = (0..count).map(|at| 500.0 + 300.0 * ((at * 7 + index * 31) as f32 * 0.02).sin()).collect();
    Decision {
        igv: 1234.5,
        pair: vec![view, second],
        gains,
        ..Decision::unweighed(Action::Look { view }, Reason::LookTellsMore)
    }
}
