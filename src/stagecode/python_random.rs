//! Python's `random`, bit for bit: MT19937 seeded by an array of words, and what CPython draws from it.
//!
//! Every row takes the generator first; the functions of the module run on one that the evaluator holds, which
//! starts from a fixed seed. Uniform numbers, integers, choices and shuffles are CPython's; normal numbers are
//! equal up to the last bit of the platform's functions. Imports generators, arguments, faults.

use std::cell::{RefCell, RefMut};
use std::collections::HashSet;
use std::f64::consts::TAU;
use std::rc::Rc;

use super::args::{Call, Row};
use super::error::Fault;
use super::random::Random;
use super::random_table::generator;
use super::scalar::Scalar;
use super::value::Value;

/// What makes a generator of its own.
pub static MAKER: Row = Row::new("Random", "x?", |c| {
    let random = seeded(c, 0)?;
    Ok(Value::Random(Rc::new(RefCell::new(random))))
});

/// The methods of `random.Random`, which are the functions of the module too.
pub const ROWS: &[Row] = &[
    Row::new("seed", "self a? version?", |c| {
        let random = seeded(c, 1)?;
        *generator(c)?.borrow_mut() = random;
        Ok(Value::None)
    }),
    Row::new("random", "self", |c| draw(c, |r| r.uniform())),
    Row::new("uniform", "self a b", |c| {
        let (a, b) = (c.float(1)?, c.float(2)?);
        draw(c, |r| a + (b - a) * r.uniform())
    }),
    Row::new("triangular", "self low? high? mode?", triangular),
    Row::new("gauss", "self mu? sigma?", |c| {
        let (mu, sigma) = (c.float_or(1, 0.0)?, c.float_or(2, 1.0)?);
        draw(c, |r| mu + gauss(r) * sigma)
    }),
    Row::new("normalvariate", "self mu? sigma?", |c| {
        let (mu, sigma) = (c.float_or(1, 0.0)?, c.float_or(2, 1.0)?);
        draw(c, |r| mu + normal(r) * sigma)
    }),
    Row::new("lognormvariate", "self mu sigma", |c| {
        let (mu, sigma) = (c.float(1)?, c.float(2)?);
        draw(c, |r| (mu + normal(r) * sigma).exp())
    }),
    Row::new("expovariate", "self lambd?", |c| {
        let rate = c.float_or(1, 1.0)?;
        draw(c, |r| -(1.0 - r.uniform()).ln() / rate)
    }),
    Row::new("getrandbits", "self k", |c| match c.count(1)? {
        bits @ 0..=63 => Ok(Value::int(random(c)?.bits(bits as u32) as i64)),
        _ => Err(c.problem("is supported up to 63 bits")),
    }),
    Row::new("randint", "self a b", |c| integer(c, c.int(1)?, c.int(2)?.saturating_add(1), 1)),
    Row::new("randrange", "self start stop? step?", |c| match c.opt(2) {
        None => integer(c, 0, c.int(1)?, 1),
        Some(_) => integer(c, c.int(1)?, c.int(2)?, c.int_or(3, 1)?),
    }),
    Row::new("choice", "self seq", |c| {
        let items = c.sequence(1)?;
        if items.is_empty() {
            return Err(Fault::Index("random.choice() of nothing".into()));
        }
        let at = random(c)?.below(items.len() as u64) as usize;
        Ok(items[at].clone())
    }),
    Row::new("choices", "self population weights? cum_weights? k?", choices),
    Row::new("shuffle", "self x", shuffle),
    Row::new("sample", "self population k", sample),
];

fn random<'a>(c: &'a Call) -> Result<RefMut<'a, Random>, Fault> {
    Ok(generator(c)?.borrow_mut())
}

fn draw(c: &Call, next: impl Fn(&mut Random) -> f64) -> Result<Value, Fault> {
    Ok(Value::float(next(&mut *random(c)?)))
}

/// The generator of the seed at `at`; without one, of a seed that is another for each and the same on every run.
fn seeded(c: &Call, at: usize) -> Result<Random, Fault> {
    let seed = match c.opt(at) {
        None => c.eval.next_unseeded(),
        Some(value) => match value.as_scalar() {
            // Python hashes the seed, and a whole float has the hash of its integer.
            Some(Scalar::Float(f)) if f.fract() == 0.0 && f.abs() < 9e15 => f.abs() as u64,
            Some(n) if !n.dtype().is_float() => n.int().unsigned_abs(),
            _ => return Err(c.problem("is supported with an integer as the seed")),
        },
    };
    Ok(Random::python(seed))
}

/// Normal numbers in pairs by Box and Muller; the second waits.
fn gauss(r: &mut Random) -> f64 {
    if let Some(waiting) = r.take_spare() {
        return waiting;
    }
    let angle = r.uniform() * TAU;
    let radius = (-2.0 * (1.0 - r.uniform()).ln()).sqrt();
    r.keep_spare(angle.sin() * radius);
    angle.cos() * radius
}

