//! Looking at a run: `report.html` to see it move, and pictures without a browser or a GPU.
//!
//! A [`crate::store::record::RunRecord`] comes in; HTML text and pictures go out. Imports `math`, `sim`'s
//! tool types, and `store`.
//!
//! | file | what it holds |
//! |---|---|
//! | `report`, `pack` | the self-contained HTML file, and the compressed numbers in it |
//! | `render` | pictures: one scene, or the key frames of a run |
//! | `scene`, `mesh`, `camera` | what is in a picture, tools as triangles, the point of view |
//! | `clouds` | pictures of the clouds of a plan |
//! | `field` | the smooth body that particles stand for |
//! | `surface`, `light` | what each pixel sees, and how much light reaches it |
//! | `film` | a run as an animated GIF |
//! | `ply` | frames and tools as PLY files |
//! | `picture`, `font` | pixels, PNG files, captions |

pub mod camera;
pub mod clouds;
pub mod field;
pub mod film;
mod font;
pub mod light;
pub mod mesh;
mod pack;
pub mod picture;
pub mod ply;
pub mod render;
pub mod report;
pub mod scene;
pub mod surface;

pub use picture::Picture;
pub use render::{key_frames, render};
