//! Every recorded answer, rewritten in many other forms, gives the same stages.

use donut::llm::reply::Reply;
use donut::llm::{Answer, recorded, stages_from_answer};

/// A rewriting of an answer that changes its form alone.
type Rewriting = (&'static str, fn(&str) -> String);

/// Applies `change` to every line; it is told whether the line is code.
fn by_line(text: &str, change: impl Fn(&str, bool) -> String) -> String {
    let mut in_code = false;
    let lines = text.lines().map(|line| {
        let fence = line.starts_with("```");
        let changed = change(line, in_code && !fence);
        in_code ^= fence;
        changed
    });
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

/// Applies `change` to every line that is not code.
fn prose(text: &str, change: impl Fn(&str) -> String) -> String {
    by_line(text, |line, code| if code { line.to_owned() } else { change(line) })
}

/// The lines of prose with a prefix of each replaced.
fn with_prefix(text: &str, old: &str, new: &str) -> String {
    prose(text, |line| match line.strip_prefix(old) {
        Some(rest) => format!("{new}{rest}"),
        None => line.to_owned(),
    })
}

/// Every heading `### Step N: title` made anew from N and title.
fn headings(text: &str, make: impl Fn(&str, &str) -> String) -> String {
    prose(text, |line| match line.strip_prefix("### Step ").and_then(|rest| rest.split_once(": ")) {
        Some((number, title)) => make(number, title),
        None => line.to_owned(),
    })
}

/// Every line `in var name: A, out var name: B` made anew.
fn in_and_out(text: &str, make: impl Fn(&str, &str) -> String) -> String {
    prose(text, |line| {
        match line.strip_prefix("in var name: ").and_then(|r| r.split_once(", out var name: ")) {
            Some((a, b)) => make(a, b),
            None => line.to_owned(),
        }
    })
}

/// `{"a": x, "b": y}` as `format` makes each pair, joined.
fn pairs(line: &str, key: &str, join: &str, format: impl Fn(&str, &str) -> String) -> String {
    let inner = line[key.len()..].trim().trim_start_matches('{').trim_end_matches('}');
    let mut parts = Vec::new();
    for pair in inner.split(", \"").map(|p| p.trim_start_matches('"')) {
        if let Some((name, value)) = pair.split_once("\":") {
            parts.push(format(name, value.trim()));
        }
    }
    parts.join(join)
}

/// The lines of the field `key` under another name, with their pairs in one line.
fn listed(text: &str, key: &str, name: &str, format: impl Fn(&str, &str) -> String) -> String {
    prose(text, |l| match l.strip_prefix(key) {
        Some(_) => format!("{name}: {}", pairs(l, key, ", ", &format)),
        None => l.to_owned(),
    })
}

fn number_word(number: &str) -> &str {
    ["Zero", "One", "Two", "Three", "Four", "Five", "Six", "Seven"][number.parse::<usize>().unwrap()]
}

const REWRITINGS: &[Rewriting] = &[
    ("CRLF", |t| t.replace('\n', "\r\n")),
    ("no language", |t| t.replace("```python", "```")),
    ("Py, tildes", |t| t.replace("```python", "~~~Py").replace("```", "~~~")),
    ("language with a remark", |t| t.replace("```python", "```python title=\"code.py\"")),
    ("indented fences", |t| {
        by_line(t, |l, c| if c || l.starts_with("```") { format!("   {l}") } else { l.into() })
    }),
    ("all indented", |t| by_line(t, |l, _| format!("  {l}"))),
    ("the paper's headings", |t| headings(t, |n, title| format!("Step [{n}]: {title}"))),
    ("plain headings", |t| headings(t, |n, title| format!("Step {n}: {title}"))),
    ("bold headings", |t| headings(t, |n, title| format!("**Step {n}: {title}**"))),
    ("bold numbers", |t| headings(t, |n, title| format!("**Step {n}:** {title}"))),
    ("headings with a dash", |t| headings(t, |n, title| format!("## Step {n} — {title}"))),
    ("headings with a hyphen", |t| headings(t, |n, title| format!("#### STEP {n} ‐ {title}"))),
    ("numbers in words", |t| headings(t, |n, title| format!("## Step {}: {title}", number_word(n)))),
    ("list of headings", |t| headings(t, |n, title| format!("{n}. **Step {n}**: {title}"))),
    ("no word step", |t| headings(t, |n, title| format!("## {n}. {title}"))),
    ("title below", |t| headings(t, |n, title| format!("Step [{n}]:\nOne-line explanation: {title}"))),
    ("bold fields", |t| {
        let t = with_prefix(t, "tool name:", "**Tool name:**");
        let t = in_and_out(&t, |a, b| format!("**In var name:** {a}, **Out var name:** {b}"));
        with_prefix(&with_prefix(&t, "loc:", "**Loc:**"), "vol:", "**Vol:**")
    }),
    ("bulleted fields", |t| {
        let t = with_prefix(t, "tool name:", "- *Tool*:");
        let t = in_and_out(&t, |a, b| format!("* in_var_name = {a}\n* out_var_name = {b}"));
        with_prefix(&with_prefix(&t, "loc:", "• Location:"), "vol:", "– Volume:")
    }),
    ("numbered fields", |t| {
        let t = with_prefix(t, "tool name:", "1. Tool name:");
        let t = in_and_out(&t, |a, b| format!("4. Input variable: {a}\n5. Output variable: {b}"));
        with_prefix(
            &with_prefix(&t, "loc:", "6) Location of each piece:"),
            "vol:",
            "7) Volume of each piece:",
        )
    }),
    ("no colons", |t| {
        let t = with_prefix(t, "tool name:", "tool name");
        let t = prose(&t, |l| {
            l.strip_prefix("tool name ")
                .map_or(l.to_owned(), |v| format!("tool name [{}]", v.trim().trim_matches(['[', ']'])))
        });
        let t = in_and_out(&t, |a, b| format!("in var name {a}, out var name {b}"));
        with_prefix(&with_prefix(&t, "loc:", "loc"), "vol:", "vol")
    }),
    ("no comma between", |t| in_and_out(t, |a, b| format!("in var name: {a} out var name: {b}"))),
    ("single quotes", |t| prose(t, |l| l.replace('"', "'"))),
    ("curly quotes", |t| {
        prose(t, |l| l.replace(" \"", " “").replace("[\"", "[“").replace("{\"", "{“").replace('"', "”"))
    }),
    ("no quotes", |t| prose(t, |l| l.replace('"', ""))),
    ("backticks", |t| prose(t, |l| l.replace('"', "`"))),
    ("unbroken blanks", |t| prose(t, |l| l.replace(' ', "\u{a0}"))),
    ("lists of places", |t| {
        prose(t, |l| match l.strip_prefix("loc:") {
            Some(_) => format!("- loc:\n{}", pairs(l, "loc:", "\n", |n, v| format!("  - {n}: {v}"))),
            None => l.to_owned(),
        })
    }),
    ("places in words", |t| listed(t, "loc:", "Location", |n, v| format!("{n} at {v}"))),
    ("volumes with equals", |t| listed(t, "vol:", "Volume", |n, v| format!("{n} = {v} cubic units"))),
    ("volumes one by one", |t| {
        prose(t, |l| match l.strip_prefix("vol:") {
            Some(_) => pairs(l, "vol:", "\n", |n, v| format!("- Volume of {n}: {v}")),
            None => l.to_owned(),
        })
    }),
    ("fields in a fence", |t| {
        let t = in_and_out(t, |a, b| format!("~~~\nin var name: {a}, out var name: {b}\n~~~"));
        prose(&t, |l| if l.starts_with("loc:") { format!("~~~text\n{l}\n~~~") } else { l.to_owned() })
    }),
    ("a table of fields", |t| {
        let t = prose(t, |l| {
            l.strip_prefix("tool name:").map_or(l.to_owned(), |v| {
                format!("| field | value |\n|---|---|\n| **Tool name** | {} |", v.trim())
            })
        });
        in_and_out(&t, |a, b| format!("| In var name | {a} |\n| Out var name | {b} |"))
    }),
    ("tools in brackets", |t| {
        prose(t, |l| {
            l.strip_prefix("tool name:").map_or(l.to_owned(), |v| {
                let v = v.trim().trim_matches(['[', ']']);
                format!("Tool name: [{}{}]", v[..1].to_uppercase(), &v[1..])
            })
        })
    }),
    ("two blocks a step", |t| {
        t.replace("```\nin var", "```\nThe variables of this step:\n```python\npass\n```\nin var")
    }),
    ("code without fences", |t| t.replace("```python", "Python code:").replace("```", "")),
    ("code indented instead of fenced", |t| {
        by_line(t, |l, c| {
            if l.starts_with("```") {
                String::new()
            } else if c {
                format!("    {l}")
            } else {
                l.into()
            }
        })
    }),
    ("wrapped in markdown", |t| format!("Here you go:\n\n```markdown\n{t}```\n\nI hope that this helps.\n")),
    ("wrapped in a fence", |t| {
        format!("```\n{}```\n", headings(t, |n, title| format!("Step [{n}]: {title}")))
    }),
    ("helpers first", |t| {
        format!(
            "First some imports.\n\n```python\nimport numpy as np\nimport math\n\ndef helper(n):\n    return np.zeros((n, 3))\n```\n\n{t}"
        )
    }),
    ("a list of steps first", |t| {
        let list: String =
            t.lines().filter(|l| l.starts_with("### Step ")).map(|l| format!("- {}\n", &l[4..])).collect();
        format!("The plan has these steps:\n\n{list}\n---\n\n{t}")
    }),
    ("a summary behind", |t| {
        let list: String = t
            .lines()
            .filter(|l| l.starts_with("### Step "))
            .map(|l| format!("{}: done\n", &l[4..]))
            .collect();
        format!(
            "{t}\n---\n\n### Summary\n\n{list}\nvol: {{\"everything\": 99}}\n\n```python\nimport matplotlib.pyplot as plt\nplt.show()\n```\n"
        )
    }),
    ("closing words", |t| format!("{t}\nThe volume is kept in every step, and the final shape: as asked.\n")),
    ("steps of a derivation", |t| {
        prose(t, |l| {
            if l.starts_with("tool name") {
                format!("{l}\nStep 1: take the volume\nStep 2: divide by the height")
            } else {
                l.to_owned()
            }
        })
    }),
    ("rules between steps", |t| headings(t, |n, title| format!("---\n\n### Step {n}: {title}"))),
    ("a byte order mark", |t| format!("\u{feff}{t}")),
];

/// What must not depend on the form, from an answer that ran.
fn essence(answer: &Answer) -> Vec<String> {
    let stages = answer.stages.iter().map(|s| {
        format!(
            "{} {:?} {:?} {:?} {:?} {:?}",
            s.step, s.tool, s.inputs, s.outputs, s.stated_location, s.stated_volume
        )
    });
    stages.collect()
}

/// The same from one that was only taken apart. Blanks, marks and capitals do not count.
fn outline(reply: &Reply) -> Vec<String> {
    let plain = |t: &str| t.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase();
    let steps = reply.steps.iter().map(|s| {
        let tools: Vec<String> = s.tools.iter().map(|(_, t)| plain(t)).collect();
        let volumes: Vec<String> =
            s.volumes.iter().map(|(n, v)| format!("{n}={}", v.split(' ').next().unwrap_or(""))).collect();
        let code: String =
            s.code.iter().flat_map(|b| b.text.lines()).filter(|l| *l != "pass").map(plain).collect();
        format!(
            "{} {} {tools:?} {:?} {:?} {:?} {volumes:?} {code}",
            s.step,
            plain(&s.title),
            s.inputs.names,
            s.outputs.names,
            s.locations
        )
    });
    steps.collect()
}

/// Where two texts begin to differ, with a little around it.
fn difference(found: &[String], wanted: &[String]) -> Option<String> {
    if found.len() != wanted.len() {
        return Some(format!("{} steps, not {}", found.len(), wanted.len()));
    }
    let (a, b) = found.iter().zip(wanted).find(|(a, b)| a != b)?;
    let at = a.chars().zip(b.chars()).position(|(x, y)| x != y).unwrap_or(0);
    let around = |t: &str| t.chars().skip(at.saturating_sub(60)).take(120).collect::<String>();
    Some(format!("\n  {}\n  {}", around(a), around(b)))
}

#[test]
fn recorded_answers_are_understood_in_every_form() {
    let mut failures = Vec::new();
    for (which, r) in recorded::all().enumerate() {
        let wanted = outline(&Reply::parse(r.text));
        for (k, (form, rewrite)) in REWRITINGS.iter().enumerate() {
            let text = rewrite(r.text);
            let name = format!("{} {} {}: {form}", r.task, r.volume_reasoning, r.index);
            failures
                .extend(difference(&outline(&Reply::parse(&text)), &wanted).map(|d| format!("{name}: {d}")));
            // Each form also runs, with one answer.
            if k % 30 == which {
                let wanted = essence(&stages_from_answer(r.text).unwrap());
                match stages_from_answer(&text) {
                    Err(error) => failures.push(format!("{name}: {error}")),
                    Ok(answer) => failures
                        .extend(difference(&essence(&answer), &wanted).map(|d| format!("{name}: {d}"))),
                }
            }
        }
    }
    assert!(
        failures.is_empty(),
        "{} failures\n{}",
        failures.len(),
        failures[..failures.len().min(40)].join("\n")
    );
}
