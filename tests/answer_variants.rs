//! Answers in other forms: every recorded answer rewritten in many ways gives the same stages, and answers in the
//! paper's own form, with what models make of it, are understood.

use std::fs;
use std::path::Path;

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
    ("places in words", |t| {
        prose(t, |l| match l.strip_prefix("loc:") {
            Some(_) => format!("Location: {}", pairs(l, "loc:", ", ", |n, v| format!("{n} at {v}"))),
            None => l.to_owned(),
        })
    }),
    ("volumes with equals", |t| {
        prose(t, |l| match l.strip_prefix("vol:") {
            Some(_) => format!("Volume: {}", pairs(l, "vol:", ", ", |n, v| format!("{n} = {v} cubic units"))),
            None => l.to_owned(),
        })
    }),
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

/// The first line of each file of tests/data/answers is a comment with what must come of it: for each step its number,
/// tool and `name=points` of what comes out, and the names that go in.
#[test]
fn answers_in_the_form_of_the_paper_are_understood() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/answers");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        let wanted =
            text.lines().next().unwrap().trim_start_matches("<!--").trim_end_matches("-->").trim().to_owned();
        let found = match stages_from_answer(&text) {
            Err(error) => format!("error: {error}"),
            Ok(answer) => {
                let steps = answer.stages.iter().map(|s| {
                    let tool = s.tool.as_deref().unwrap_or("none");
                    let out: Vec<String> =
                        s.outputs.iter().map(|o| format!("{}={}", o.name, o.points.len())).collect();
                    format!(
                        "{} {tool} {}>{} {}/{}",
                        s.step,
                        s.inputs.join(","),
                        out.join(","),
                        s.stated_location.len(),
                        s.stated_volume.len()
                    )
                });
                steps
                    .chain(answer.warnings.iter().map(|w| format!("warning {w}")))
                    .collect::<Vec<_>>()
                    .join("; ")
            }
        };
        assert_eq!(found, wanted, "{}", path.display());
        count += 1;
    }
    assert!(count >= 12, "{count}");
}

/// An answer as models write them: one step, each part of which a test may write otherwise.
struct Parts<'a> {
    before: &'a str,
    heading: &'a str,
    tool: &'a str,
    derivation: &'a str,
    code: &'a str,
    names: &'a str,
    loc: &'a str,
    vol: &'a str,
    behind: &'a str,
}

const PARTS: Parts = Parts {
    before: "",
    heading: "### Step 1: Flatten",
    tool: "tool name: rolling pin",
    derivation: "derivation: V",
    code: "```python\nimport numpy as np\nV = 2.0\ndisc = np.random.uniform(-1, 1, (3000, 3)) * np.array([1, 0.25, 1])\n```",
    names: "in var name: [\"ball\"], out var name: [\"disc\"]",
    loc: "loc: {\"ball\": (0, 0, 0), \"disc\": (0, 0, 0)}",
    vol: "vol: {\"ball\": 4.18879, \"disc\": 2.0}",
    behind: "",
};

impl Parts<'_> {
    fn answer(&self) -> String {
        let Self { before, heading, tool, derivation, code, names, loc, vol, behind } = self;
        format!("{before}\n{heading}\n{tool}\n{derivation}\n{code}\n{names}\n{loc}\n{vol}\n{behind}\n")
    }

    /// Asserts that the answer means what `PARTS` means.
    fn means_the_same(&self) {
        let text = self.answer();
        let answer = stages_from_answer(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let [stage] = &answer.stages[..] else { panic!("{} stages\n{text}", answer.stages.len()) };
        let found = (stage.title.as_str(), stage.tool.as_deref(), &stage.inputs[..]);
        assert_eq!(found, ("Flatten", Some("rolling pin"), &["ball".to_owned()][..]), "{text}");
        assert_eq!(stage.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["disc"], "{text}");
        assert_eq!(stage.outputs[0].points.len(), 3000, "{text}");
        let places: Vec<_> = stage.stated_location.iter().map(|(n, p)| (n.as_str(), *p)).collect();
        assert_eq!(places, [("ball", [0.0; 3]), ("disc", [0.0; 3])], "{text}");
        let volumes: Vec<_> = stage.stated_volume.iter().map(|(n, v)| (n.as_str(), *v)).collect();
        assert_eq!(volumes, [("ball", 4.18879), ("disc", 2.0)], "{text}");
    }
}

