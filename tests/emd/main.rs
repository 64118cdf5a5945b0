//! Tests of the earth mover's distance through its public face.

mod clouds;
mod exact;
mod golden;
mod sinkhorn;
