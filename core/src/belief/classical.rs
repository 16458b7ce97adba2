//! Classical metric-semantic mapping in evidential form.
/// The classical update.
#[derive(Clone, Copy, Debug, Default)]
pub struct Classical;

impl super::BeliefUpdate for Classical {
    fn name(&self) -> &str {
        "classical"
    }

    fn observe(&self, _: &super::Belief, _: &crate::camera::MapObservation) -> super::Belief {
        todo!()
    }

    fn predict_pushes(&self, _: &super::Belief, _: &[super::SweptPush]) -> Vec<super::PushPrediction> {
        todo!()
    }
}
