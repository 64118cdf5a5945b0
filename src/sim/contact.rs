//! What a tool does to a grid velocity, and the adjoint of that.
//!
//! A node's position and velocity and a tool's frames at both ends of a substep come in; the velocity
//! after contact goes out (PlasticineLab's softened Coulomb contact, Huang et al. 2021, section 3). All in
//! f64, whatever the particles' precision. Imports tools.
//!
//! For a node at p with velocity v, at signed distance d from the tool's surface with outward normal N:
//!
//! - influence `a = min(exp(-d softness), 1)`: 1 at and under the surface, fading outside. The node is touched
//!   where a > 0.1 (a jump, which is why finite differences there have no limit) or d <= 0;
//! - `v_c = (p' - p) / dt`, the velocity of the tool's material at p: p' is where the tool's motion during
//!   the substep would carry p;
//! - `r = v - v_c`, its normal part `r_n = r . N`, and `t = r - min(r_n, 0) N`: what is left when the motion into
//!   the tool is taken away;
//! - Coulomb friction, where r_n < 0: t is shortened by `friction |r_n|`, to zero at most;
//! - the node leaves with `v_c + (1 - a) r + a t`.
//!
//! Only velocities change. A particle that has come to be inside a tool is not pushed out.

use std::ops::Range;

use nalgebra::Vector3;

use super::params::{CONTACT_THRESHOLD, Params};
use super::tool::{Frame, FrameAdj, Motion, PoseAdj, Tool, ToolPose};

/// Softening of a tangential speed's root: single shapes, gripper plates.
const TANGENT_EPS: (f64, f64) = (1e-8, 1e-14);
/// Tangential speeds below this have no direction, so friction leaves them alone.
const TANGENT_MIN: f64 = 1e-30;

/// One rigid part of one tool during one substep.
#[derive(Clone, Debug)]
pub struct Contact<'a> {
    tool: &'a Tool,
    /// Index of the tool in the scene.
    pub tool_index: usize,
    side: f64,
    start: Frame,
    end: Frame,
    softness: f64,
    dt: f64,
    tangent_eps: f64,
    /// No node farther than this from the surface is affected, m.
    reach: f64,
    /// The box outside which no node is affected: the first and the last node on each axis.
    nodes: [[i64; 2]; 3],
}

/// Adjoint of a part's two frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactAdj {
    start: FrameAdj,
    end: FrameAdj,
}

impl ContactAdj {
    /// Adds `other`.
    pub fn add(&mut self, other: &Self) {
        self.start.origin += other.start.origin;
        self.start.rotation += other.start.rotation;
        self.start.turning += other.start.turning;
        self.end.origin += other.end.origin;
        self.end.rotation += other.end.rotation;
    }
}

/// Where a node is to a part.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The node in the world.
    p: Vector3<f64>,
    /// The node in the part's frame.
    local: Vector3<f64>,
    /// Signed distance from the surface, m.
    distance: f64,
}

/// What the forward pass found at a touched node; the adjoint starts from it.
#[derive(Clone, Debug)]
pub struct Touch {
    place: Place,
    influence: f64,
    /// Whether the influence was clamped to 1 (at or under the surface).
    full: bool,
    local_normal: Vector3<f64>,
    normal: Vector3<f64>,
    /// Velocity of the tool's material at the node.
    surface: Vector3<f64>,
    /// Velocity relative to the surface, and its normal part.
    relative: Vector3<f64>,
    normal_speed: f64,
    /// Tangential velocity before friction, its softened length, and the factor that friction leaves.
    tangent: Vector3<f64>,
    len: f64,
    keep: f64,
    rubs: bool,
}

/// All parts of all tools, in the order in which they act.
pub fn contacts<'a>(
    params: &Params,
    tools: &'a [Tool],
    start: &[ToolPose],
    end: &[ToolPose],
) -> Vec<Contact<'a>> {
    let (dx, reach) = (params.dx(), params.contact_reach() + 1e-9);
    let mut all = Vec::new();
    for (tool_index, tool) in tools.iter().enumerate() {
        let plates = matches!(tool.motion, Motion::Gripper { .. });
        for &side in tool.sides() {
            let frame = tool.frame(&start[tool_index], side);
            let half = tool.shape.half_extents();
            let extent = Vector3::from_fn(|a, _| {
                reach + (0..3).map(|k| frame.rotation[(a, k)].abs() * half[k]).sum::<f64>()
            });
            all.push(Contact {
                tool,
                tool_index,
                side,
                start: frame,
                end: tool.frame(&end[tool_index], side),
                softness: params.softness,
                dt: params.dt,
                tangent_eps: if plates { TANGENT_EPS.1 } else { TANGENT_EPS.0 },
                reach,
                nodes: std::array::from_fn(|a| {
                    let [lo, hi] = [frame.origin[a] - extent[a], frame.origin[a] + extent[a]];
                    // A node more on each side where rounding might lose one.
                    [(lo / dx - 1e-6).ceil() as i64, (hi / dx + 1e-6).floor() as i64]
                }),
            });
        }
    }
    all
}

