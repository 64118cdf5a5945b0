//! Values as text: `str`, `repr`, and format specifications.
//!
//! A value and perhaps a specification such as `.3f` come in, text goes out. Long arrays and deep lists are
//! cut short: the text is only ever printed or used in messages. Imports values and faults.

use super::error::Fault;
use super::scalar::Scalar;
use super::value::Value;

/// What `str` gives.
pub fn text(value: &Value) -> String {
    match value {
        Value::Str(s) => s.to_string(),
        Value::Exception(e) => e.1.clone(),
        other => repr(other),
    }
}

/// What `repr` gives.
pub fn repr(value: &Value) -> String {
    let mut out = String::new();
    write(value, &mut out, 0);
    out
}

/// Items shown of a long container, and levels shown of a deep one.
const SHOWN_ITEMS: usize = 100;
const SHOWN_LEVELS: usize = 8;
/// Characters after which nothing more is shown.
const SHOWN_TEXT: usize = 10_000;

/// Builtins that are classes.
const CLASSES: &[&str] =
    &["int", "float", "bool", "str", "list", "tuple", "set", "dict", "range", "slice", "type"];

fn write(value: &Value, out: &mut String, depth: usize) {
    if depth > SHOWN_LEVELS || out.len() > SHOWN_TEXT {
        return out.push_str("...");
    }
    match value {
        Value::None => out.push_str("None"),
        Value::Ellipsis => out.push_str("Ellipsis"),
        Value::Number(n) => out.push_str(&number(*n)),
        Value::Imaginary(f) => out.push_str(&format!("{f}j")),
        Value::Str(s) => out.push_str(&format!("'{s}'")),
        Value::List(items) => write_items(&items.0.borrow(), ["[", "]"], out, depth),
        Value::Tuple(items) => {
            let items = items.0.borrow();
            write_items(&items, ["(", if items.len() == 1 { ",)" } else { ")" }], out, depth);
        }
        Value::Set(keys) => {
            let keys: Vec<Value> = keys.0.borrow().entries().iter().map(|(k, _)| k.clone()).collect();
            write_items(&keys, ["{", "}"], out, depth);
        }
        Value::Dict(dict) => {
            out.push('{');
            for (at, (key, value)) in dict.0.borrow().entries().iter().take(SHOWN_ITEMS).enumerate() {
                out.push_str(if at > 0 { ", " } else { "" });
                write(key, out, depth + 1);
                out.push_str(": ");
                write(value, out, depth + 1);
            }
            out.push('}');
        }
        Value::Array(a) if a.size() <= SHOWN_ITEMS => {
            let items: Vec<Value> = a.to_scalars().into_iter().map(Value::Number).collect();
            write_items(&items, ["array([", "])"], out, depth);
        }
        Value::Array(a) => out.push_str(&format!("array of shape {}", super::array::show(a.shape()))),
        Value::Range(start, stop, step) => out.push_str(&format!("range({start}, {stop}, {step})")),
        Value::Dtype(dtype) => out.push_str(dtype.name()),
        Value::Type(name) => out.push_str(&format!("<class '{name}'>")),
        Value::Builtin(row) if row.name == "ndarray" => out.push_str("<class 'numpy.ndarray'>"),
        Value::Builtin(row) if CLASSES.contains(&row.name) => {
            out.push_str(&format!("<class '{}'>", row.name))
        }
        Value::Exception(e) if e.1.is_empty() => out.push_str(&format!("<class '{}'>", e.0)),
        Value::Exception(e) => out.push_str(&format!("{}('{}')", e.0, e.1)),
        other => out.push_str(&format!("<{}>", other.type_name())),
    }
}

fn write_items(items: &[Value], brackets: [&str; 2], out: &mut String, depth: usize) {
    out.push_str(brackets[0]);
    for (at, item) in items.iter().take(SHOWN_ITEMS).enumerate() {
        out.push_str(if at > 0 { ", " } else { "" });
        write(item, out, depth + 1);
    }
    if items.len() > SHOWN_ITEMS {
        out.push_str(", ...");
    }
    out.push_str(brackets[1]);
}

fn number(n: Scalar) -> String {
    match n {
        Scalar::Bool(true) => "True".into(),
        Scalar::Bool(false) => "False".into(),
        Scalar::Int(i) | Scalar::Int64(i) => i.to_string(),
        Scalar::Float(f) | Scalar::Float64(f) => float(f),
    }
}

/// The shortest text that reads back as `f`, in Python's layout.
fn float(f: f64) -> String {
    if f.is_nan() {
        return "nan".into();
    }
    if f.is_infinite() {
        return if f > 0.0 { "inf" } else { "-inf" }.into();
    }
    let size = f.abs();
    if size != 0.0 && !(1e-4..1e16).contains(&size) {
        return exponent_digits(&format!("{f:e}"));
    }
    let text = f.to_string();
    if text.contains('.') { text } else { text + ".0" }
}

/// Rust's `1e-7` as Python's `1e-07`.
fn exponent_digits(text: &str) -> String {
    let Some((mantissa, exponent)) = text.split_once('e') else { return text.to_owned() };
    let (sign, digits) = exponent.strip_prefix('-').map_or(('+', exponent), |d| ('-', d));
    format!("{mantissa}e{sign}{digits:0>2}")
}

