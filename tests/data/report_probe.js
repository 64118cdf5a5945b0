// Works the page like a reader, and posts what it saw to the test; see ../report_browser.rs.
window.errors = [];
addEventListener("error", (e) => errors.push(e.message));
addEventListener("unhandledrejection", (e) => errors.push(String(e.reason)));
const frame = () => new Promise((next) => requestAnimationFrame(next));
// A number for what the canvas shows; to be called in the animation frame that has drawn it.
function pixels() {
  const canvas = $("view"), gl = canvas.getContext("webgl2"), all = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, all);
  let hash = 7;
  for (let i = 0; i < all.length; i++) hash = (Math.imul(hash, 31) + all[i]) >>> 0;
  return hash;
}
async function shown(change) { change(); await frame(); return pixels(); }
const scrub = (f) => () => { $("frame").value = f; $("frame").dispatchEvent(new Event("input", {bubbles: true})); };
const press = (key) => () => document.body.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));
const choose = (id, value) => () => { $(id).value = value; $(id).dispatchEvent(new Event("change")); };
const cursor = () => Number(document.querySelector("#plot-emd .cursor").getAttribute("x1"));
async function probe() {
  const seen = {};
  try {
    while (!document.body.dataset.frame) await frame();
    await frame();
    seen.notice = $("notice").textContent;
    // Particles are quicker to draw without a graphics card.
    await shown(choose("style", "particles"));
    seen.start = await shown(scrub(0));
    seen.cursorAtStart = cursor();
    seen.middle = await shown(scrub(30));
    seen.cursorInTheMiddle = cursor();
    seen.said = $("frame").getAttribute("aria-valuetext");
    seen.now = $("now").textContent;
    seen.back = await shown(scrub(0));
    seen.key = await shown(press("ArrowRight"));
    seen.frame = document.body.dataset.frame;
    await shown(scrub(30));
    for (const what of ["target", "subgoal", "initial", "reachable", "tool"]) {
      seen[what] = await shown(() => $(`show-${what}`).click());
      await shown(() => $(`show-${what}`).click());
    }
    for (const color of ["displacement", "height", "distance"]) seen[color] = await shown(choose("color", color));
    await shown(choose("color", "piece"));
    seen.body = await shown(choose("style", "body"));
    await shown(choose("style", "particles"));
    seen.turned = await shown(press("a"));
    seen.home = await shown(() => $("home").click());
    seen.stageRows = document.querySelectorAll("#stages tbody tr").length;
    seen.plots = [...document.querySelectorAll(".plot svg")].map((plot) => plot.getAttribute("aria-label"));
    choose("speed", "5")();
    $("play").click();
    for (let i = 0; i < 30; i++) await frame();
    seen.played = Number(document.body.dataset.frame);
    press(" ")();
    seen.paused = $("play").getAttribute("aria-label");
    seen.unnamed = [...document.querySelectorAll("button, input, select")]
      .filter((e) => !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label"))).map((e) => e.id);
  } catch (error) { errors.push(String(error)); }
  seen.errors = errors;
  await fetch(here, {method: "POST", mode: "no-cors", body: JSON.stringify(seen)});
}
probe();
