//! Programs nobody would write: random ones and mutated answers. None may panic or exceed its limits.

use donut::llm::answer::stages_within;
use donut::llm::recorded;
use donut::stagecode::{Limits, evaluate};
use proptest::prelude::*;

fn tight() -> Limits {
    Limits { operations: 200_000, elements: 20_000, depth: 200, seconds: 2.0, ..Limits::default() }
}

/// A random expression over a few variables, most of numpy's table among them.
fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("a".to_owned()),
        Just("b".to_owned()),
        Just("m".to_owned()),
        Just("s".to_owned()),
        Just("d".to_owned()),
        Just("None".to_owned()),
        Just("...".to_owned()),
        Just("True".to_owned()),
        Just("np.nan".to_owned()),
        Just("'x'".to_owned()),
        Just("[]".to_owned()),
        Just("np.zeros((0, 3))".to_owned()),
        Just("rng".to_owned()),
        any::<i64>().prop_map(|i| format!("({i})")),
        (-3i64..4).prop_map(|i| format!("({i})")),
        any::<f64>().prop_map(|f| format!("({f:e})")),
    ];
    leaf.prop_recursive(4, 40, 4, |inner| {
        let name = prop::sample::select(NAMES);
        let method = prop::sample::select(METHODS);
        let op = prop::sample::select(&["+", "-", "*", "/", "//", "%", "**", "@", "<", "==", "&", "|", "<<", ">>", "in", "and", "is"][..]);
        let key = prop::sample::select(&["axis", "size", "keepdims", "dtype", "key", "indexing", "p", "replace", "out", "where", "initial"][..]);
        prop_oneof![
            (inner.clone(), op, inner.clone()).prop_map(|(x, o, y)| format!("({x} {o} {y})")),
            (name.clone(), prop::collection::vec(inner.clone(), 0..4)).prop_map(|(f, v)| format!("{f}({})", v.join(", "))),
            (name, inner.clone(), key, inner.clone()).prop_map(|(f, x, k, y)| format!("{f}({x}, {k}={y})")),
            (inner.clone(), method, prop::collection::vec(inner.clone(), 0..3))
                .prop_map(|(x, f, v)| format!("{x}.{f}({})", v.join(", "))),
            (inner.clone(), inner.clone()).prop_map(|(x, y)| format!("{x}[{y}]")),
            (inner.clone(), inner.clone(), inner.clone()).prop_map(|(x, y, z)| format!("{x}[{y}:{z}, ::{y}]")),
            (inner.clone(), inner.clone(), inner.clone()).prop_map(|(x, y, z)| format!("{x}[{y}:{z}:-1]")),
            prop::collection::vec(inner.clone(), 0..4).prop_map(|v| format!("[{}]", v.join(", "))),
            (inner.clone(), inner.clone()).prop_map(|(x, y)| format!("[{x} for q in {y}]")),
            (inner.clone(), inner.clone()).prop_map(|(x, y)| format!("f'{{{x}}} {{{y}:8.3f}}'")),
            inner.prop_map(|x| format!("(-{x})")),
        ]
    })
}

const METHODS: &[&str] = &[
    "sum",
    "mean",
    "reshape",
    "astype",
    "tolist",
    "sort",
    "append",
    "pop",
    "insert",
    "split",
    "join",
    "get",
    "uniform",
    "choice",
    "permutation",
    "shuffle",
    "integers",
    "repeat",
    "transpose",
    "argmax",
    "cumsum",
    "items",
    "index",
    "replace",
    "fill",
    "clip",
    "center",
    "strip",
    "update",
    "issubset",
    "remove",
    "at",
];

const NAMES: &[&str] = &[
    "np.array",
    "np.zeros",
    "np.full",
    "np.arange",
    "np.linspace",
    "np.eye",
    "np.diag",
    "np.reshape",
    "np.transpose",
    "np.moveaxis",
    "np.squeeze",
    "np.roll",
    "np.flip",
    "np.concatenate",
    "np.stack",
    "np.vstack",
    "np.dstack",
    "np.tile",
    "np.repeat",
    "np.split",
    "np.delete",
    "np.insert",
    "np.meshgrid",
    "np.indices",
    "np.sum",
    "np.prod",
    "np.mean",
    "np.max",
    "np.argmin",
    "np.percentile",
    "np.cumsum",
    "np.diff",
    "np.where",
    "np.clip",
    "np.isclose",
    "np.round",
    "np.nonzero",
    "np.argwhere",
    "np.interp",
    "np.sort",
    "np.argsort",
    "np.unique",
    "np.searchsorted",
    "np.bincount",
    "np.isin",
    "np.dot",
    "np.matmul",
    "np.cross",
    "np.outer",
    "np.trace",
    "np.einsum",
    "np.linalg.norm",
    "np.linalg.inv",
    "np.linalg.solve",
    "np.linalg.det",
    "np.random.rand",
    "np.random.uniform",
    "np.random.normal",
    "np.random.choice",
    "np.random.permutation",
    "np.random.randint",
    "np.random.default_rng",
    "np.random.seed",
    "rng.choice",
    "rng.integers",
    "rng.triangular",
    "np.power",
    "np.left_shift",
    "np.hypot",
    "np.sin",
    "math.floor",
    "math.log",
    "math.sqrt",
    "range",
    "len",
    "list",
    "zip",
    "map",
    "sorted",
    "min",
    "max",
    "sum",
    "round",
    "int",
    "float",
    "str",
    "dict",
    "set",
    "enumerate",
    "np.tril",
    "np.broadcast_to",
    "np.expand_dims",
    "np.swapaxes",
    "np.average",
    "np.trapezoid",
    "np.lexsort",
    "np.digitize",
    "np.select",
    "np.array_split",
    "np.geomspace",
    "np.logspace",
    "np.apply_along_axis",
    "np.vectorize",
    "np.gradient",
    "np.polyfit",
    "np.roots",
    "np.convolve",
    "np.cov",
    "np.histogram",
    "np.pad",
    "np.piecewise",
    "np.unravel_index",
    "np.triu_indices",
    "np.ndindex",
    "np.add.at",
    "np.add.reduce",
    "np.maximum.accumulate",
    "np.divide",
    "np.abs",
    "np.kron",
    "np.linalg.svd",
    "np.linalg.eigh",
    "np.linalg.qr",
    "np.linalg.pinv",
    "np.linalg.lstsq",
    "np.linalg.matrix_rank",
    "np.linalg.cholesky",
    "random.choice",
    "random.choices",
    "random.sample",
    "random.shuffle",
    "random.randint",
    "random.seed",
    "random.gauss",
    "itertools.product",
    "itertools.combinations",
    "itertools.permutations",
    "itertools.islice",
    "itertools.accumulate",
    "functools.reduce",
    "functools.partial",
    "collections.defaultdict",
    "collections.Counter",
    "copy.deepcopy",
    "getattr",
    "hasattr",
    "divmod",
    "next",
    "type",
];

