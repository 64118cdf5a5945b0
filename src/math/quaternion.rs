//! Quaternions (w, x, y, z) and their adjoints.
//!
//! Plain arrays in, plain arrays out; a function `NAME_adj` stands below NAME and returns the adjoints of
//! its inputs. Hamilton's convention. Imports nalgebra only.

use nalgebra::{Matrix3, Vector3};

/// A quaternion (w, x, y, z).
pub type Quaternion = [f64; 4];

/// No rotation.
pub const IDENTITY: Quaternion = [1.0, 0.0, 0.0, 0.0];

/// Euclidean inner product.
fn dot(a: Quaternion, b: Quaternion) -> f64 {
    a.iter().zip(&b).map(|(x, y)| x * y).sum()
}

/// `q / |q|`.
pub fn normalize(q: Quaternion) -> Quaternion {
    let n = dot(q, q).sqrt();
    q.map(|v| v / n)
}

/// Adjoint of [`normalize`]: `q_adj = (y_adj - y (y . y_adj)) / |q|`.
pub fn normalize_adj(q: Quaternion, y_adj: Quaternion) -> Quaternion {
    let n = dot(q, q).sqrt();
    let y = q.map(|v| v / n);
    let along = dot(y, y_adj);
    std::array::from_fn(|i| (y_adj[i] - y[i] * along) / n)
}

/// Hamilton product `a b`.
pub fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    let [aw, ax, ay, az] = a;
    let [bw, bx, by, bz] = b;
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

/// The inverse rotation.
pub fn conjugate(q: Quaternion) -> Quaternion {
    [q[0], -q[1], -q[2], -q[3]]
}

/// Adjoint of [`product`]: the product is bilinear, and multiplying by q has the transpose of multiplying
/// by its conjugate.
pub fn product_adj(a: Quaternion, b: Quaternion, y_adj: Quaternion) -> (Quaternion, Quaternion) {
    (product(y_adj, conjugate(b)), product(conjugate(a), y_adj))
}

/// The rotation matrix of `q / |q|`.
pub fn rotation_matrix(q: Quaternion) -> Matrix3<f64> {
    turning_matrix(normalize(q))
}

/// Adjoint of [`rotation_matrix`].
pub fn rotation_matrix_adj(q: Quaternion, r_adj: &Matrix3<f64>) -> Quaternion {
    normalize_adj(q, turning_matrix_adj(normalize(q), r_adj))
}

