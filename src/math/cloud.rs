//! Point clouds: plain slices of points, and the few measures that every layer needs of them.
//!
//! A cloud is `&[Point]`; nothing here allocates except where a `Vec` is returned. Imports nothing.

/// A point (x, y, z), y up. In the simulator's world the unit is the edge of the unit cube, "m".
pub type Point = [f64; 3];

/// The axis-aligned box that encloses a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinate on each axis.
    pub min: Point,
    /// Largest coordinate on each axis.
    pub max: Point,
}

impl Bounds {
    /// The box around `cloud`, or `None` if it is empty.
    pub fn of(cloud: &[Point]) -> Option<Self> {
        let first = *cloud.first()?;
        let start = Self { min: first, max: first };
        Some(cloud.iter().fold(start, |b, &p| b.union(&Self { min: p, max: p })))
    }

    /// The box around both boxes.
    pub fn union(&self, other: &Self) -> Self {
        let mut b = *self;
        for a in 0..3 {
            b.min[a] = b.min[a].min(other.min[a]);
            b.max[a] = b.max[a].max(other.max[a]);
        }
        b
    }

    /// Edge lengths.
    pub fn size(&self) -> Point {
        std::array::from_fn(|a| self.max[a] - self.min[a])
    }

    /// The middle of the box.
    pub fn center(&self) -> Point {
        std::array::from_fn(|a| 0.5 * (self.max[a] + self.min[a]))
    }

    /// Length of the box's diagonal.
    pub fn diagonal(&self) -> f64 {
        norm(self.size())
    }
}

/// Arithmetic mean of the points; the origin for an empty cloud.
pub fn centroid(cloud: &[Point]) -> Point {
    let mut c = [0.0; 3];
    for p in cloud {
        for a in 0..3 {
            c[a] += p[a];
        }
    }
    let n = cloud.len().max(1) as f64;
    c.map(|v| v / n)
}

/// `u - v`.
#[inline]
pub fn sub(u: Point, v: Point) -> Point {
    [u[0] - v[0], u[1] - v[1], u[2] - v[2]]
}

/// Euclidean length.
#[inline]
pub fn norm(u: Point) -> f64 {
    (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).sqrt()
}

/// Euclidean distance.
#[inline]
pub fn distance(u: Point, v: Point) -> f64 {
    norm(sub(u, v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_and_centroid_of_a_few_points() {
        let cloud = [[0.0, 1.0, 2.0], [2.0, -1.0, 2.0]];
        let b = Bounds::of(&cloud).unwrap();
        assert_eq!(b.size(), [2.0, 2.0, 0.0]);
        assert_eq!(b.center(), [1.0, 0.0, 2.0]);
        assert_eq!(centroid(&cloud), [1.0, 0.0, 2.0]);
        assert!(Bounds::of(&[]).is_none());
    }
}