#[test]
fn a_derivation_may_say_what_it_likes() {
    for derivation in [
        "derivation:\n- **Final height:** h = 0.6",
        "derivation:\n**Verification:** π·R²·h = 4.19 ✓",
        "derivation:\n**Note:** the tool: the pole is no use",
        "derivation:\n#### Volume check\nV = 2\n### Final dimensions\nh = 0.5",
        "derivation:\n> **Summary:** V is kept\n1. **Overall:** fine",
        "derivation:\n#### Step 1: compute V\n#### Step 2: compute h",
        "derivation:\n- Input: a ball of radius 1\n- Output: a flat cylinder of radius R",
        "derivation:\n- Tool: the pole cannot flatten\n- Volume: V = 4, h = 0.5",
        "derivation:\n```\nV = 4/3 · π · r³\n```",
        "derivation:\n```\nV = 4/3 * pi * r**3\n```",
        "derivation:\n~~~\nV = 4 => h\n~~~",
    ] {
        Parts { derivation, ..PARTS }.means_the_same();
        let names = format!("{derivation}\n{}", PARTS.names);
        Parts { names: &names, ..PARTS }.means_the_same();
    }
}

#[test]
fn values_may_be_wrapped_explained_or_stand_below_their_keys() {
    for vol in [
        "vol: `{\"ball\": 4.18879, \"disc\": 2.0}`",
        "vol: {\"ball\": 4.18879, \"disc\": 2.0} (conserved)",
        "vol: {\"ball\": 4.18879, \"disc\": 2.0} — conserved",
        "vol: ```{\"ball\": 4.18879, \"disc\": 2.0}```",
        "vol: {\"ball\": \"4.18879\", \"disc\": \"2.0\"}",
        "vol: {\"ball\": 4.18879 (= 4/3·π), \"disc\": 2.0 (= V)}",
        "vol: {\"ball\": 4.18879} -> {\"disc\": 2.0}",
        "vol (approx.): {\"ball\": 4.18879, \"disc\": \\(2.0\\)}",
        "vol: dict(ball=4.18879, disc=V)",
        "vol:\n{\"ball\": 4.18879,\n\"disc\": 2.0}",
        "vol:\n- ball: 4.18879\n- disc: 2.0",
        "#### Vol\n\n$\\{ball: 4.18879, disc: 2.0\\}$",
    ] {
        Parts { vol, ..PARTS }.means_the_same();
    }
    for loc in [
        "loc:\n- ball: (0, 0, 0)\n- disc: (0, 0, 0)",
        "loc: {\"ball\": \"(0, 0, 0)\", \"disc\": np.zeros(3)}",
        "loc: {\"ball\": {\"x\": 0, \"y\": 0, \"z\": 0}, \"disc\": (0 0 0)}",
        "loc: ball: origin (0, 0, 0); disc: origin (0, 0, 0)",
    ] {
        Parts { loc, ..PARTS }.means_the_same();
    }
    for names in [
        "in var name:\n[\"ball\"]\nout var name:\n[\"disc\"]",
        "#### In var name\n`ball`\n#### Out var name\n`disc`",
        "in var name: [\"ball\" (the initial dough)], out var name: [disc: flattened dough]",
        "in var name: (\"ball\",), out var name: (\"disc\",)",
        "in var name: \\[\"ball\"\\], out var name: \\[\"disc\"\\]<br>",
        "in var name: ball -> out var name: disc",
        "In: [\"ball\"], Out: [\"disc\"]",
    ] {
        Parts { names, ..PARTS }.means_the_same();
    }
    for tool in [
        "tool name:\nrolling pin",
        "#### Tool name\n\nrolling pin",
        "tool name:\n- rolling pin",
        "tool name: rolling pin - used because the pole cannot flatten",
        "tool name: rolling pin, because the knife and gripper cannot press along y",
        "tool name (one of the four): rolling\\_pin",
    ] {
        Parts { tool, ..PARTS }.means_the_same();
    }
    // A key without a value states nothing.
    let error = stages_from_answer(&Parts { tool: "tool name:", ..PARTS }.answer()).unwrap_err();
    assert_eq!(error.to_string(), "line 2: step 1 names no tool");
}