impl Contact<'_> {
    /// Which of the nodes (i, j, k), for k of `pencil`, may be touched; an empty range if none.
    pub fn reachable(&self, i: usize, j: usize, pencil: &Range<usize>) -> Range<usize> {
        let [x, y, z] = self.nodes;
        let is_within = |k: usize, [lo, hi]: [i64; 2]| (lo..=hi).contains(&(k as i64));
        if !is_within(i, x) || !is_within(j, y) {
            return 0..0;
        }
        let clamped = |k: i64| k.clamp(pencil.start as i64, pencil.end as i64) as usize;
        clamped(z[0])..clamped(z[1].saturating_add(1))
    }

    /// Where a node at `p` is.
    pub fn place(&self, p: Vector3<f64>) -> Place {
        let local = self.start.to_local(p);
        Place { p, local, distance: self.tool.shape.distance(local) }
    }

    /// The way that a node goes at least until it may be touched, m: a signed distance changes by no more than the way.
    /// Not positive where it may be touched at once.
    pub fn beyond_reach(&self, place: &Place) -> f64 {
        place.distance - self.reach
    }

    /// What this part does to a node with velocity `v`; `None` if nothing.
    pub fn touch(&self, place: Place, v: Vector3<f64>) -> Option<Touch> {
        let Place { p, local, distance } = place;
        let inside = distance <= 0.0;
        let influence = if inside { 1.0 } else { (-distance * self.softness).exp() };
        if !(inside || self.softness > 0.0 && influence > CONTACT_THRESHOLD) {
            return None;
        }
        let local_normal = self.tool.shape.normal(local);
        let normal = self.start.turning * local_normal;
        let surface = (self.end.rotation * local + self.end.origin - p) / self.dt;
        let relative = v - surface;
        let normal_speed = relative.dot(&normal);
        let tangent = relative - normal * normal_speed.min(0.0);
        let speed2 = tangent.norm_squared();
        let len = (speed2 + self.tangent_eps).sqrt();
        let rubs = normal_speed < 0.0 && speed2 > TANGENT_MIN * TANGENT_MIN;
        let keep = if rubs { (len + normal_speed * self.tool.friction).max(0.0) / len } else { 1.0 };
        Some(Touch {
            place,
            influence,
            full: influence >= 1.0,
            local_normal,
            normal,
            surface,
            relative,
            normal_speed,
            tangent,
            len,
            keep,
            rubs,
        })
    }

    /// Adjoint of [`Contact::touch`] and [`Touch::velocity`]: returns the adjoint of `v`, adds the frames' into
    /// `frames_adj`.
    ///
    /// The jump of the influence at its threshold has no derivative; each side is differentiated by
    /// itself. Where friction stops the sliding, and where the normal speed is zero, the derivative is
    /// that of the branch the forward pass took.
    pub fn touch_adj(&self, t: &Touch, out_adj: Vector3<f64>, frames_adj: &mut ContactAdj) -> Vector3<f64> {
        let mut relative_adj = out_adj * (1.0 - t.influence);
        let influence_adj = out_adj.dot(&(t.tangent * t.keep - t.relative));
        let slid_adj = out_adj * t.influence;

        // Friction: slid = tangent * keep, keep = (len + friction * normal_speed) / len.
        let mut tangent_adj = slid_adj * t.keep;
        let mut normal_speed_adj = 0.0;
        if t.rubs && t.keep > 0.0 {
            let keep_adj = slid_adj.dot(&t.tangent);
            normal_speed_adj += keep_adj * self.tool.friction / t.len;
            let len_adj = -keep_adj * self.tool.friction * t.normal_speed / (t.len * t.len);
            tangent_adj += t.tangent * (len_adj / t.len);
        }

        // tangent = relative - min(normal_speed, 0) normal.
        relative_adj += tangent_adj;
        let mut normal_adj = Vector3::zeros();
        if t.normal_speed < 0.0 {
            normal_adj -= tangent_adj * t.normal_speed;
            normal_speed_adj -= tangent_adj.dot(&t.normal);
        }
        relative_adj += t.normal * normal_speed_adj;
        normal_adj += t.relative * normal_speed_adj;

        let surface_adj = out_adj - relative_adj;
        let distance_adj = if t.full { 0.0 } else { -self.softness * t.influence * influence_adj };
        self.frames_adj(t, surface_adj, normal_adj, distance_adj, frames_adj);
        relative_adj
    }

    /// The geometric half of [`Contact::touch_adj`].
    fn frames_adj(
        &self,
        t: &Touch,
        surface_adj: Vector3<f64>,
        normal_adj: Vector3<f64>,
        distance_adj: f64,
        frames_adj: &mut ContactAdj,
    ) {
        let Place { p, local, .. } = t.place;
        let image_adj = surface_adj / self.dt;
        frames_adj.end.origin += image_adj;
        frames_adj.end.rotation += image_adj * local.transpose();

        frames_adj.start.turning += normal_adj * t.local_normal.transpose();
        let local_normal_adj = self.start.turning.tr_mul(&normal_adj);

        let shape = &self.tool.shape;
        let local_adj = self.end.rotation.tr_mul(&image_adj)
            + shape.normal_adj(local, local_normal_adj)
            + shape.gradient(local) * distance_adj;
        frames_adj.start.origin -= self.start.rotation * local_adj;
        frames_adj.start.rotation += (p - self.start.origin) * local_adj.transpose();
    }

    /// Carries the adjoint of the frames to the poses they were made from.
    pub fn poses_adj(
        &self,
        frames_adj: &ContactAdj,
        start: &ToolPose,
        end: &ToolPose,
        start_adj: &mut PoseAdj,
        end_adj: &mut PoseAdj,
    ) {
        self.tool.frame_adj(start, self.side, &frames_adj.start, start_adj);
        self.tool.frame_adj(end, self.side, &frames_adj.end, end_adj);
    }
}

