//! Open episodes for tests of the window: short real ones on a small generated scene with coarse voxels.

use super::derive::Derived;
use super::half_belief::HalfBelief;
use super::model::{GainSource, Model, Preview};
use super::packed_frame::PackedFrame;
use super::session::{Activity, Moment, Session, SessionId, Setup};
use nudge_core::belief::{BeliefUpdate, Classical};
use nudge_core::camera::ViewId;
use nudge_core::episode::{Episode, EpisodeConfig, EpisodeRecord, StepOutcome};
use nudge_core::gain::RayDensity;
use nudge_core::plan::{Action, Decision, Gain, PlannerSettings, PolicyKind, Reason};
use nudge_core::scene::{Catalog, GenerateConfig, Scene, Shelf, generate};
use nudge_core::skill::intended;
use nudge_core::world::TruthMap;
use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

/// An episode that was played, to make sessions of.
#[derive(Clone)]
pub struct Played {
    record: EpisodeRecord,
    setup: Setup,
    moments: Vec<Arc<Moment>>,
    pending: Option<Arc<Decision>>,
}

/// How an episode is played.
pub struct Script {
    /// On which scene.
    pub scene: Scene,
    /// With which policy, belief, seed and budget.
    pub config: EpisodeConfig,
    /// Number of actions done.
    pub steps: usize,
    /// The action, counted from 1, in which the best push is done whatever the policy says; 0 for none.
    pub push_at: usize,
    /// The action, counted from 1, from which on views are looked from that the policy did not choose; 0 for none.
    pub stray_at: usize,
}

impl Script {
    /// Three looks, a push and a look on a small scene, with one action left.
    pub fn small() -> Self {
        let catalog = Catalog::standard();
        let shelf = Shelf { voxel_m: 0.01, ..Shelf::new([0.60, 0.35, 0.30]) };
        let around = GenerateConfig { fill: [0.20, 0.28], shelf, ..GenerateConfig::default() };
        let mut scene = generate(&catalog, &around, 3).expect("scene");
        scene.name = "small shelf".to_owned();
        let config = EpisodeConfig {
            policy: PolicyKind::Mem,
            belief: "classical".to_owned(),
            seed: 1,
            budget: 6,
            views: "real75".to_owned(),
            planner: PlannerSettings { candidates: 8, ..PlannerSettings::default() },
            noise: None,
        };
        Self { scene, config, steps: 5, push_at: 4, stray_at: 0 }
    }

    /// Plays it.
    pub fn play(self) -> Played {
        let catalog = Arc::new(Catalog::standard());
        let update: Arc<dyn BeliefUpdate> = Arc::new(Classical);
        let mut episode = Episode::new(self.scene, catalog.clone(), self.config, update.clone()).expect("episode");
        let setup = Setup {
            catalog,
            views: Arc::new(episode.views().clone()),
            update: Some(update),
            arm: episode.arm().clone(),
            unreachable: Arc::new(episode.unreachable_views().to_vec()),
            hidden: Some(Arc::new(vec!["tomato_can#1".to_owned()])),
        };
        let mut truth = Arc::new(episode.truth().expect("a truth").clone());
        let mut moments = vec![moment(&episode, None, &mut truth)];
        for step in 1..=self.steps {
            let mut decision = episode.decide();
            let best = decision.best_push.and_then(|at| decision.candidates.get(at)).map(|best| best.manipulation);
            if let Some(push) = best.filter(|_| step == self.push_at) {
                (decision.action, decision.reason) = (Action::Manipulate(push), Reason::Manual);
            } else if self.stray_at > 0 && step >= self.stray_at {
                let view = ViewId((step * 7 % setup.views.views.len()) as u16);
                (decision.action, decision.reason) = (Action::Look { view }, Reason::Manual);
            }
            let outcome = episode.act(decision).expect("act");
            moments.push(moment(&episode, Some(outcome), &mut truth));
        }
        let pending = (!episode.is_finished()).then(|| Arc::new(episode.decide()));
        Played { record: episode.record().clone(), setup, moments, pending }
    }
}

fn moment(episode: &Episode, mut outcome: Option<StepOutcome>, truth: &mut Arc<TruthMap>) -> Arc<Moment> {
    let frame = PackedFrame::taken_from(outcome.as_mut());
    let now = episode.truth().expect("a truth");
    if **truth != *now {
        *truth = Arc::new(now.clone());
    }
    let record = episode.record();
    Arc::new(Moment {
        step: record.steps.len(),
        belief: HalfBelief::of(episode.belief()),
        seen: Arc::new(episode.seen().clone()),
        truth: Some(truth.clone()),
        bodies: Arc::new(episode.bodies()),
        scores: record.scores_after(record.steps.len()).copied(),
        entropy_nats: record.entropy_after(record.steps.len()),
        outcome: outcome.map(Arc::new),
        frame,
        is_whole: true,
    })
}

impl Played {
    /// An open episode, idle, with the next decision pending.
    pub fn session(&self, id: u32) -> Session {
        Session {
            id: SessionId(id),
            path: PathBuf::from("out/small-shelf-mem-1"),
            record: self.record.clone(),
            setup: self.setup.clone(),
            moments: self.moments.clone(),
            pending: self.pending.clone(),
            activity: Activity::Idle,
            queued: false,
            pausing: false,
            read_only: None,
            annotations: crate::annotations::Annotations::default(),
            unsaved: false,
        }
    }
}

static SMALL: LazyLock<Played> = LazyLock::new(|| Script::small().play());
static STRAY: LazyLock<Played> =
    LazyLock::new(|| Script { stray_at: 2, push_at: 0, steps: 3, ..Script::small() }.play());

/// Five actions, the fourth of them a push; budget six.
pub fn session(id: u32) -> Session {
    SMALL.session(id)
}

/// The same scene and first action, then other views; three actions.
pub fn stray_session(id: u32) -> Session {
    STRAY.session(id)
}

/// A model that shows an episode at its last state, with everything painted that the background would.
pub fn model_of(sessions: Vec<Session>) -> Model {
    let mut model = Model { shown: sessions.first().map(|session| session.id), ..Model::default() };
    model.cursor = sessions.first().map_or(0, Session::steps);
    for session in &sessions {
        for moment in &session.moments {
            let derived = Derived::of(session.id, moment, &session.setup.catalog);
            model.derived.insert(derived.of, Arc::new(derived));
        }
    }
    model.sessions = sessions;
    model
}

/// [`model_of`] the one small episode.
pub fn model() -> Model {
    model_of(vec![session(1)])
}

/// Answers what a model asks about its candidate and its view, as the background would.
pub fn answer(model: &mut Model) {
    let Some(session) = model.session() else { return };
    let step = model.cursor.min(session.steps());
    let belief = session.moment(step).belief.belief();
    let candidate = model.candidate.and_then(|at| session.decision_after(step)?.candidates.get(at));
    let preview = candidate.map(|candidate| {
        let manipulation = candidate.manipulation;
        let told = [intended(&session.setup.arm, &belief, &manipulation)];
        let prediction = session.setup.update.as_ref().expect("an update").predict(&belief, &told).remove(0);
        let [told] = told;
        Preview { of: (session.id, step), manipulation, prediction: Arc::new(prediction), swept: Arc::new(told.swept) }
    });
    let source = model.view.map(|view| {
        let gain = Gain::new(session.record.config.planner.counted, &belief, &session.moment(step).seen);
        let nats = gain.per_voxel(&session.setup.views, view, RayDensity::FULL);
        GainSource::new((session.id, step), view, nats)
    });
    model.preview = preview;
    model.gain_source = source;
}