#[test]
fn headings_and_fences_may_be_decorated() {
    for heading in [
        "### [Step 1] Flatten",
        "### \u{2705} Step 1: Flatten",
        "### Step I: Flatten",
        "<h3>Step 1: Flatten</h3>",
    ] {
        Parts { heading, ..PARTS }.means_the_same();
    }
    let prompts = "```python\n>>> import numpy as np\n>>> V = 2.0\n>>> n = 3000\n>>> n\n3000\n\
                   >>> disc = np.random.uniform(-1, 1, (n, 3)) * np.array([1, 0.25, 1])\n```";
    let quoted: String = PARTS.code.lines().map(|line| format!("> {line}\n")).collect();
    for code in [
        format!("Code: {}", PARTS.code),
        format!("* {}", PARTS.code),
        format!("1. {}", PARTS.code),
        format!("{}.", PARTS.code),
        prompts.to_owned(),
        quoted,
        PARTS.code.replace("python\n", "python\n%matplotlib inline\n!pip install numpy\n"),
        PARTS.code.replace("V = 2.0", "V = 2.0; print('the ball’s volume')"),
        PARTS.code.replace("V = 2.0", "V = 2.0; print(“volume”)"),
        PARTS.code.replace("import numpy as np\n", "import numpy as np\nimport matplotlib.pyplot as plt\n"),
        PARTS.code.replace("\n```", "\nfig, ax = plt.subplots()\nax.plot(*disc.T)\nplt.show()\n```"),
        PARTS
            .code
            .replace("disc = np.random", "disc = [p for p in np.random")
            .replace("[1, 0.25, 1])", "[1, 0.25, 1])]"),
        PARTS.code.replace("\n```", "\ndisc = [tuple(float(x) for x in p) for p in disc]\n```"),
    ] {
        Parts { code: &code, ..PARTS }.means_the_same();
    }
    let [code, names] = [PARTS.code.trim_end_matches("\n```"), PARTS.names];
    let vol = format!("{}\n```", PARTS.vol);
    Parts { code, vol: &vol, ..PARTS }.means_the_same();
    Parts { code, names, ..PARTS }.means_the_same();
    let unclosed = stages_from_answer(&Parts { code, ..PARTS }.answer()).unwrap();
    assert_eq!(unclosed.warnings[0], "the code fence of line 5 is never closed; it ends with the answer");
}

#[test]
fn what_stands_around_the_steps_is_left_out() {
    for before in [
        "Setup:\n```\npip install numpy\n```",
        "```\nball --pin--> disc\n```",
        "### Step 0: Initial dough\ntool name: none\nin var name: [], out var name: [\"ball\"]\nvol: {\"ball\": 4.18879}\n",
        "### Step 0: Initial dough (given)\nNo action.\n",
    ] {
        Parts { before, ..PARTS }.means_the_same();
    }
    for behind in [
        "Expected output:\n```\ndisc shape: (3000, 3)\nmean: [0. 0. 0.]\n```",
        "You can visualize it with:\n```python\nimport matplotlib.pyplot as plt\nplt.scatter(disc[:, 0], disc[:, 2])\n```",
        "### Putting it all together\n```python\nimport os\n```",
        "### Explanation\n- Tool: knife not needed",
        "### Result\nvol: {\"disc\": 9}\n```python\nfoo()\n```",
        "**Verification:**\n```python\nfoo()\n```",
        "### Step 2: Done\nNo more steps are needed.",
        "### Step 2: Final shape\ntool name: none\nThe disc is the final shape.",
        "### Step 2: Verify\ntool name: none\n```python\nprint(disc.shape)\n```\nin var name: [\"disc\"], out var name: []",
    ] {
        Parts { behind, ..PARTS }.means_the_same();
    }
    // What is left out is said, and a step that is cut off is no remark.
    let warned =
        |behind| stages_from_answer(&Parts { behind, ..PARTS }.answer()).unwrap().warnings.join("; ");
    assert!(
        warned("### Step 2: Done\nThat is all.").contains("step 2 has neither tool nor code and is left out")
    );
    assert!(warned("```python\nimport os\n```").contains("a block of code fails and is left out: line"));
    for behind in
        ["### Step 2: Cut", "### Step 2: Cut with the knife\nIn two.", "### Step 2: Cut\ntool name: knife"]
    {
        assert!(stages_from_answer(&Parts { behind, ..PARTS }.answer()).is_err(), "{behind}");
    }
}
