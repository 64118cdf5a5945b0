//! A dict that keeps the order of insertion, and the keys that it takes.
//!
//! Keys are made from values (numbers, text, tuples of them); anything else is a fault. Sets are dicts
//! without values and keep their order too, where CPython's is arbitrary. Imports values and faults.

use std::collections::HashMap;

use super::error::Fault;
use super::memory::Held;
use super::scalar::Scalar;
use super::value::Value;

/// A hashable value. Equal numbers are equal keys, whatever their type.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Key {
    /// `None`.
    None,
    /// An integer, a truth value, or a float without fraction.
    Int(i64),
    /// Any other float, by its bits.
    Float(u64),
    /// Text.
    Str(String),
    /// A tuple of keys.
    Tuple(Vec<Key>),
}

/// Tuples in keys may be nested this deep.
const MAX_KEY_DEPTH: usize = 16;

impl Key {
    /// The key of a value.
    pub fn of(value: &Value) -> Result<Self, Fault> {
        Self::nested(value, 0)
    }

    fn nested(value: &Value, depth: usize) -> Result<Self, Fault> {
        Ok(match value {
            Value::None => Self::None,
            Value::Number(n) => match n.plain() {
                Scalar::Float(f) if f.fract() == 0.0 && f.abs() < 9e15 => Self::Int(f as i64),
                Scalar::Float(f) => Self::Float(f.to_bits()),
                whole => Self::Int(whole.int()),
            },
            Value::Str(s) => Self::Str(s.to_string()),
            Value::Tuple(items) if depth < MAX_KEY_DEPTH => {
                let items = items.0.borrow();
                Self::Tuple(items.iter().map(|v| Self::nested(v, depth + 1)).collect::<Result<_, _>>()?)
            }
            other => {
                return Err(Fault::kind(format!("a {} cannot be a key of a dict or set", other.type_name())));
            }
        })
    }
}

/// Keys and values in the order of insertion.
#[derive(Default)]
pub struct Dict {
    /// What a missing key gives: a function to be called, whose value is kept, or a number handed out as it is.
    pub default: Option<Value>,
    places: HashMap<Key, usize>,
    entries: Vec<(Value, Value)>,
    held: Held,
}

/// Bytes of an entry: key and value, the key again to be found by, and its place.
const ENTRY_BYTES: usize = 2 * size_of::<Value>() + size_of::<Key>() + 32;

impl Dict {
    /// Number of keys.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// The value at a key.
    pub fn get(&self, key: &Key) -> Option<&Value> {
        self.places.get(key).map(|&at| &self.entries[at].1)
    }

    /// Sets the value at a key; returns whether the key is new.
    pub fn insert(&mut self, key: &Value, value: Value) -> Result<bool, Fault> {
        let hashed = Key::of(key)?;
        if let Some(&at) = self.places.get(&hashed) {
            self.entries[at].1 = value;
            return Ok(false);
        }
        self.places.insert(hashed, self.entries.len());
        self.entries.push((key.clone(), value));
        self.held.set(self.entries.len() * ENTRY_BYTES);
        Ok(true)
    }

    /// Takes a key out.
    pub fn remove(&mut self, key: &Key) -> Option<Value> {
        let at = self.places.remove(key)?;
        for place in self.places.values_mut() {
            *place -= usize::from(*place > at);
        }
        let removed = self.entries.remove(at).1;
        self.held.set(self.entries.len() * ENTRY_BYTES);
        Some(removed)
    }

    /// Keys and values in order.
    pub fn entries(&self) -> &[(Value, Value)] {
        &self.entries
    }

    /// Empties the dict and returns all it held.
    pub fn take_values(&mut self) -> Vec<Value> {
        self.places.clear();
        self.held.set(0);
        let entries = self.entries.drain(..).flat_map(|(key, value)| [key, value]);
        entries.chain(self.default.take()).collect()
    }
}
