//! Tests of the earth mover's distance through its public face.

mod clouds;
mod exact;
mod golden;
mod reach;
mod sinkhorn;
mod transport;
