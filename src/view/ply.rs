//! Dough and tools as PLY files, which Blender, MeshLab, Open3D and ParaView read.
//!
//! Clouds and meshes come in, the bytes of binary little-endian PLY files go out. Lengths in m, y up. Imports `view`'s
//! mesh and scene, and `store`'s record types.

use super::mesh::Mesh;
use super::render::DOUGH;
use super::scene::{self, RenderScene};
use crate::store::record::RunRecord;

/// A file: its name and its bytes.
pub type File = (String, Vec<u8>);

/// The files of the frames that are wanted: `dough_0007.ply` with the particles, `tool_0007.ply` with the tool where
/// one is in use; and `target.ply`. Frames that the run does not have are left out.
pub fn files<'a>(run: &'a RunRecord, frames: &'a [usize]) -> impl Iterator<Item = File> + 'a {
    let target = scene::of_target(run);
    let of_frame = |&frame: &usize| {
        let seen = scene::of_frame(run, frame)?;
        let tool = (!seen.tools.is_empty()).then(|| (format!("tool_{frame:04}.ply"), tools(&seen)));
        Some([Some((format!("dough_{frame:04}.ply"), dough(&seen))), tool])
    };
    std::iter::once(("target.ply".to_owned(), dough(&target)))
        .chain(frames.iter().filter_map(of_frame).flatten().flatten())
}

/// The particles: `x y z` (float), `piece` (int), `red green blue` (uchar) by piece.
pub fn dough(scene: &RenderScene) -> Vec<u8> {
    let mut bytes = header(&[
        &format!("element vertex {}", scene.dough.len()),
        "property float x",
        "property float y",
        "property float z",
        "property int piece",
        "property uchar red",
        "property uchar green",
        "property uchar blue",
    ]);
    for (p, &piece) in scene.dough.iter().zip(&scene.piece) {
        put_floats(&mut bytes, p);
        bytes.extend(piece.to_le_bytes());
        let shade = DOUGH[piece.rem_euclid(DOUGH.len() as i32) as usize];
        bytes.extend(shade.map(|linear| (255.0 * linear.sqrt()) as u8));
    }
    bytes
}

/// The tool's bodies as one mesh in place: `x y z nx ny nz` (float), and triangles.
pub fn tools(scene: &RenderScene) -> Vec<u8> {
    let meshes: Vec<&Mesh> = scene.tools.iter().map(|(mesh, _)| mesh).collect();
    let count = |of: fn(&Mesh) -> usize| meshes.iter().map(|mesh| of(mesh)).sum::<usize>();
    let mut bytes = header(&[
        &format!("element vertex {}", count(|mesh| mesh.positions.len())),
        "property float x",
        "property float y",
        "property float z",
        "property float nx",
        "property float ny",
        "property float nz",
        &format!("element face {}", count(|mesh| mesh.triangles.len())),
        "property list uchar uint vertex_indices",
    ]);
    for (p, n) in meshes.iter().flat_map(|mesh| mesh.positions.iter().zip(&mesh.normals)) {
        put_floats(&mut bytes, p);
        put_floats(&mut bytes, n);
    }
    let mut first = 0;
    for mesh in meshes {
        for corners in &mesh.triangles {
            bytes.push(3);
            bytes.extend(corners.map(|k| first + k).into_iter().flat_map(u32::to_le_bytes));
        }
        first += mesh.positions.len() as u32;
    }
    bytes
}

fn header(lines: &[&str]) -> Vec<u8> {
    let text = format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by donut; lengths in m, y up\n{}\nend_header\n",
        lines.join("\n")
    );
    text.into_bytes()
}

fn put_floats(bytes: &mut Vec<u8>, vector: &[f32; 3]) {
    bytes.extend(vector.iter().flat_map(|v| v.to_le_bytes()));
}
