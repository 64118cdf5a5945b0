//! The convex hull of a cloud seen from above.
//!
//! Points come in, their hull in x and z goes out (Andrew 1979, "Another efficient algorithm for convex hulls in two
//! dimensions"). Imports point clouds.

use super::cloud::Point;

/// A convex polygon in x and z; heights do not count.
#[derive(Clone, Debug, PartialEq)]
pub struct HullFromAbove {
    /// Corners, counter-clockwise in (x, z).
    corners: Vec<[f64; 2]>,
}

/// Twice the area of the triangle a, b, c: positive if it turns left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl HullFromAbove {
    /// The hull of `cloud`. That of fewer than three points, or of points on one line, contains nothing.
    pub fn of(cloud: &[Point]) -> Self {
        let mut flat: Vec<[f64; 2]> = cloud.iter().map(|p| [p[0], p[2]]).collect();
        flat.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        // The lower chain from left to right, then the upper one back; each ends where the other begins.
        let chain = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
            let mut chain: Vec<[f64; 2]> = Vec::new();
            for &p in points {
                while let [.., a, b] = chain[..] {
                    if turn(a, b, p) > 0.0 {
                        break;
                    }
                    chain.pop();
                }
                chain.push(p);
            }
            chain.pop();
            chain
        };
        let mut corners = chain(&mut flat.iter());
        corners.extend(chain(&mut flat.iter().rev()));
        Self { corners }
    }

    /// Whether `p` is inside.
    pub fn contains(&self, p: Point) -> bool {
        let n = self.corners.len();
        n > 2 && (0..n).all(|k| turn(self.corners[k], self.corners[(k + 1) % n], [p[0], p[2]]) > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{seeded, uniform};

    #[test]
    fn the_hull_of_a_square_is_its_corners_and_contains_what_is_inside_at_any_height() {
        let mut rng = seeded(1, "hull");
        let mut cloud: Vec<Point> = (0..200).map(|_| std::array::from_fn(|_| uniform(&mut rng))).collect();
        cloud.extend([[0.0, 0.2, 0.0], [1.0, 0.0, 0.0], [1.0, 0.9, 1.0], [0.0, 0.0, 1.0]]);
        // On an edge, and twice the same corner.
        cloud.extend([[0.5, 0.0, 0.0], [1.0, 0.3, 1.0]]);
        let hull = HullFromAbove::of(&cloud);
        assert_eq!(hull.corners, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert!(hull.contains([0.5, -3.0, 0.01]) && hull.contains([0.99, 7.0, 0.99]));
        assert!(!hull.contains([1.01, 0.5, 0.5]) && !hull.contains([0.5, 0.5, -0.01]));
    }

    #[test]
    fn what_has_no_area_contains_nothing() {
        let line: Vec<Point> = (0..5).map(|i| [f64::from(i), 0.0, 2.0 * f64::from(i)]).collect();
        for cloud in [&line[..0], &line[..1], &line[..2], &line[..]] {
            assert!(!HullFromAbove::of(cloud).contains([1.0, 0.0, 2.0]));
        }
    }
}