/// Normal numbers by Kinderman and Monahan's ratio of uniform ones.
fn normal(r: &mut Random) -> f64 {
    let factor = 4.0 * (-0.5f64).exp() / 2f64.sqrt();
    loop {
        let u1 = r.uniform();
        let u2 = 1.0 - r.uniform();
        let z = factor * (u1 - 0.5) / u2;
        if z * z / 4.0 <= -u2.ln() {
            return z;
        }
    }
}

fn triangular(c: &Call) -> Result<Value, Fault> {
    let (low, high) = (c.float_or(1, 0.0)?, c.float_or(2, 1.0)?);
    let share = if c.opt(3).is_some() { (c.float(3)? - low) / (high - low) } else { 0.5 };
    draw(c, |r| {
        let u = r.uniform();
        if u > share {
            high + (low - high) * ((1.0 - u) * (1.0 - share)).sqrt()
        } else {
            low + (high - low) * (u * share).sqrt()
        }
    })
}

fn integer(c: &Call, start: i64, stop: i64, step: i64) -> Result<Value, Fault> {
    let count = if step == 0 { 0 } else { super::value::range_len(start, stop, step) };
    if count == 0 {
        return Err(Fault::value(format!("{}() of an empty range", c.name)));
    }
    let at = random(c)?.below(count as u64) as i64;
    Ok(Value::int(start.wrapping_add(step.wrapping_mul(at))))
}

/// Items drawn with replacement, evenly or by weights.
fn choices(c: &Call) -> Result<Value, Fault> {
    let items = c.sequence(1)?;
    let k = if c.opt(4).is_some() { c.count(4)? } else { 1 };
    c.eval.budget.allocate_items(k)?;
    let mut steps = match (c.opt(2), c.opt(3)) {
        (None, None) => Vec::new(),
        (Some(_), _) => c.floats(2)?,
        (None, Some(_)) => c.floats(3)?,
    };
    if c.opt(2).is_some() {
        (1..steps.len()).for_each(|i| steps[i] += steps[i - 1]);
    }
    let weighed = c.opt(2).is_some() || c.opt(3).is_some();
    if items.is_empty() || weighed && (steps.len() != items.len() || steps[steps.len() - 1] <= 0.0) {
        return Err(c.problem("needs items, and a weight for each that add up to more than zero"));
    }
    let mut random = random(c)?;
    let mut place = || match steps.last() {
        None => (random.uniform() * items.len() as f64) as usize,
        Some(total) => {
            let at = random.uniform() * total;
            steps[..items.len() - 1].partition_point(|&step| step <= at)
        }
    };
    Ok(Value::list((0..k).map(|_| items[place()].clone()).collect()))
}

fn shuffle(c: &Call) -> Result<Value, Fault> {
    let mut random = random(c)?;
    let mut swaps =
        |n: usize| (1..n).rev().map(|i| (i, random.below(i as u64 + 1) as usize)).collect::<Vec<_>>();
    match c.get(1)? {
        Value::List(items) => {
            let mut items = items.0.borrow_mut();
            c.eval.budget.allocate(items.len())?;
            swaps(items.len()).into_iter().for_each(|(i, j)| items.swap(i, j));
        }
        Value::Array(a) if a.ndim() == 1 => {
            c.eval.budget.allocate(a.size())?;
            let mut all = a.to_scalars();
            swaps(all.len()).into_iter().for_each(|(i, j)| all.swap(i, j));
            a.scatter(&a.positions(), &all);
        }
        Value::Array(_) => return Err(c.problem("spoils arrays of rows in Python; use np.random.shuffle")),
        other => return Err(c.problem(format!("takes a list, not {}", other.type_name()))),
    }
    Ok(Value::None)
}

/// Different items: from a shrinking pool, or for few of many by drawing again what was drawn before.
fn sample(c: &Call) -> Result<Value, Fault> {
    let (mut pool, k) = (c.sequence(1)?, c.count(2)?);
    let n = pool.len();
    if k > n {
        return Err(Fault::value(format!("sample() of {k} from {n} items")));
    }
    c.eval.budget.allocate_items(k)?;
    let mut random = random(c)?;
    // The size from which CPython thinks a set smaller than the pool.
    let set_size = 21 + if k > 5 { 4f64.powf(((3 * k) as f64).log(4.0).ceil()) as usize } else { 0 };
    let mut picked = Vec::with_capacity(k);
    if n <= set_size {
        for i in 0..k {
            let j = random.below((n - i) as u64) as usize;
            picked.push(pool[j].clone());
            pool.swap(j, n - i - 1);
        }
    } else {
        let mut taken = HashSet::new();
        while picked.len() < k {
            let j = random.below(n as u64) as usize;
            if taken.insert(j) {
                picked.push(pool[j].clone());
            }
        }
    }
    Ok(Value::list(picked))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_those_of_cpython() {
        let mut r = Random::python(0);
        assert_eq!(
            [r.uniform(), r.uniform(), r.uniform()],
            [0.8444218515250481, 0.7579544029403025, 0.420571580830845]
        );
        let mut r = Random::python(42);
        assert_eq!([r.uniform(), r.uniform()], [0.6394267984578837, 0.025010755222666936]);
        let mut r = Random::python(0);
        let draws: Vec<u64> = (0..5).map(|_| 1 + r.below(100)).collect();
        assert_eq!(draws, [50, 98, 54, 6, 34]);
    }
}
