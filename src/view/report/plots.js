// Plots as SVG: a few lines over a common x, a cursor that follows the frame, a click that seeks.

const SVG = "http://www.w3.org/2000/svg";

function svg(name, attributes = {}, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

// Round values that divide [from, to] into about `count` parts.
function ticks(from, to, count) {
  const raw = (to - from) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= raw * 0.999);
  const out = [];
  for (let v = Math.ceil(from / step - 1e-9) * step; v <= to + 1e-9 * step; v += step) out.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return out;
}

const short = (v) => String(Number(v.toPrecision(3)));

class Plot {
  // `content()` gives {x: [from, to], y: [from, to], xLabel, lines: [{points, color, opacity}], marks: [{x, y, kind, title}], rules: [{x, label}]}.
  constructor(box, label, content, seek) {
    Object.assign(this, {box, label, content, seek, frame: 0});
    new ResizeObserver(() => this.draw()).observe(box);
  }

  draw() {
    const width = this.box.clientWidth, height = 170, c = this.content();
    if (!width) return;
    const [left, right, top, bottom] = [44, width - 8, 16, height - 24];
    const span = (r) => (r[1] > r[0] ? r : [r[0], r[0] + 1]);
    const [x0, x1] = span(c.x), [y0, y1] = span(c.y);
    this.toX = (v) => left + (v - x0) / (x1 - x0) * (right - left);
    const toY = (v) => bottom - (v - y0) / (y1 - y0) * (bottom - top);
    const label = c.summary ? `${this.label}: ${c.summary}` : this.label;
    const root = svg("svg", {viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label});
    for (const v of ticks(y0, y1, 4)) {
      root.append(svg("line", {x1: left, x2: right, y1: toY(v), y2: toY(v), stroke: "var(--grid)"}));
      root.append(svg("text", {x: left - 6, y: toY(v) + 4, "text-anchor": "end"}, short(v)));
    }
    for (const v of ticks(x0, x1, Math.max(2, width / 110))) {
      if (right - this.toX(v) > 6 * c.xLabel.length + 14) {
        root.append(svg("text", {x: this.toX(v), y: height - 9, "text-anchor": "middle"}, short(v)));
      }
    }
    root.append(svg("text", {x: right, y: height - 9, "text-anchor": "end"}, c.xLabel));
    for (const {x, label} of c.rules || []) {
      root.append(svg("line", {x1: this.toX(x), x2: this.toX(x), y1: top - 8, y2: bottom, stroke: "var(--line)", "stroke-dasharray": "3 3"}));
      root.append(svg("text", {x: this.toX(x) + 4, y: top - 4}, label));
    }
    for (const {points, color, opacity, width} of c.lines) {
      const path = points.map(([x, y]) => `${this.toX(x).toFixed(1)},${toY(y).toFixed(1)}`).join(" ");
      root.append(svg("polyline", {points: path, class: "line", stroke: color, opacity: opacity || 1, ...(width ? {style: `stroke-width: ${width}`} : {})}));
    }
    for (const {x, y, kind, title} of c.marks || []) root.append(this.mark(this.toX(x), toY(y), kind, title));
    if (this.seek) this.addCursor(root, {left, right, top, bottom, x0, x1});
    this.box.replaceChildren(root);
    this.follow(this.frame);
  }

