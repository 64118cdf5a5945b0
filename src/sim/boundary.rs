//! Walls of the unit cube and the floor with friction, and their adjoint.
//!
//! A grid velocity and its node come in, the velocity that the walls allow goes out (PlasticineLab's
//! boundary condition). Imports parameters.
//!
//! Within three nodes of a wall, axis by axis in the order x, y, z, v being what the axis before left:
//!
//! ```text
//! side walls, ceiling   v_a outward:  v_a <- 0                                slips
//! floor, mu_g = 0       v_y < 0:      v_y <- 0                                slips
//! floor, mu_g >= 10     v_y < 0:      v <- 0                                  sticks
//! floor, otherwise      v_y < 0:      l    = sqrt(v_x^2 + v_z^2 + 1e-8)
//!                                     keep = max(1 + mu_g v_y / l, 0)         Coulomb
//!                                     v    <- (keep v_x, 0, keep v_z)
//! ```
//!
//! Coulomb's law for impulses: the floor takes the downward velocity `|v_y|` away, and friction at most mu_g times as much
//! of the sliding. The constant under the root makes `l` differentiable at rest. The derivatives of the last line,
//! with `s = v_x x_adj + v_z z_adj`, are `keep x_adj - mu_g v_y s v_x / l^3` for x, the same for z, and `mu_g s / l` for y.

use super::params::Params;

/// Nodes this close to a wall may not move outward.
const WALL_NODES: usize = 3;
/// Softening of the sliding speed's root.
const SLIDE_EPS: f64 = 1e-8;
/// Ground friction from which the floor sticks.
const STICK: f64 = 10.0;
/// The axis that points up.
const UP: usize = 1;

/// What happens to a velocity at one wall pair.
enum Wall {
    Free,
    /// The component is removed.
    Stop,
    /// The floor holds the node.
    Hold,
    /// The floor lets it slide: the horizontal velocity keeps this factor.
    Slide {
        len: f64,
        keep: f64,
    },
}

fn wall(params: &Params, axis: usize, node: usize, v: &[f64; 3]) -> Wall {
    if node < WALL_NODES && v[axis] < 0.0 {
        let friction = params.ground_friction;
        if axis != UP || friction == 0.0 {
            return Wall::Stop;
        }
        if friction >= STICK {
            return Wall::Hold;
        }
        let len = (v[0] * v[0] + v[2] * v[2] + SLIDE_EPS).sqrt();
        return Wall::Slide { len, keep: (1.0 + friction * v[UP] / len).max(0.0) };
    }
    if node > params.nodes - WALL_NODES && v[axis] > 0.0 { Wall::Stop } else { Wall::Free }
}

/// Whether any wall can act on a node.
#[inline(always)]
pub fn is_near_wall(nodes: usize, node: [usize; 3]) -> bool {
    node.iter().any(|&k| k < WALL_NODES || k > nodes - WALL_NODES)
}

/// What a wall pair leaves of a velocity.
fn after(wall: &Wall, axis: usize, v: [f64; 3]) -> [f64; 3] {
    let mut out = v;
    match *wall {
        Wall::Free => {}
        Wall::Stop => out[axis] = 0.0,
        Wall::Hold => out = [0.0; 3],
        Wall::Slide { keep, .. } => out = [v[0] * keep, 0.0, v[2] * keep],
    }
    out
}

/// The velocity of `node` after the walls, axis by axis.
pub fn apply(params: &Params, node: [usize; 3], v: [f64; 3]) -> [f64; 3] {
    (0..3).fold(v, |v, axis| after(&wall(params, axis, node[axis], &v), axis, v))
}

/// Adjoint of [`apply`]. Where the floor just stops the sliding (`keep` clamped to 0) the derivative is 0.
pub fn apply_adj(params: &Params, node: [usize; 3], v: [f64; 3], out_adj: [f64; 3]) -> [f64; 3] {
    let x = wall(params, 0, node[0], &v);
    let v1 = after(&x, 0, v);
    let y = wall(params, 1, node[1], &v1);
    let v2 = after(&y, 1, v1);
    let z = wall(params, 2, node[2], &v2);
    [(z, v2), (y, v1), (x, v)]
        .iter()
        .zip([2, 1, 0])
        .fold(out_adj, |adj, ((wall, v), axis)| after_adj(params, wall, axis, v, adj))
}

/// Adjoint of [`after`].
fn after_adj(params: &Params, wall: &Wall, axis: usize, v: &[f64; 3], out_adj: [f64; 3]) -> [f64; 3] {
    let mut adj = out_adj;
    match *wall {
        Wall::Free => {}
        Wall::Stop => adj[axis] = 0.0,
        Wall::Hold => adj = [0.0; 3],
        Wall::Slide { keep: 0.0, .. } => adj = [0.0; 3],
        Wall::Slide { len, keep } => {
            let keep_adj = out_adj[0] * v[0] + out_adj[2] * v[2];
            let friction = params.ground_friction;
            // d keep / d len * d len / d v = -friction v_y / len^2 * v / len
            let through_len = -keep_adj * friction * v[UP] / (len * len * len);
            adj[0] = out_adj[0] * keep + through_len * v[0];
            adj[UP] = keep_adj * friction / len;
            adj[2] = out_adj[2] * keep + through_len * v[2];
        }
    }
    adj
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::{normal, seeded};

    #[test]
    fn adjoint_agrees_with_finite_differences() {
        let mut rng = seeded(1, "boundary");
        for ground_friction in [0.0, 0.5, 1.5, 100.0] {
            let params = Params { ground_friction, ..Params::default() };
            for node in [[1, 2, 30], [30, 2, 30], [62, 2, 63], [30, 30, 30], [30, 63, 2]] {
                for _ in 0..20 {
                    let v: Vec<f64> = (0..3).map(|_| normal(&mut rng)).collect();
                    let v3 = |v: &[f64]| [v[0], v[1], v[2]];
                    directional(
                        &mut rng,
                        &v,
                        |v| apply(&params, node, v3(v)).to_vec(),
                        |v, y| apply_adj(&params, node, v3(v), v3(y)).to_vec(),
                        Tolerance { relative: 1e-6, absolute: 1e-8 },
                    );
                }
            }
        }
    }

    #[test]
    fn zero_sliding_has_a_finite_adjoint() {
        let params = Params::default();
        for v in [[0.0, -1.0, 0.0], [0.0, -1e-9, 0.0], [0.0, 0.0, 0.0]] {
            let adj = apply_adj(&params, [30, 2, 30], v, [1.0, 1.0, 1.0]);
            assert!(adj.iter().all(|a| a.is_finite()), "{adj:?}");
        }
    }

    #[test]
    fn the_floor_slips_slides_and_sticks() {
        let slip = Params { ground_friction: 0.0, ..Params::default() };
        assert_eq!(apply(&slip, [30, 1, 30], [1.0, -1.0, 2.0]), [1.0, 0.0, 2.0]);
        let stick = Params { ground_friction: 10.0, ..Params::default() };
        assert_eq!(apply(&stick, [30, 1, 30], [1.0, -1.0, 2.0]), [0.0; 3]);
        let rough = Params { ground_friction: 0.5, ..Params::default() };
        let v = apply(&rough, [30, 1, 30], [2.0, -1.0, 0.0]);
        approx::assert_relative_eq!(v[0], 1.5, epsilon = 1e-7);
        assert_eq!(apply(&rough, [30, 61, 30], [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!(apply(&rough, [30, 62, 30], [0.0, 1.0, 0.0]), [0.0; 3]);
    }
}
