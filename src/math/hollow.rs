//! Whether a cloud fills a solid or only covers its surface.
//!
//! A cloud in any unit comes in; the share of its points that lie on a sheet goes out. A point lies on a
//! sheet if its neighbours are flat and no other sheet stands close on both of its sides, as in a solid that
//! is filled layer by layer. Imports point clouds and neighbours.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::cloud::{Bounds, Point, centroid, sub};
use super::neighbours::{Neighbours, spacing};

/// Neighbours that tell whether the cloud is flat around a point.
const NEIGHBOURS: usize = 12;
/// Neighbours are flat if their extent across is below this share of that along, as variances: on a sphere of
/// 300 points it is about 0.02, in a solid of random points mostly above 0.15.
const FLAT: f64 = 0.05;
/// Sheets that are this many times farther apart on one side than on the other belong to no layered solid.
const UNEVEN: f64 = 3.0;
/// Points that are looked at.
const SAMPLES: usize = 300;

/// Share of the points, from 0 to 1, that lie on a sheet: near 0 for a filled solid, above a half for the surface
/// of one. 0 for clouds of fewer than twice [`NEIGHBOURS`] points.
pub fn share_on_sheets(cloud: &[Point]) -> f64 {
    let Some(bounds) = Bounds::of(cloud).filter(|b| b.diagonal() > 0.0 && b.diagonal().is_finite()) else {
        return 0.0;
    };
    if cloud.len() < 2 * NEIGHBOURS {
        return 0.0;
    }
    let size = bounds.size().map(|s| s.max(1e-3 * bounds.diagonal()));
    let grid = Neighbours::new(cloud, spacing(size.iter().product(), cloud.len()));
    // An odd stride does not fall in step with the rows of a grid.
    let stride = (cloud.len() / SAMPLES) | 1;
    let (mut looked, mut on_sheets) = (0usize, 0usize);
    for place in cloud.iter().step_by(stride) {
        let near: Vec<Point> = grid.nearest(*place, NEIGHBOURS).iter().map(|n| cloud[n.index]).collect();
        looked += 1;
        if let Some(normal) = normal_if_flat(&near) {
            let width = near.iter().map(|p| Vector3::from(sub(*p, *place)).norm()).fold(0.0, f64::max);
            on_sheets += usize::from(!is_between_layers(cloud, *place, normal, width));
        }
    }
    on_sheets as f64 / looked as f64
}

/// The direction across the points if they are flat.
fn normal_if_flat(points: &[Point]) -> Option<Vector3<f64>> {
    let middle = centroid(points);
    let spread: Matrix3<f64> = points
        .iter()
        .map(|p| {
            let d = Vector3::from(sub(*p, middle));
            d * d.transpose()
        })
        .sum();
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(spread);
    let (least, most) = (eigenvalues.imin(), eigenvalues.imax());
    let flat = eigenvalues[least] <= FLAT * eigenvalues[most];
    flat.then(|| eigenvectors.column(least).into_owned())
}

