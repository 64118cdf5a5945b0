//! Tests of the earth mover's distance through its public face.

mod cli;
mod clouds;
mod exact;
mod golden;
mod reach;
mod sinkhorn;
mod transport;
