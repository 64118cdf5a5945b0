// Unpacks the data, fills the page, and ties the player, the view and the plots to one frame number.

const $ = (id) => document.getElementById(id);
const mm = (v) => (v === null || v === undefined ? "–" : `${(1e3 * v).toFixed(2)}`);
const score = (v) => (v === null || v === undefined ? "–" : v.toFixed(3));

// A node with text and children; nothing on the page is made from markup.
function node(name, text, attributes = {}, children = []) {
  const made = document.createElement(name);
  if (text !== undefined && text !== null) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Every line of the text is deflated by itself.
async function inflate(text) {
  const parts = await Promise.all(text.trim().split(/\s+/).map((line) => {
    const bytes = Uint8Array.from(atob(line), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).arrayBuffer();
  }));
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

// The reverse of pack.rs: low bytes then high bytes, folded differences to the frame before.
function unpack(bytes, run) {
  let at = 0;
  const next = (count, before) => {
    const out = new Uint16Array(3 * count);
    for (let i = 0; i < 3 * count; i++) {
      const z = bytes[at + i] | bytes[at + 3 * count + i] << 8;
      out[i] = (before ? before[i] : 0) + ((z >> 1) ^ -(z & 1));
    }
    at += 6 * count;
    return out;
  };
  const frames = [];
  for (let f = 0; f < run.frames; f++) frames.push(next(run.particles, frames[f - 1]));
  return {frames, clouds: run.overlays.map((o) => next(o.count)), aims: run.reachable.frames.map(() => next(run.reachable.count))};
}

function fillHeader(run) {
  const s = run.summary;
  $("task").textContent = s.task;
  $("verdict").textContent = s.success ? "target reached" : "target not reached";
  $("verdict").className = s.success ? "good" : "bad";
  const facts = [
    ["score", `${score(s.score)} of ${s.threshold} needed`], ["EMD", `${mm(s.emd_initial)} → ${mm(s.emd_final)} mm`],
    ["method", s.method], ["steps", run.frames - 1], ["particles", s.particles],
    ["time", `${s.seconds.toFixed(s.seconds < 10 ? 1 : 0)} s`], ["seed", s.seed],
  ];
  if (s.score_ceiling !== undefined) facts.splice(1, 0, ["best possible score", score(s.score_ceiling)]);
  if (run.stride > 1) facts.push(["shown", `1 in ${run.stride} of ${run.all_particles} particles`]);
  $("facts").append(...facts.map(([k, v]) => node("div", null, {}, [node("dt", k), node("dd", v)])));
  $("version").textContent = `donut ${s.version || ""}`;
}

function fillStages(run, seek) {
  const columns = ["", "stage", "tool", "steps", "resets", "EMD before, mm", "after, mm", "score", "ended", "s"];
  const number = (v) => node("td", v, {class: "number"});
  const head = node("tr", null, {}, columns.map((c, i) => node("th", c, {scope: "col", class: i > 2 && i !== 8 ? "number" : ""})));
  const rows = run.stages.flatMap((stage, k) => {
    const s = run.summary.stages[k] || {};
    const title = node("button", stage.title || `stage ${k + 1}`, {type: "button", class: "link", title: "Go to this stage"});
    title.addEventListener("click", () => seek(stage.segments[0] ? stage.segments[0].first_frame : 0));
    const cell = node("td", null, {}, [title]);
    if (stage.code) cell.append(node("details", null, {}, [node("summary", "code of the subgoal"), node("pre", stage.code)]));
    return [node("tr", null, {"data-stage": k}, [
      number(k + 1), cell, node("td", run.tools[stage.tool] ? run.tools[stage.tool].name : "–"), number(s.steps), number(s.resets),
      number(mm(s.emd_initial)), number(mm(s.emd_final)), number(score(s.score)), node("td", s.stop || "–"),
      number(s.seconds === undefined ? "–" : s.seconds.toFixed(1)),
    ])];
  });
  $("stages").append(node("thead", null, {}, [head]), node("tbody", null, {}, rows));
}

function fillParameters(run) {
  $("command").textContent = run.command;
  $("task-file").textContent = run.task_file;
  const table = (title, values) => node("table", null, {}, [
    node("thead", null, {}, [node("tr", null, {}, [node("th", title, {colspan: 2})])]),
    node("tbody", null, {}, Object.entries(values).map(([k, v]) =>
      node("tr", null, {}, [node("td", k), node("td", Array.isArray(v) ? v.join(", ") : typeof v === "object" ? JSON.stringify(v) : String(v), {class: "number"})]))),
  ]);
  $("parameters").append(table("world", run.params), table("planner", run.planner));
  if (run.search) $("parameters").append(table("search (method donut)", run.search));
  if (run.response) $("response").textContent = run.response;
  $("said").hidden = !run.response;
  if (run.summary.model) $("said-by").textContent = `The answer of ${run.summary.model}`;
}

// One frame number, its stage and segment, and everybody who follows it.
class Player {
  constructor(run, viewer) {
    Object.assign(this, {run, viewer, frame: 0, playing: false, detail: 1});
    const seek = (frame) => this.seek(frame);
    this.plots = [
      new Plot($("plot-emd"), "EMD to the subgoal against control steps", () => emdContent(run), seek),
      new Plot($("plot-actions"), "Action components against control steps", () => actionContent(run), seek),
    ];
    const searched = isSearch(run);
    this.losses = searched
      ? new Plot($("plot-loss"), "What the search of each stroke found", () => searchContent(run, this.segment()))
      : new Plot($("plot-loss"), "Loss against gradient iterations", () => lossContent(run, this.segment()));
    $("loss-title").textContent = searched ? "What the search found" : "Loss per iteration";
    $("loss-note").hidden = !searched;
    this.known = knownEmd(run);
    fillStages(run, seek);
    $("frame").max = run.frames - 1;
    $("frame").addEventListener("input", (e) => { this.pause(); this.seek(Number(e.target.value)); });
    $("play").addEventListener("click", () => this.toggle());
    document.addEventListener("keydown", (e) => this.key(e));
    this.markTrack();
  }

  markTrack() {
    const last = Math.max(1, this.run.frames - 1), percent = (f) => `${100 * f / last}%`;
    this.run.stages.forEach((stage, k) => {
      const ends = stage.segments.filter((s) => s.accepted).map(lastFrame);
      if (!ends.length) return;
      const from = stage.segments[0].first_frame, to = Math.max(...ends);
      $("marks").append(svg("rect", {x: percent(from), width: percent(to - from), y: 2, height: 4, rx: 2, fill: stageColor(k)}));
      stage.segments.forEach((s, i) => {
        if (isReset(s, i)) $("marks").append(svg("circle", {cx: percent(s.first_frame), cy: 4, r: 4, fill: "var(--ink)"}));
      });
    });
  }

  stage() { return this.run.stage[this.frame]; }

  // The kept segment that led to the frame.
  segment() {
    const of = this.run.stages[this.stage()];
    return of && of.segments.find((s) => s.accepted && this.frame <= lastFrame(s) && this.frame >= s.first_frame);
  }

  seek(frame) {
    this.frame = Math.min(this.run.frames - 1, Math.max(0, frame));
    const k = this.stage(), stage = this.run.stages[k], tool = this.run.tools[this.run.tool[this.frame]];
    const since = stage && stage.segments[0] ? stage.segments[0].first_frame : 0;
    if (this.viewer) this.viewer.show(this.frame, Math.min(since, this.frame));
    $("frame").value = this.frame;
    const emd = this.known[this.frame], measured = emd === null ? "" : `, EMD ${mm(emd)} mm`;
    $("frame").setAttribute("aria-valuetext",
      `step ${this.frame} of ${this.run.frames - 1}, stage ${k + 1}${tool ? `, ${tool.name}` : ""}${measured}`);
    $("now").textContent = `${this.frame} / ${this.run.frames - 1} · stage ${k + 1}${tool ? ` · ${tool.name}` : ""}`;
    document.body.dataset.frame = this.frame;
    this.plots.forEach((plot) => plot.follow(this.frame));
    this.describe(tool);
    for (const row of document.querySelectorAll("#stages tr[data-stage]")) row.classList.toggle("current", Number(row.dataset.stage) === k);
  }

  describe(tool) {
    const emd = this.known[this.frame], segment = this.segment(), action = this.run.actions[this.frame - 1];
    $("emd-now").textContent = emd === null ? "" : `${mm(emd)}${this.run.emd[this.frame] === null ? ", last measured" : ""}`;
    if (segment !== this.described) this.losses.draw();
    this.described = segment;
    const order = segment ? this.run.stages[this.stage()].segments.indexOf(segment) + 1 : 0;
    $("loss-now").textContent = segment ? `stage ${this.stage() + 1}, ${isSearch(this.run) ? "stroke" : "segment"} ${order}` : "";
    const names = tool ? tool.actions : [];
    $("action-now").replaceChildren(...names.map((name, c) => {
      const value = action && action[c] !== undefined ? ` ${action[c].toFixed(2)}` : "";
      return node("span", `● ${name}${value}  `, {style: `color: ${stageColor(c)}`});
    }));
  }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  play() {
    if (this.frame >= this.run.frames - 1) this.seek(0);
    this.playing = true;
    $("play").textContent = "❚❚";
    $("play").setAttribute("aria-label", "Pause");
    let before = performance.now(), exact = this.frame, slow = 0;
    if (this.viewer) this.viewer.detail = this.detail;
    const tick = (time) => {
      if (!this.playing) return;
      exact += (time - before) / 1000 * Number($("speed").value);
      // A slow machine plays in fewer pixels rather than in fewer pictures.
      slow = Math.max(0, slow + (time - before > 21 ? 1 : -1));
      before = time;
      if (slow > 12 && this.viewer && this.detail > 0.4) {
        slow = 0;
        this.viewer.detail = this.detail *= 0.75;
      }
      if (Math.floor(exact) !== this.frame) this.seek(Math.floor(exact));
      if (this.frame >= this.run.frames - 1) return this.pause();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    if (this.viewer && this.viewer.detail !== 1) { this.viewer.detail = 1; this.viewer.invalidate(); }
    $("play").textContent = "▶";
    $("play").setAttribute("aria-label", "Play");
  }

  jumpStage(by) {
    const starts = [...new Set(this.run.stages.flatMap((s) => (s.segments[0] ? [s.segments[0].first_frame] : [])))];
    starts.push(this.run.frames - 1);
    const target = by > 0 ? starts.find((f) => f > this.frame) : starts.reverse().find((f) => f < this.frame);
    if (target !== undefined) this.seek(target);
  }

  key(e) {
    const typing = e.target.matches("select, input:not([type=range]), button, summary");
    if (e.ctrlKey || e.metaKey || e.altKey || (typing && e.key === " ") || e.target.matches("select")) return;
    const step = e.shiftKey ? 10 : 1, pressed = e.key.length > 1 ? e.key : e.key.toLowerCase();
    const actions = {
      " ": () => this.toggle(), ArrowRight: () => this.seek(this.frame + step), ArrowLeft: () => this.seek(this.frame - step),
      Home: () => this.seek(0), End: () => this.seek(this.run.frames - 1), "]": () => this.jumpStage(1), "[": () => this.jumpStage(-1),
    };
    const turn = e.shiftKey ? 0.4 : 0.1, view = this.viewer;
    if (view) Object.assign(actions, {
      a: () => view.orbit(-turn, 0), d: () => view.orbit(turn, 0), w: () => view.orbit(0, turn), s: () => view.orbit(0, -turn),
      "+": () => view.zoom(0.9), "=": () => view.zoom(0.9), "-": () => view.zoom(1 / 0.9), 0: () => view.home(),
    });
    if (!actions[pressed]) return;
    e.preventDefault();
    if (pressed.length > 1 || pressed === "[" || pressed === "]") this.pause();
    actions[pressed]();
  }
}

function wireOptions(viewer, run) {
  const legends = {
    displacement: ["0", () => `${(1e3 * viewer.reach).toFixed(0)} mm since the stage began`],
    height: ["table", () => `${(1e3 * (run.low[1] + run.size[1] - run.table)).toFixed(0)} mm`],
    distance: ["on the target", () => `${(1e3 * viewer.reach).toFixed(0)} mm away`],
  };
  const recolor = () => {
    viewer.mode = $("color").selectedIndex;
    const [from, to] = legends[$("color").value] || [];
    $("legend").replaceChildren(...(from ? [from, node("i"), to()] : []));
    viewer.invalidate();
  };
  $("color").addEventListener("change", recolor);
  $("show-reachable").disabled = !run.reachable.frames.length;
  for (const what of ["tool", "target", "subgoal", "initial", "reachable"]) {
    $(`show-${what}`).addEventListener("change", (e) => { viewer.shown[what] = e.target.checked; viewer.invalidate(); });
  }
  $("style").addEventListener("change", (e) => { viewer.style = e.target.value; viewer.invalidate(); });
  $("home").addEventListener("click", () => viewer.home());
  recolor();
}

// report.html#frame=40&color=distance&show=target opens at that view.
function openAsAddressed(player) {
  const wanted = new URLSearchParams(location.hash.slice(1));
  const choose = (id, value) => { $(id).value = value; $(id).dispatchEvent(new Event("change")); };
  if (player.viewer && [...$("color").options].some((o) => o.value === wanted.get("color"))) choose("color", wanted.get("color"));
  if (player.viewer && wanted.get("as") === "particles") choose("style", "particles");
  for (const what of (wanted.get("show") || "").split(",")) {
    const box = $(`show-${what}`);
    if (box && !box.checked) box.click();
  }
  player.seek(Number(wanted.get("frame")) || 0);
}

async function main() {
  const run = JSON.parse($("data").textContent);
  fillHeader(run);
  fillParameters(run);
  let viewer = null;
  try {
    viewer = new Viewer($("view"), run, unpack(await inflate($("frames").textContent), run));
    $("notice").textContent = "";
    wireOptions(viewer, run);
  } catch (error) {
    $("notice").textContent = `The run cannot be shown here: ${error.message}. The plots below still work.`;
  }
  openAsAddressed(new Player(run, viewer));
}

main();
