//! Adam (Kingma and Ba 2015) on a table of actions that stay within [-1, 1].
//!
//! Imports nothing of donut.

/// Adam's decay rates and floor (Kingma and Ba 2015).
const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;
const EPSILON: f64 = 1e-8;

/// First and second moments of the gradient.
pub struct Adam {
    m: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
    t: i32,
}

impl Adam {
    /// No moments yet, for a table of the shape of `actions`.
    pub fn new(actions: &[Vec<f64>]) -> Self {
        let zero: Vec<Vec<f64>> = actions.iter().map(|row| vec![0.0; row.len()]).collect();
        Self { m: zero.clone(), v: zero, t: 0 }
    }

    /// One step on `actions`, which stay within [-1, 1].
    pub fn step(&mut self, rate: f64, gradient: &[Vec<f64>], actions: &mut [Vec<f64>]) {
        self.t += 1;
        let (c1, c2) = (1.0 - BETA1.powi(self.t), 1.0 - BETA2.powi(self.t));
        for (row, action) in actions.iter_mut().enumerate() {
            for (k, a) in action.iter_mut().enumerate() {
                let g = gradient[row][k];
                let (m, v) = (&mut self.m[row][k], &mut self.v[row][k]);
                *m = BETA1 * *m + (1.0 - BETA1) * g;
                *v = BETA2 * *v + (1.0 - BETA2) * g * g;
                *a = (*a - rate * (*m / c1) / ((*v / c2).sqrt() + EPSILON)).clamp(-1.0, 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adam_walks_down_a_bowl_and_stays_in_its_bounds() {
        let mut actions = vec![vec![0.0, 0.0]];
        let mut adam = Adam::new(&actions);
        for _ in 0..400 {
            let gradient = vec![vec![2.0 * (actions[0][0] - 0.3), 2.0 * (actions[0][1] - 5.0)]];
            adam.step(0.02, &gradient, &mut actions);
        }
        assert!((actions[0][0] - 0.3).abs() < 1e-2 && actions[0][1] == 1.0, "{actions:?}");
    }
}
