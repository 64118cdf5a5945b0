//! What foreign code may use up: [`Limits`] with their defaults, and the [`Budget`] that counts against them.
//!
//! Every node that is evaluated and every array element that is made is charged to the budget before the
//! work is done; the answer is `Ok` or the fault that names the limit. Imports faults, and the count of memory.

use std::cell::Cell;
use std::time::{Duration, Instant};

use super::error::Fault;
use super::memory;
use super::value::Value;

/// How much a program may use. The defaults are several hundred times what an ordinary answer needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Evaluated nodes plus array elements (and list items) made, over the whole answer.
    pub operations: u64,
    /// Elements of one array; of a list at most [`LIST_ITEMS`].
    pub elements: usize,
    /// Bytes that arrays, lists and dicts hold together. An operation on the largest arrays takes about as much
    /// again while it runs.
    pub memory_bytes: usize,
    /// Expressions and calls nested in each other while running; a call takes about five.
    pub depth: usize,
    /// Bytes of printed text, and of any one string.
    pub output_bytes: usize,
    /// Bytes of source code in one block.
    pub source_bytes: usize,
    /// Wall time in seconds.
    pub seconds: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            operations: 500_000_000,
            elements: 30_000_000,
            memory_bytes: 2_000_000_000,
            depth: 1_000,
            output_bytes: 1_000_000,
            source_bytes: 200_000,
            seconds: 20.0,
        }
    }
}

/// Items of one list: each takes some eighty bytes, ten times what an array takes for an element.
const LIST_ITEMS: usize = 4_000_000;

/// What has been used so far. Shared by reference; every counter is a `Cell`.
pub struct Budget {
    limits: Limits,
    operations: Cell<u64>,
    next_clock_check: Cell<u64>,
    depth: Cell<usize>,
    printed: Cell<usize>,
    deadline: Option<Instant>,
}

/// Operations between two looks at the clock.
const CLOCK_INTERVAL: u64 = 4096;

impl Budget {
    /// A fresh budget; the clock starts now.
    pub fn new(limits: &Limits) -> Self {
        let time = Duration::try_from_secs_f64(limits.seconds).unwrap_or(Duration::MAX);
        Self {
            limits: limits.clone(),
            operations: Cell::new(0),
            next_clock_check: Cell::new(0),
            depth: Cell::new(0),
            printed: Cell::new(0),
            deadline: Instant::now().checked_add(time),
        }
    }

    /// The limits that this budget enforces.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Charges `count` operations.
    pub fn charge(&self, count: usize) -> Result<(), Fault> {
        let used = self.operations.get().saturating_add(count as u64);
        self.operations.set(used);
        if used > self.limits.operations {
            return Err(Fault::limit("operations", self.limits.operations));
        }
        if used >= self.next_clock_check.get() {
            self.next_clock_check.set(used + CLOCK_INTERVAL);
            self.check_memory(0)?;
            if self.deadline.is_some_and(|end| Instant::now() > end) {
                return Err(Fault::limit("seconds of run time", self.limits.seconds.max(0.0) as u64));
            }
        }
        Ok(())
    }

    /// Holds what the values take, and `more` bytes, to the limit.
    fn check_memory(&self, more: usize) -> Result<(), Fault> {
        if memory::held().saturating_add(more) > self.limits.memory_bytes {
            return Err(Fault::limit("bytes of arrays and lists", self.limits.memory_bytes as u64));
        }
        Ok(())
    }

    /// Charges an array of `count` elements that is about to be made.
    pub fn allocate(&self, count: usize) -> Result<(), Fault> {
        if count > self.limits.elements {
            return Err(Fault::limit("elements in one array or list", self.limits.elements as u64));
        }
        self.check_memory(count.saturating_mul(8))?;
        self.charge(count)
    }

    /// Charges a list or the like of `count` items that is about to be made.
    pub fn allocate_items(&self, count: usize) -> Result<(), Fault> {
        let allowed = self.limits.elements.min(LIST_ITEMS);
        if count > allowed {
            return Err(Fault::limit("elements in one array or list", allowed as u64));
        }
        self.check_memory(count.saturating_mul(size_of::<Value>()))?;
        self.charge(count)
    }

    /// Charges one more item of a list that holds `count`.
    pub fn grow(&self, count: usize) -> Result<(), Fault> {
        if count >= self.limits.elements.min(LIST_ITEMS) {
            return self.allocate_items(usize::MAX);
        }
        self.charge(1)
    }

    /// The number of elements of an array of this shape, charged. An axis of length zero does not make the
    /// others free: loops run over them all the same.
    pub fn allocate_shape(&self, shape: &[usize]) -> Result<usize, Fault> {
        let bound = shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d.max(1))).unwrap_or(usize::MAX);
        self.allocate(bound)?;
        Ok(shape.iter().product())
    }

    /// Charges a string of `bytes` that is about to be made.
    pub fn text(&self, bytes: usize) -> Result<(), Fault> {
        if bytes > self.limits.output_bytes {
            return Err(Fault::limit("bytes of text", self.limits.output_bytes as u64));
        }
        self.charge(1 + bytes)
    }

    /// Counts `bytes` of printed text.
    pub fn print(&self, bytes: usize) -> Result<(), Fault> {
        self.printed.set(self.printed.get().saturating_add(bytes));
        if self.printed.get() > self.limits.output_bytes {
            return self.text(usize::MAX);
        }
        self.charge(1 + bytes)
    }

    /// Goes one level deeper; the caller comes back up with [`Budget::leave`].
    pub fn enter(&self) -> Result<(), Fault> {
        if self.depth.get() >= self.limits.depth {
            return Err(Fault::limit("levels of nested expressions and calls", self.limits.depth as u64));
        }
        self.depth.set(self.depth.get() + 1);
        Ok(())
    }

    /// Comes back up one level.
    pub fn leave(&self) {
        self.depth.set(self.depth.get().saturating_sub(1));
    }
}
