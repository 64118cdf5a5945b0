//! Answers in the paper's own form, with what models make of it, are understood.

use std::fs;
use std::path::Path;

use donut::llm::stages_from_answer;

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