impl Touch {
    /// The velocity with which the node leaves.
    pub fn velocity(&self) -> Vector3<f64> {
        let slid = self.tangent * self.keep;
        self.surface + self.relative * (1.0 - self.influence) + slid * self.influence
    }
}

#[cfg(test)]
mod tests {
    use super::super::tool::Shape;
    use super::*;
    use crate::math::check::{Tolerance, directional_scaled};
    use crate::math::rng::{normal, seeded, uniform};

    fn tools() -> Vec<Tool> {
        let capsule = Shape::Capsule { radius: 0.03, length: 0.15 };
        let plate = Shape::Box { half_extents: [0.015, 0.1, 0.06] };
        let knife = Shape::Knife {
            half_extents: [0.025, 0.2, 0.06],
            prism_size: [0.15, 0.15],
            prism_rotation: [1.0, 0.0, 0.0, 0.58],
        };
        let gripper = Motion::Gripper { minimal_gap: 0.0, maximal_gap: 1.0 };
        let all = [
            (capsule, Motion::Translation, 0.9),
            (plate.clone(), Motion::Rigid, 0.5),
            (knife, Motion::Translation, 0.0),
            (plate, gripper, 10.0),
        ];
        all.into_iter()
            .map(|(shape, motion, friction)| Tool {
                name: "test".into(),
                shape,
                motion,
                friction,
                action_scale: vec![],
                lower_bound: [0.0; 3],
                upper_bound: [1.0; 3],
            })
            .collect()
    }

    /// velocity (3), start pose (8), end pose (8)
    fn split(x: &[f64]) -> (Vector3<f64>, ToolPose, ToolPose) {
        let pose = |x: &[f64]| ToolPose {
            position: [x[0], x[1], x[2]],
            rotation: [x[3], x[4], x[5], x[6]],
            gap: x[7],
        };
        (Vector3::new(x[0], x[1], x[2]), pose(&x[3..]), pose(&x[11..]))
    }

    fn run(tool: &Tool, params: &Params, p: Vector3<f64>, x: &[f64], out_adj: Option<&[f64]>) -> Vec<f64> {
        let (mut v, start, end) = split(x);
        let tools = std::slice::from_ref(tool);
        let parts = contacts(params, tools, &[start], &[end]);
        let mut touches = vec![];
        for part in &parts {
            let touch = part.touch(part.place(p), v);
            v = touch.as_ref().map_or(v, Touch::velocity);
            touches.push(touch);
        }
        let Some(y) = out_adj else { return v.as_slice().to_vec() };
        let mut v_adj = Vector3::new(y[0], y[1], y[2]);
        let (mut start_adj, mut end_adj) = (PoseAdj::default(), PoseAdj::default());
        for (part, touch) in parts.iter().zip(touches).rev() {
            let mut frames = ContactAdj::default();
            v_adj = touch.map_or(v_adj, |touch| part.touch_adj(&touch, v_adj, &mut frames));
            part.poses_adj(&frames, &start, &end, &mut start_adj, &mut end_adj);
        }
        let flat = |a: PoseAdj| [&a.position[..], &a.rotation, &[a.gap]].concat();
        [v_adj.as_slice(), &flat(start_adj), &flat(end_adj)].concat()
    }