/// The matrix of `v + 2 w (u x v) + 2 u x (u x v)`, q = (w, u) taken as it is: a rotation only if |q| = 1.
///
/// PlasticineLab turns vectors by this, and its start rotations such as (0.707, 0.707, 0, 0) are 1.5e-4 short of
/// unit length; agreeing with it takes the same polynomial.
pub fn turning_matrix(q: Quaternion) -> Matrix3<f64> {
    let [w, x, y, z] = q;
    Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// Adjoint of [`turning_matrix`].
pub fn turning_matrix_adj(q: Quaternion, r_adj: &Matrix3<f64>) -> Quaternion {
    let [w, x, y, z] = q;
    let g = |i: usize, j: usize| r_adj[(i, j)];
    let w_adj = 2.0 * (x * (g(2, 1) - g(1, 2)) + y * (g(0, 2) - g(2, 0)) + z * (g(1, 0) - g(0, 1)));
    let x_adj = 2.0
        * (y * (g(0, 1) + g(1, 0)) + z * (g(0, 2) + g(2, 0)) + w * (g(2, 1) - g(1, 2))
            - 2.0 * x * (g(1, 1) + g(2, 2)));
    let y_adj = 2.0
        * (x * (g(0, 1) + g(1, 0)) + z * (g(1, 2) + g(2, 1)) + w * (g(0, 2) - g(2, 0))
            - 2.0 * y * (g(0, 0) + g(2, 2)));
    let z_adj = 2.0
        * (x * (g(0, 2) + g(2, 0)) + y * (g(1, 2) + g(2, 1)) + w * (g(1, 0) - g(0, 1))
            - 2.0 * z * (g(0, 0) + g(1, 1)));
    [w_adj, x_adj, y_adj, z_adj]
}

/// Softening of the angle's norm, so that its derivative exists at zero rotation.
const ANGLE_EPS: f64 = 1e-16;

/// The quaternion of an axis-angle vector, `|a| = sqrt(a.a + 1e-16)`.
pub fn from_axis_angle(a: Vector3<f64>) -> Quaternion {
    let angle = (a.norm_squared() + ANGLE_EPS).sqrt();
    let s = (0.5 * angle).sin() / angle;
    [(0.5 * angle).cos(), a.x * s, a.y * s, a.z * s]
}

/// Adjoint of [`from_axis_angle`].
pub fn from_axis_angle_adj(a: Vector3<f64>, q_adj: Quaternion) -> Vector3<f64> {
    let angle = (a.norm_squared() + ANGLE_EPS).sqrt();
    let (half_sin, half_cos) = (0.5 * angle).sin_cos();
    let s = half_sin / angle;
    let v_adj = Vector3::new(q_adj[1], q_adj[2], q_adj[3]);
    let s_adj = a.dot(&v_adj);
    // d(sin(t/2)/t)/dt, by its series where the quotient would cancel.
    let ds = if angle < 1e-3 { -angle / 24.0 } else { (0.5 * half_cos - s) / angle };
    let angle_adj = -0.5 * half_sin * q_adj[0] + ds * s_adj;
    v_adj * s + a * (angle_adj / angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::check::{Tolerance, directional};
    use crate::math::rng::{normal, seeded};

    const TOLERANCE: Tolerance = Tolerance { relative: 1e-7, absolute: 1e-9 };

    fn quaternion(v: &[f64]) -> Quaternion {
        [v[0], v[1], v[2], v[3]]
    }

    #[test]
    fn adjoints_agree_with_finite_differences() {
        let mut rng = seeded(1, "quaternion");
        for _ in 0..20 {
            let x: Vec<f64> = (0..8).map(|_| normal(&mut rng)).collect();
            directional(
                &mut rng,
                &x[..4],
                |x| normalize(quaternion(x)).to_vec(),
                |x, y| normalize_adj(quaternion(x), quaternion(y)).to_vec(),
                TOLERANCE,
            );
            directional(
                &mut rng,
                &x,
                |x| product(quaternion(x), quaternion(&x[4..])).to_vec(),
                |x, y| {
                    let (a, b) = product_adj(quaternion(x), quaternion(&x[4..]), quaternion(y));
                    [a, b].concat()
                },
                TOLERANCE,
            );
            directional(
                &mut rng,
                &x[..4],
                |x| rotation_matrix(quaternion(x)).as_slice().to_vec(),
                |x, y| rotation_matrix_adj(quaternion(x), &Matrix3::from_column_slice(y)).to_vec(),
                TOLERANCE,
            );
            directional(
                &mut rng,
                &x[..4],
                |x| turning_matrix(quaternion(x)).as_slice().to_vec(),
                |x, y| turning_matrix_adj(quaternion(x), &Matrix3::from_column_slice(y)).to_vec(),
                TOLERANCE,
            );
            for scale in [1.0, 1e-2, 1e-4] {
                let a: Vec<f64> = x[..3].iter().map(|v| v * scale).collect();
                directional(
                    &mut rng,
                    &a,
                    |a| from_axis_angle(Vector3::from_column_slice(a)).to_vec(),
                    |a, y| {
                        from_axis_angle_adj(Vector3::from_column_slice(a), quaternion(y)).as_slice().to_vec()
                    },
                    TOLERANCE,
                );
            }
        }
    }

    #[test]
    fn rotation_matrix_rotates_as_the_product_does() {
        let q = [0.3, -0.5, 0.7, 0.2];
        let v = [0.0, 0.4, -1.2, 0.9];
        let n = normalize(q);
        let rotated = product(product(n, v), conjugate(n));
        let by_matrix = rotation_matrix(q) * Vector3::new(v[1], v[2], v[3]);
        for a in 0..3 {
            approx::assert_relative_eq!(by_matrix[a], rotated[a + 1], epsilon = 1e-14);
        }
    }
}
