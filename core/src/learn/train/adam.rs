//! Adam (Kingma & Ba 2015) with its state in our hands, so that a checkpoint can hold it.

use tch::Tensor;

const BETA_1: f64 = 0.9;
const BETA_2: f64 = 0.999;
const EPSILON: f64 = 1e-8;
/// Steps over which the step size rises: the gradients' size is not known yet.
const WARM_UP: f64 = 100.0;
/// Gradients are scaled down to this norm when they are longer.
const CLIP: f64 = 1.0;

/// First and second moments of every variable's gradient.
#[derive(Debug)]
pub(super) struct Adam {
    pub(super) first: Vec<Tensor>,
    pub(super) second: Vec<Tensor>,
    /// Steps that the moments are made of.
    pub(super) steps: u64,
}

impl Adam {
    pub(super) fn new(variables: &[(String, Tensor)]) -> Self {
        let zeros = || variables.iter().map(|(_, variable)| variable.detach().zeros_like()).collect();
        Self { first: zeros(), second: zeros(), steps: 0 }
    }

    /// Moves the variables against their gradients and clears these. The step size rises over the first steps.
    pub(super) fn step(&mut self, variables: &[(String, Tensor)], learning_rate: f64) {
        self.steps += 1;
        let steps = self.steps as f64;
        let unbias = |beta: f64| 1.0 - beta.powf(steps);
        let step = learning_rate * (steps / WARM_UP).min(1.0) / unbias(BETA_1);
        let unbias_2 = unbias(BETA_2).sqrt();
        tch::no_grad(|| {
            let norms: Vec<Tensor> = variables.iter().map(|(_, variable)| variable.grad().norm()).collect();
            let norm = Tensor::stack(&norms, 0).norm().double_value(&[]);
            let scale = if norm > CLIP { CLIP / norm } else { 1.0 };
            for ((_, variable), (first, second)) in variables.iter().zip(self.first.iter_mut().zip(&mut self.second)) {
                let mut gradient = variable.grad();
                let scaled = &gradient * scale;
                let _ = first.lerp_(&scaled, 1.0 - BETA_1);
                let _ = second.lerp_(&(&scaled * &scaled), 1.0 - BETA_2);
                let spread = second.sqrt() / unbias_2 + EPSILON;
                let mut variable = variable.shallow_clone();
                let _ = variable.subtract_(&(&*first / spread * step));
                let _ = gradient.zero_();
            }
        });
    }
}