    #[test]
    fn adjoint_agrees_with_finite_differences_at_random_states() {
        let params = Params::default();
        let mut rng = seeded(2, "contact");
        let mut touched = [0; 4];
        for (which, tool) in tools().iter().enumerate() {
            while touched[which] < 60 {
                let mut x: Vec<f64> = (0..3).map(|_| normal(&mut rng)).collect();
                let start = [0.5, 0.5, 0.5, 1.0, 0.1, -0.2, 0.05, 0.1].map(|v| v + 0.02 * normal(&mut rng));
                let end = start.map(|v| v + 1e-4 * normal(&mut rng));
                x.extend(start);
                x.extend(end);
                let p = Vector3::from_fn(|_, _| 0.5 + 0.2 * (uniform(&mut rng) - 0.5));
                let (v, start, end) = split(&x);
                let parts = contacts(&params, std::slice::from_ref(tool), &[start], &[end]);
                // Only touched nodes are interesting; and not those within a step of the threshold.
                let clear = |d: f64| (d - params.contact_reach()).abs() > 1e-6 && d.abs() > 1e-6;
                if !parts.iter().any(|c| c.touch(c.place(p), v).is_some())
                    || !parts.iter().all(|c| clear(c.place(p).distance))
                {
                    continue;
                }
                touched[which] += 1;
                let scale = [vec![1.0; 3], vec![1e-3; 16]].concat();
                directional_scaled(
                    &mut rng,
                    &x,
                    &scale,
                    |x| run(tool, &params, p, x, None),
                    |x, y| run(tool, &params, p, x, Some(y)),
                    Tolerance { relative: 2e-4, absolute: 1e-5 },
                );
            }
        }
    }

    #[test]
    fn a_node_out_of_reach_stays_so_for_the_way_that_is_beyond() {
        let params = Params::default();
        let mut rng = seeded(3, "reach");
        let mut tools = tools();
        for shape in [
            Shape::Sphere { radius: 0.05 },
            Shape::Cylinder { radius: 0.05, length: 0.12 },
            Shape::Torus { radius: 0.08, tube_radius: 0.02 },
        ] {
            tools.push(Tool { shape, ..tools[0].clone() });
        }
        for tool in &tools {
            let mut beyond_reach = 0;
            for _ in 0..2000 {
                let rotation = [1.0, 0.1, -0.2, 0.05].map(|q| q + 0.5 * normal(&mut rng));
                let pose = ToolPose { position: [0.5; 3], rotation, gap: 0.1 };
                let mut random = |scale: f64| Vector3::from_fn(|_, _| scale * (uniform(&mut rng) - 0.5));
                let (v, way) = (random(2.0), random(1.0));
                let node = (Vector3::repeat(0.5) + random(0.5)).map(|x| (x / params.dx()).round());
                let p = node * params.dx();
                let [i, j, k] = [node.x, node.y, node.z].map(|k| k as usize);
                for part in contacts(&params, std::slice::from_ref(tool), &[pose], &[pose]) {
                    let beyond = part.beyond_reach(&part.place(p));
                    let there = p + way.normalize() * beyond.max(0.0);
                    let touch = |p| part.touch(part.place(p), v);
                    if beyond > 0.0 {
                        beyond_reach += 1;
                        assert!(touch(p).is_none() && touch(there).is_none(), "{:?} at {p:?}", tool.shape);
                    }
                    // What is touched is in the box that pencils are tested against.
                    let is_reachable = part.reachable(i, j, &(0..params.nodes)).contains(&k);
                    assert!(touch(p).is_none() || is_reachable, "{:?} at {p:?}", tool.shape);
                    let alone = part.reachable(i, j, &(k..k + 1));
                    assert_eq!(!alone.is_empty(), is_reachable);
                }
            }
            assert!(beyond_reach > 500, "{:?}: {beyond_reach}", tool.shape);
        }
    }

    #[test]
    fn a_still_tool_stops_what_runs_into_it_and_lets_go_what_leaves() {
        let params = Params { softness: 0.0, ..Params::default() };
        let tool = &tools()[0];
        let pose = ToolPose { position: [0.5; 3], rotation: [1.0, 0.0, 0.0, 0.0], gap: 0.0 };
        let parts = contacts(&params, std::slice::from_ref(tool), &[pose], &[pose]);
        let p = Vector3::new(0.52, 0.5, 0.5);
        let after = |v| parts[0].touch(parts[0].place(p), v).expect("p is in the capsule").velocity();
        assert_eq!(after(Vector3::new(-1.0, 0.0, 0.0)).norm(), 0.0);
        let away = Vector3::new(1.0, 0.3, 0.0);
        assert!((after(away) - away).norm() < 1e-12);
    }
}