/// A format specification: `[[fill]align][sign][0][width][,][.precision][type]`.
#[derive(Debug, Default)]
struct Spec {
    fill: Option<char>,
    align: Option<char>,
    plus: bool,
    comma: bool,
    width: usize,
    precision: Option<usize>,
    kind: Option<char>,
}

/// Widths and precisions beyond this are cut: nobody reads them.
const MAX_WIDTH: usize = 200;

impl Spec {
    fn parse(text: &str) -> Option<Self> {
        let mut spec = Self::default();
        let mut rest: &[char] = &text.chars().collect::<Vec<_>>();
        match rest {
            [fill, align @ ('<' | '>' | '^'), tail @ ..] => {
                (spec.fill, spec.align, rest) = (Some(*fill), Some(*align), tail);
            }
            [align @ ('<' | '>' | '^'), tail @ ..] => (spec.align, rest) = (Some(*align), tail),
            _ => {}
        }
        if let ['+', tail @ ..] | ['-', tail @ ..] | [' ', tail @ ..] = rest {
            (spec.plus, rest) = (rest[0] == '+', tail);
        }
        if let ['0', tail @ ..] = rest {
            (spec.fill, spec.align, rest) = (spec.fill.or(Some('0')), spec.align.or(Some('=')), tail);
        }
        let digits = |rest: &mut &[char]| {
            let count = rest.iter().take_while(|c| c.is_ascii_digit()).count();
            let text: String = rest[..count].iter().collect();
            *rest = &rest[count..];
            text.parse::<usize>().ok().map(|n| n.min(MAX_WIDTH))
        };
        spec.width = digits(&mut rest).unwrap_or(0);
        if let [',' | '_', tail @ ..] = rest {
            (spec.comma, rest) = (true, tail);
        }
        if let ['.', tail @ ..] = rest {
            rest = tail;
            spec.precision = Some(digits(&mut rest)?);
        }
        match rest {
            [] => Some(spec),
            [kind] => Some(Self { kind: Some(*kind), ..spec }),
            _ => None,
        }
    }

    fn body(&self, value: &Value) -> Option<String> {
        let precision = self.precision;
        let Some(n) = value.as_scalar() else {
            let shown = text(value);
            return matches!(self.kind, None | Some('s'))
                .then(|| shown.chars().take(precision.unwrap_or(usize::MAX)).collect());
        };
        Some(match self.kind {
            Some('d') if !matches!(n, Scalar::Float(_)) => n.int().to_string(),
            Some('x') if matches!(n, Scalar::Int(0..)) => format!("{:x}", n.int()),
            Some('b') if matches!(n, Scalar::Int(0..)) => format!("{:b}", n.int()),
            Some('f' | 'F') => format!("{:.*}", precision.unwrap_or(6), n.float()),
            Some('%') => format!("{:.*}%", precision.unwrap_or(6), 100.0 * n.float()),
            Some('e' | 'E') => exponent_digits(&format!("{:.*e}", precision.unwrap_or(6), n.float())),
            Some('g' | 'G') => general(n.float(), precision.unwrap_or(6).max(1)),
            None if precision.is_some() => general(n.float(), precision.unwrap_or(6).max(1)),
            None | Some('s') => number(n),
            _ => return None,
        })
    }
}

/// `g`: as many significant digits as asked, without trailing zeros.
fn general(f: f64, digits: usize) -> String {
    if !f.is_finite() || f == 0.0 {
        return if f == 0.0 { "0".into() } else { float(f) };
    }
    let rounded = format!("{f:.*e}", digits - 1);
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let trim = |s: &str| {
        if s.contains('.') { s.trim_end_matches('0').trim_end_matches('.').to_owned() } else { s.to_owned() }
    };
    if (-4..digits as i32).contains(&exponent) {
        return trim(&format!("{f:.*}", (digits as i32 - 1 - exponent).max(0) as usize));
    }
    let (mantissa, tail) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    exponent_digits(&format!("{}e{tail}", trim(mantissa)))
}

/// What `format(value, spec)` gives.
pub fn formatted(value: &Value, spec: &str) -> Result<String, Fault> {
    if spec.is_empty() {
        return Ok(text(value));
    }
    let wrong = || Fault::value(format!("the format `{spec}` does not fit a {}", value.type_name()));
    let parsed = Spec::parse(spec).ok_or_else(wrong)?;
    let mut body = parsed.body(value).ok_or_else(wrong)?;
    if parsed.comma {
        body = with_commas(&body);
    }
    if parsed.plus && !body.starts_with('-') {
        body.insert(0, '+');
    }
    let missing = parsed.width.saturating_sub(body.chars().count());
    let fill = |n: usize| parsed.fill.unwrap_or(' ').to_string().repeat(n);
    let default = if value.as_scalar().is_some() { '>' } else { '<' };
    Ok(match parsed.align.unwrap_or(default) {
        '<' => body + &fill(missing),
        '^' => fill(missing / 2) + &body + &fill(missing - missing / 2),
        '=' => {
            let sign = body.len() - body.trim_start_matches(['-', '+']).len();
            format!("{}{}{}", &body[..sign], fill(missing), &body[sign..])
        }
        _ => fill(missing) + &body,
    })
}