/// Whether points stand above and below `place`, within `width` of the line along `normal`, at about equal
/// distances.
fn is_between_layers(cloud: &[Point], place: Point, normal: Vector3<f64>, width: f64) -> bool {
    // Height that points of the place's own sheet may have.
    let own = 0.25 * width;
    let mut nearest = [f64::INFINITY; 2];
    for p in cloud {
        let d = Vector3::from(sub(*p, place));
        let height = d.dot(&normal);
        if height.abs() > own && (d - normal * height).norm() <= width {
            let side = &mut nearest[usize::from(height > 0.0)];
            *side = side.min(height.abs());
        }
    }
    let [below, above] = nearest;
    above.is_finite() && below.is_finite() && above.max(below) <= UNEVEN * above.min(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::{Pcg64, normal, seeded, uniform};
    use crate::task::shapes::Solid;

    /// `n` points drawn one by one.
    fn drawn(n: usize, mut next: impl FnMut(&mut Pcg64) -> Point) -> Vec<Point> {
        let mut rng = seeded(3, "hollow");
        (0..n).map(|_| next(&mut rng)).collect()
    }

    fn on_sphere(rng: &mut Pcg64) -> Point {
        let p: Point = std::array::from_fn(|_| normal(rng));
        let r = Vector3::from(p).norm();
        p.map(|x| x / r)
    }

    #[test]
    fn filled_solids_are_not_on_sheets() {
        let solids = [
            Solid::Ball { radius: 1.0 },
            Solid::Box { size: [1.0, 0.4, 0.4] },
            Solid::Disc { radius: 0.5, height: 0.1 },
        ];
        for solid in solids {
            for n in [300, 3000] {
                let share = share_on_sheets(&solid.fill([0.0; 3], n, 1));
                assert!(share < 0.3, "{solid:?}, {n}: {share}");
                let half = solid.size().map(|s| 0.5 * s);
                let random = drawn(20 * n, |r| half.map(|h| h * (2.0 * uniform(r) - 1.0)));
                let random: Vec<Point> = random.into_iter().filter(|p| solid.contains(*p)).take(n).collect();
                let share = share_on_sheets(&random);
                assert!(share < 0.3, "{solid:?}, {n} at random: {share}");
            }
        }
    }

    #[test]
    fn a_grid_is_a_solid_even_if_its_layers_are_far_apart() {
        for layers in [5, 9, 30] {
            let cloud: Vec<Point> = (0..30 * 30 * layers)
                .map(|i| {
                    let (x, y, z) = (i % 30, i / 30 % layers, i / 30 / layers);
                    [x as f64 / 29.0, 0.4 * y as f64 / (layers - 1) as f64, z as f64 / 29.0]
                })
                .collect();
            let share = share_on_sheets(&cloud);
            assert!(share < 0.45, "{layers} layers: {share}");
        }
    }

    #[test]
    fn surfaces_are_on_sheets() {
        for n in [300, 3000] {
            let share = share_on_sheets(&drawn(n, on_sphere));
            assert!(share > 0.8, "sphere of {n}: {share}");
        }
        let sides = drawn(3000, |r| {
            let (a, y) = (std::f64::consts::TAU * uniform(r), uniform(r) - 0.5);
            if uniform(r) < 0.5 {
                return [a.cos(), y, a.sin()];
            }
            let s = uniform(r).sqrt();
            [s * a.cos(), 0.5 * (2.0 * uniform(r) - 1.0).signum(), s * a.sin()]
        });
        let share = share_on_sheets(&sides);
        assert!(share > 0.6, "cylinder: {share}");
        let tube = drawn(3000, |r| {
            let (a, b) = (std::f64::consts::TAU * uniform(r), std::f64::consts::TAU * uniform(r));
            let s = 1.0 + 0.4 * b.cos();
            [s * a.cos(), 0.4 * b.sin(), s * a.sin()]
        });
        let share = share_on_sheets(&tube);
        assert!(share > 0.8, "torus: {share}");
        let bar = drawn(3000, |r| {
            let mut p: Point = std::array::from_fn(|_| 2.0 * uniform(r) - 1.0);
            let axis = (3.0 * uniform(r)) as usize;
            p[axis] = p[axis].signum();
            [p[0], 0.4 * p[1], 0.4 * p[2]]
        });
        let share = share_on_sheets(&bar);
        assert!(share > 0.5, "sides of a bar: {share}");
        let flat = drawn(1000, |r| [uniform(r), 0.0, uniform(r)]);
        assert_eq!(share_on_sheets(&flat), 1.0);
    }

    #[test]
    fn degenerate_clouds_are_on_no_sheet() {
        assert_eq!(share_on_sheets(&[]), 0.0);
        assert_eq!(share_on_sheets(&[[1.0; 3]; 100]), 0.0);
        assert_eq!(share_on_sheets(&[[f64::MAX; 3], [-f64::MAX; 3]]), 0.0);
    }
}