const START: &str = "import random, itertools, functools, collections, copy\na = np.arange(6).reshape(2, 3)\nb = 2.5\nm = a > 2\ns = [1, 2, 3]\nd = {'x': 1}\nrng = np.random.default_rng(1)\n";

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_programs_do_not_panic(lines in prop::collection::vec(expression(), 1..4)) {
        let body: String = lines.iter().map(|l| format!("try:\n    a[0] = {l}\n    b = {l}\nexcept Exception: pass\n")).collect();
        let _ = evaluate(&tight(), |session| session.run(&format!("{START}{body}"), 1, 0));
        let _ = evaluate(&tight(), |session| session.run(&format!("{START}a[{}] += {}", lines[0], lines[0]), 1, 0));
    }

    #[test]
    fn random_text_does_not_panic(text in "[ -~\n]{0,200}") {
        let _ = evaluate(&tight(), |session| session.run(&text, 1, 0));
        let _ = stages_within(&format!("### Step 1: x\n{text}\n```python\n{text}\n```\n{text}"), &tight());
    }

    #[test]
    fn mutated_answers_do_not_panic(
        which in 0usize..30,
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0usize..12, "[-+*/()\\[\\]:,.0-9a-z#`\n \"]{0,6}"), 1..6),
    ) {
        let mut text: Vec<char> = recorded::all().nth(which).unwrap().text.chars().collect();
        for (at, remove, insert) in &cuts {
            let at = at.index(text.len());
            let end = (at + remove).min(text.len());
            text.splice(at..end, insert.chars());
        }
        let text: String = text.into_iter().collect();
        let _ = stages_within(&text, &tight());
    }

    /// Whole lines dropped, doubled and moved: fences, headings and fields in all the wrong places.
    #[test]
    fn answers_with_their_lines_in_disorder_do_not_panic(
        which in 0usize..30,
        moves in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0usize..3), 1..8),
    ) {
        let text = recorded::all().nth(which).unwrap().text;
        let mut lines: Vec<&str> = text.lines().collect();
        for (from, to, how) in &moves {
            let (from, to) = (from.index(lines.len()), to.index(lines.len()));
            match how {
                0 if lines.len() > 1 => drop(lines.remove(from)),
                1 => lines.insert(to, lines[from]),
                _ => lines.swap(from, to),
            }
        }
        let _ = stages_within(&lines.join("\n"), &tight());
    }

    /// Answers built of pieces that the parser looks for.
    #[test]
    fn answers_of_fragments_do_not_panic(parts in prop::collection::vec(prop::sample::select(FRAGMENTS), 1..24)) {
        let _ = stages_within(&parts.concat(), &tight());
    }
}

const FRAGMENTS: &[&str] = &[
    "Step 1: x\n",
    "### Step 2",
    "**Step [3]:** y\n",
    "## 1. z\n",
    "Step 99999999999: a\n",
    "\n",
    "```",
    "```python\n",
    "~~~\n",
    "```markdown\n",
    "tool name: ",
    "[knife]\n",
    "in var name: [",
    "a",
    "\"b\", ",
    "]",
    "out var name: ",
    "loc: {",
    "(0, ",
    "a/0, 1)",
    "}",
    "vol: ",
    "4/3 π r³",
    "−",
    "é",
    "\u{feff}",
    "| tool | pin |\n",
    "  - ",
    "# Summary\n",
    "of the `",
    "a = np.ones((3, 3))\n",
    "b = a[",
    "import numpy as np\n",
    "    ",
    "\r\n",
    "\t",
    ":",
    "=",
    "**",
    "`",
    "(",
    ")",
    "[[[[",
    "volume of ",
    " of each piece",
];