/// `template.format(..)`: `{}`, `{0}` and `{name}`, with a format behind a colon; `{{` and `}}` are braces.
pub fn filled(template: &str, values: &[Value], named: &[(String, Value)]) -> Result<String, Fault> {
    let mut out = String::new();
    let mut next = 0;
    let mut rest = template;
    while let Some(at) = rest.find(['{', '}']) {
        out.push_str(&rest[..at]);
        let brace = &rest[at..=at];
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix(brace) {
            out.push_str(brace);
            rest = after;
            continue;
        }
        let end = rest.find('}').filter(|_| brace == "{");
        let end = end.ok_or_else(|| Fault::value("a brace in the format has no partner"))?;
        let (name, spec) = rest[..end].split_once(':').unwrap_or((&rest[..end], ""));
        let value = if name.is_empty() {
            next += 1;
            values.get(next - 1)
        } else if let Ok(place) = name.parse::<usize>() {
            values.get(place)
        } else {
            named.iter().find(|(known, _)| known == name).map(|(_, value)| value)
        };
        let value = value.ok_or_else(|| Fault::value(format!("the format has no value for `{{{name}}}`")))?;
        out.push_str(&formatted(value, spec)?);
        rest = &rest[end + 1..];
    }
    out.push_str(rest);
    Ok(out)
}

/// `template % values`, with `%d`, `%i`, `%f`, `%e`, `%g`, `%s`, `%r` and `%%`.
pub fn percent(template: &str, values: &Value) -> Result<String, Fault> {
    let all = match values {
        Value::Tuple(items) => items.0.borrow().clone(),
        one => vec![one.clone()],
    };
    let mut given = all.iter();
    let mut out = String::new();
    let mut parts = template.split('%');
    out.push_str(parts.next().unwrap_or(""));
    while let Some(part) = parts.next() {
        let Some(end) = part.find(|c: char| c.is_ascii_alphabetic()) else {
            if !part.is_empty() {
                return Err(Fault::value(format!("the format `%{part}` has no type")));
            }
            // `%%` leaves an empty part, and what follows is plain.
            out.push('%');
            out.push_str(parts.next().unwrap_or(""));
            continue;
        };
        let value = given.next().ok_or_else(|| Fault::kind("there are fewer values than formats"))?;
        let (flags, kind) = (&part[..end], &part[end..=end]);
        let left = flags.strip_prefix('-');
        let flags = left.map_or_else(|| flags.to_owned(), |rest| format!("<{rest}"));
        out.push_str(&match kind {
            "s" | "r" => {
                let shown = if kind == "s" { text(value) } else { repr(value) };
                let align = if left.is_none() && !flags.is_empty() { ">" } else { "" };
                formatted(&Value::str(shown), &format!("{align}{flags}"))?
            }
            "d" | "i" => {
                let whole =
                    value.as_scalar().ok_or_else(|| Fault::kind("%d takes a number"))?.float().trunc();
                formatted(&Value::int(whole as i64), &format!("{flags}d"))?
            }
            "f" | "e" | "g" | "F" | "E" | "G" => {
                let number =
                    value.as_scalar().ok_or_else(|| Fault::kind(format!("%{kind} takes a number")))?;
                formatted(&Value::float(number.float()), &format!("{flags}{kind}"))?
            }
            other => return Err(Fault::unsupported(format!("the format %{other}"), "use an f-string")),
        });
        out.push_str(&part[end + 1..]);
    }
    if given.next().is_some() {
        return Err(Fault::kind("there are more values than formats"));
    }
    Ok(out)
}

fn with_commas(body: &str) -> String {
    let digits = body.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(body.len());
    let (whole, rest) = body.split_at(digits);
    let (sign, whole) = whole.split_at(usize::from(whole.starts_with('-')));
    let mut out = String::new();
    for (at, c) in whole.chars().enumerate() {
        if at > 0 && (whole.len() - at) % 3 == 0 {
            out.push(',');
        }
        out.push(c);
    }
    format!("{sign}{out}{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_python_writes_them() {
        let shown = |f: f64, spec: &str| formatted(&Value::float(f), spec).unwrap();
        assert_eq!(shown(1.0, ""), "1.0");
        assert_eq!(shown(1e-7, ""), "1e-07");
        assert_eq!(shown(1e16, ""), "1e+16");
        assert_eq!(shown(std::f64::consts::PI, ".3f"), "3.142");
        assert_eq!(shown(1234567.0, ",.1f"), "1,234,567.0");
        assert_eq!(shown(0.000012345, ".3g"), "1.23e-05");
        assert_eq!(shown(-2.5, "08.2f"), "-0002.50");
        assert_eq!(formatted(&Value::str("ab"), "^6").unwrap(), "  ab  ");
        assert!(formatted(&Value::str("ab"), ".3f").is_err());
    }
}
