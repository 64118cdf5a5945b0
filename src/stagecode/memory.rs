//! How much memory the values of a program hold: every array, list and dict notes its bytes while it lives.
//!
//! Sizes come in as values are made, grow and go; their sum goes to the budget, which holds it to a limit. A
//! program runs on a thread of its own, so that the sum is its thread's. Imports nothing.

use std::cell::Cell;

thread_local! {
    static HELD: Cell<usize> = const { Cell::new(0) };
}

/// Bytes that the values of this thread hold.
pub fn held() -> usize {
    HELD.with(Cell::get)
}

/// What a container takes besides its items.
const OVERHEAD: usize = 96;

/// The bytes of one container, counted as long as this lives.
#[derive(Debug)]
pub struct Held(Cell<usize>);

impl Held {
    /// Counts `bytes` and what goes around them.
    pub fn new(bytes: usize) -> Self {
        let held = Self(Cell::new(0));
        held.set(bytes);
        held
    }

    /// Counts `bytes` from now on.
    pub fn set(&self, bytes: usize) {
        let now = bytes.saturating_add(OVERHEAD);
        let before = self.0.replace(now);
        HELD.with(|sum| sum.set(sum.get().saturating_sub(before).saturating_add(now)));
    }
}

impl Default for Held {
    fn default() -> Self {
        Self::new(0)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // At the end of the thread the sum may be gone before the last value.
        let _ = HELD.try_with(|sum| sum.set(sum.get().saturating_sub(self.0.get())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_counted_from_the_making_of_a_value_to_its_end() {
        let before = held();
        let one = Held::new(1000);
        one.set(3000);
        assert_eq!(held() - before, 3000 + OVERHEAD);
        drop(one);
        assert_eq!(held(), before);
    }
}
