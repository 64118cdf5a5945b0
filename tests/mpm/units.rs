//! Single substeps from random states, quantity by quantity, forward and backward; and tool contact alone.

use donut::math::cloud::Point;
use donut::sim::contact::contacts;
use donut::sim::{Motion, Options, Params, ParticleState, Shape, Simulator, StepSeed, Tool, ToolPose};
use donut::store::npz::Reader;
use nalgebra::{Matrix3, Vector3};
use ndarray::{Ix0, Ix1, Ix2, Ix3};

use super::{data, worst};

fn open(name: &str) -> Reader {
    Reader::open(&data("units").join(format!("{name}.npz"))).unwrap()
}

fn number(r: &mut Reader, name: &str) -> f64 {
    r.array::<Ix0>(name).unwrap().into_scalar()
}

fn vector(r: &mut Reader, name: &str) -> Vec<f64> {
    r.array::<Ix1>(name).unwrap().to_vec()
}

fn triple(r: &mut Reader, name: &str) -> [f64; 3] {
    vector(r, name).try_into().unwrap()
}

fn matrices(r: &mut Reader, name: &str) -> Vec<[f64; 9]> {
    let m = r.array::<Ix3>(name).unwrap();
    m.outer_iter().map(|m| std::array::from_fn(|k| m[[k / 3, k % 3]])).collect()
}

fn pose(state: &[f64]) -> ToolPose {
    ToolPose {
        position: [state[0], state[1], state[2]],
        rotation: [state[3], state[4], state[5], state[6]],
        gap: state.get(7).copied().unwrap_or(0.0),
    }
}

/// The tool of a substep file. Its action is one substep's share of a control step of twenty.
fn tool(r: &mut Reader, kind: &str) -> (Tool, ToolPose) {
    let capsule =
        |r: &mut Reader| Shape::Capsule { radius: number(r, "tool0_r"), length: number(r, "tool0_h") };
    let (shape, motion) = match kind {
        "pin" => (capsule(r), Motion::RollingPin),
        "pole" => (capsule(r), Motion::Translation),
        "knife" => {
            let prism_size = vector(r, "tool0_h").try_into().unwrap();
            let prism_rotation = vector(r, "tool0_prot").try_into().unwrap();
            let shape = Shape::Knife { half_extents: triple(r, "tool0_size"), prism_size, prism_rotation };
            (shape, Motion::Translation)
        }
        _ => {
            let minimal_gap = number(r, "tool0_minimal_gap");
            let maximal_gap = number(r, "tool0_maximal_gap");
            let shape = Shape::Box { half_extents: triple(r, "tool0_size") };
            (shape, Motion::Gripper { minimal_gap, maximal_gap })
        }
    };
    let mut action_scale = vector(r, "tool0_action_scale");
    action_scale.truncate(motion.action_len());
    action_scale.iter_mut().for_each(|s| *s /= 20.0);
    let tool = Tool {
        name: kind.into(),
        shape,
        motion,
        friction: number(r, "tool0_friction"),
        action_scale,
        lower_bound: triple(r, "tool0_lower_bound"),
        upper_bound: triple(r, "tool0_upper_bound"),
    };
    (tool, pose(&vector(r, "tool0_state0")))
}

fn params(r: &mut Reader) -> Params {
    Params {
        nodes: number(r, "n_grid") as usize,
        dt: number(r, "dt"),
        substeps: 1,
        youngs_modulus: number(r, "E"),
        poisson_ratio: number(r, "nu"),
        yield_stress: number(r, "yield_stress"),
        gravity: triple(r, "gravity_applied"),
        ground_friction: number(r, "ground_friction"),
        lower_bound: number(r, "lower_bound"),
        softness: number(r, "softness"),
    }
}

/// Largest entry of `|U S V^T - F_trial|` in the reference's own decomposition.
fn svd_error(r: &mut Reader) -> f64 {
    let m = |r: &mut Reader, name: &str| -> Vec<Matrix3<f64>> {
        matrices(r, name).iter().map(|m| Matrix3::from_row_slice(m)).collect()
    };
    let (u, s, v, f) = (m(r, "U"), m(r, "sig"), m(r, "V"), m(r, "F_tmp"));
    (0..f.len()).map(|i| (u[i] * s[i] * v[i].transpose() - f[i]).amax()).fold(0.0, f64::max)
}

fn close(what: &str, a: &[f64], b: &[f64], tolerance: f64) {
    let scale = b.iter().fold(1.0f64, |m, v| m.max(v.abs()));
    let off = worst(a, b);
    assert!(off < tolerance * scale, "{what} is {off:e} off at a scale of {scale:e}");
}