  mark(x, y, kind, title) {
    const shape = kind === "reset"
      ? svg("path", {d: `M${x} ${y - 5}l-5 -9h10z`, fill: "var(--ink)"})
      : kind === "measured"
      ? svg("circle", {cx: x, cy: y, r: 3.5, fill: "var(--ink)"})
      : svg("path", {d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`, stroke: "var(--bad)", "stroke-width": 2});
    shape.append(svg("title", {}, title));
    return shape;
  }

  addCursor(root, {left, right, top, bottom, x0, x1}) {
    this.cursor = svg("line", {y1: top, y2: bottom, class: "cursor"});
    const pane = svg("rect", {x: left, y: 0, width: right - left, height: bottom, fill: "transparent", class: "seek"});
    const go = (e) => {
      const box = pane.getBoundingClientRect();
      this.seek(Math.round(x0 + (e.clientX - box.left) / box.width * (x1 - x0)));
    };
    pane.addEventListener("pointerdown", (e) => { pane.setPointerCapture(e.pointerId); go(e); });
    pane.addEventListener("pointermove", (e) => { if (e.buttons) go(e); });
    root.append(this.cursor, pane);
  }

  follow(frame) {
    this.frame = frame;
    if (!this.cursor || !this.toX) return;
    for (const end of ["x1", "x2"]) this.cursor.setAttribute(end, this.toX(frame));
  }
}

const stageColor = (k) => `var(--s${k % 7})`;
const lastFrame = (s) => s.first_frame + (s.accepted ? s.actions.length : 0);
const isReset = (s, k) => s.placed && k > 0;

// A mark for the first step of each stage but the first.
function stageRules(run) {
  return run.stages.flatMap((stage, k) => (k && stage.segments[0] ? [{x: stage.segments[0].first_frame, label: `stage ${k + 1}`}] : []));
}

function emdContent(run) {
  const lines = [], marks = [];
  run.stages.forEach((stage, k) => {
    const points = new Map();
    const put = (frame, v) => { if (v !== null && !points.has(frame)) points.set(frame, 1e3 * v); };
    stage.segments.forEach((s, i) => {
      put(s.first_frame, s.emd_before);
      const at = [s.first_frame, 1e3 * (s.emd_before ?? 0)];
      if (isReset(s, i)) marks.push({x: at[0], y: at[1], kind: "reset", title: `reset before step ${at[0] + 1}`});
      if (!s.accepted) return marks.push({x: at[0], y: at[1], kind: "rejected", title: `a try from step ${at[0]} was not kept`});
      for (let f = s.first_frame + 1; f < lastFrame(s); f++) put(f, run.emd[f]);
      put(lastFrame(s), s.emd_after);
    });
    // After the last segment the dough settles, and is measured once more.
    run.stage.forEach((of, f) => { if (of === k && f > 0 && run.emd[f] !== null) put(f, run.emd[f]); });
    lines.push({points: [...points].sort((a, b) => a[0] - b[0]), color: stageColor(k)});
  });
  const top = Math.max(1e-3, ...lines.flatMap((l) => l.points.map((p) => p[1])));
  const ends = lines.map(({points: p}, k) => (p.length ? `stage ${k + 1} from ${short(p[0][1])} to ${short(p[p.length - 1][1])} mm` : ""));
  return {
    summary: ends.filter(Boolean).join(", "), x: [0, run.frames - 1], y: [0, top * 1.12], xLabel: "step", lines, marks, rules: stageRules(run)};
}

function lossContent(run, current) {
  const all = run.stages.flatMap((stage, k) => stage.segments.map((s) => ({s, k})));
  const lines = all.map(({s, k}) => ({
    points: s.losses.map((v, i) => [i, v]).filter((p) => p[1] !== null),
    color: stageColor(k), opacity: s === current ? 1 : 0.22,
  }));
  const values = lines.flatMap((l) => l.points.map((p) => p[1]));
  const longest = Math.max(2, ...all.map(({s}) => s.losses.length));
  const [low, high] = values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
  return {x: [0, longest - 1], y: [Math.min(0, low), high * 1.05 || 1], xLabel: "iteration", lines};
}

// Methods that search for strokes give what their objective was before, what the best stroke promised with few
// particles, and what it was with all.
function isSearch(run) {
  const segments = run.stages.flatMap((stage) => stage.segments);
  return Boolean(run.search) && run.summary.method !== "paper" && segments.length > 0 && segments.every((s) => s.losses.length <= 3);
}

function searchContent(run, current) {
  const strokes = run.stages.flatMap((stage, k) => stage.segments.map((s) => ({s, k})));
  const lines = strokes.map(({s, k}, i) => ({
    points: s.losses.slice(0, 2).filter((v) => v !== null).map((v) => [i + 1, 1e3 * v]),
    color: stageColor(k), opacity: s === current ? 1 : 0.4, width: 7,
  }));
  const marks = strokes.flatMap(({s}, i) => (s.emd_after === null ? [] : [{
    x: i + 1, y: 1e3 * s.emd_after, kind: s.accepted ? "measured" : "rejected",
    title: `stroke ${i + 1}: EMD ${short(1e3 * s.emd_after)} mm, ${s.accepted ? "kept" : "not kept"}`,
  }]));
  const top = Math.max(1e-3, ...lines.flatMap((l) => l.points.map((p) => p[1])), ...marks.map((m) => m.y));
  const kept = strokes.filter(({s}) => s.accepted).length;
  return {
    summary: `${strokes.length} strokes, ${kept} kept`,
    x: [0, strokes.length + 1], y: [0, top * 1.1], xLabel: "stroke", lines, marks,
  };
}

// The EMD at each frame, or where it was not measured the last one in the stage.
function knownEmd(run) {
  const known = run.emd.slice();
  for (const stage of run.stages) for (const s of stage.segments) {
    if (s.emd_before !== null) known[s.first_frame] ??= s.emd_before;
  }
  for (let f = 1; f < known.length; f++) if (known[f] === null && run.stage[f] === run.stage[f - 1]) known[f] = known[f - 1];
  return known;
}

function actionContent(run) {
  const width = Math.max(0, ...run.actions.map((a) => a.length));
  const lines = Array.from({length: width}, (_, c) => ({
    // An action holds from one frame to the next.
    points: run.actions.flatMap((a, t) => [[t, a[c] ?? 0], [t + 1, a[c] ?? 0]]), color: stageColor(c),
  }));
  return {x: [0, run.frames - 1], y: [-1.05, 1.05], xLabel: "step", lines, rules: stageRules(run)};
}