#[test]
fn one_substep_forward_and_backward() {
    for kind in ["", "pin", "knife", "gripper", "pole"] {
        let name = if kind.is_empty() { "substep".into() } else { format!("substep_{kind}") };
        let mut r = open(&name);
        let start = ParticleState {
            x: r.cloud("x").unwrap(),
            v: r.cloud("v").unwrap(),
            c: matrices(&mut r, "C"),
            f: matrices(&mut r, "F"),
        };
        let (mut tools, mut poses, mut actions) = (vec![], vec![], vec![vec![]]);
        if !kind.is_empty() {
            let (tool, pose) = tool(&mut r, kind);
            let all = r.array::<Ix2>("actions").unwrap();
            actions = vec![all.row(0).iter().copied().take(tool.action_len()).collect()];
            tools.push(tool);
            poses.push(pose);
        }
        let mut sim = Simulator::<f64>::new(params(&mut r), tools, Options::default());
        sim.rollout(&start, &poses, &actions).unwrap();
        let end = sim.state(1);
        let flat = |r: &mut Reader, name: &str| r.array::<Ix2>(name).unwrap().into_raw_vec_and_offset().0;
        let flat3 = |r: &mut Reader, name: &str| matrices(r, name).concat();
        // The reference is as good as its own SVD, whose U S V^T misses the trial deformation by 1e-10, and by
        // 9e-7 at one particle of substep.npz.
        let bound = 1e-8f64.max(2.0 * svd_error(&mut r));
        close(&format!("{name}: x"), end.x.as_flattened(), &flat(&mut r, "x_out"), bound);
        close(&format!("{name}: v"), end.v.as_flattened(), &flat(&mut r, "v_out"), bound);
        close(&format!("{name}: C"), end.c.as_flattened(), &flat3(&mut r, "C_out"), bound);
        close(&format!("{name}: F"), end.f.as_flattened(), &flat3(&mut r, "F_out"), bound);
        if !kind.is_empty() {
            let next = pose(&vector(&mut r, "tool0_state1"));
            let got = sim.poses(1)[0];
            close(&format!("{name}: position"), &got.position, &next.position, 1e-14);
            close(&format!("{name}: rotation"), &got.rotation, &next.rotation, 1e-14);
        }

        let seed = StepSeed {
            positions: r.cloud("gx_out").unwrap(),
            velocities: r.cloud("gv_out").unwrap(),
            affine: matrices(&mut r, "gC_out"),
            deformation: matrices(&mut r, "gF_out"),
            poses: vec![],
        };
        let adj = sim.rollout_adj(&[StepSeed::default(), seed]).unwrap().start_state;
        close(&format!("{name}: x adjoint"), adj.x.as_flattened(), &flat(&mut r, "gx_in"), bound);
        close(&format!("{name}: v adjoint"), adj.v.as_flattened(), &flat(&mut r, "gv_in"), bound);
        close(&format!("{name}: C adjoint"), adj.c.as_flattened(), &flat3(&mut r, "gC_in"), bound);
        close(&format!("{name}: F adjoint"), adj.f.as_flattened(), &flat3(&mut r, "gF_in"), bound);
    }
}

#[test]
fn tool_contact_alone() {
    let mut r = open("collide");
    let params =
        Params { dt: number(&mut r, "dt"), softness: number(&mut r, "softness"), ..Params::default() };
    for kind in ["pin", "knife", "grip", "pole", "box"] {
        let at = |name: &str| format!("{kind}_{name}");
        let friction = number(&mut r, &at("friction"));
        let shape = match kind {
            "pin" | "pole" => {
                Shape::Capsule { radius: number(&mut r, &at("r")), length: number(&mut r, &at("h")) }
            }
            "knife" => Shape::Knife {
                half_extents: triple(&mut r, &at("size")),
                prism_size: vector(&mut r, &at("h")).try_into().unwrap(),
                prism_rotation: vector(&mut r, &at("prot")).try_into().unwrap(),
            },
            _ => Shape::Box { half_extents: triple(&mut r, &at("size")) },
        };
        let motion = match kind {
            "grip" => Motion::Gripper { minimal_gap: 0.08, maximal_gap: 0.2 },
            "box" => Motion::Rigid,
            _ => Motion::Translation,
        };
        let tool = Tool {
            name: kind.into(),
            shape,
            motion,
            friction,
            action_scale: vec![],
            lower_bound: [0.0; 3],
            upper_bound: [1.0; 3],
        };
        let start = pose(&vector(&mut r, &at("state0")));
        let end = pose(&vector(&mut r, &at("state1")));
        let points: Vec<Point> = r.cloud(&at("points")).unwrap();
        let before: Vec<Point> = r.cloud(&at("v_in")).unwrap();
        let after = r.array::<Ix2>(&at("v_out")).unwrap().into_raw_vec_and_offset().0;
        let distances = vector(&mut r, &at("sdf"));

        let parts = contacts(&params, std::slice::from_ref(&tool), &[start], &[end]);
        let got: Vec<f64> = points
            .iter()
            .zip(&before)
            .flat_map(|(p, v)| {
                let p = Vector3::from(*p);
                let v = parts.iter().fold(Vector3::from(*v), |v, part| {
                    part.touch(part.place(p), v).map_or(v, |touch| touch.velocity())
                });
                <[f64; 3]>::from(v)
            })
            .collect();
        close(&format!("{kind}: velocity"), &got, &after, 1e-9);
        let got: Vec<f64> = points.iter().map(|p| tool.distance(&start, *p)).collect();
        close(&format!("{kind}: distance"), &got, &distances, 1e-10);
    }
}
