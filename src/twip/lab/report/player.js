// Ties slider, plots and robot to one time.

(async () => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const samples = await readSamples(data.samples, document.getElementById("samples").textContent);
  const get = id => document.getElementById(id);
  const filled = samples.times.filter(times => times.count);
  const from = Math.min(...filled.map(t => t.start)), end = Math.max(...filled.map(t => t.end));
  const to = end > from ? end : from + 1e-3;
  const plots = new Plots(data.panels, samples, from, to);
  const robots = data.robots.length ? new Robots(data.robots, samples) : null;
  const [slider, clock, play, cursor, pointer] = ["slider", "clock", "play", "cursor", "pointer"].map(get);
  let time = data.begin ?? from, hovered = null, playing = false, last = 0;
  slider.min = from;
  slider.max = to;

  function show() {
    slider.value = time;
    clock.textContent = `${time.toFixed(3)} s`;
    plots.mark(cursor, time);
    if (hovered !== null) plots.mark(pointer, hovered); else pointer.hidden = true;
    plots.tell(hovered ?? time);
    robots?.show(time);
  }
  function go(wanted) { time = Math.max(from, Math.min(to, wanted)); show(); }
  function set(on) {
    playing = on;
    play.textContent = on ? "❚❚" : "▶";
    play.setAttribute("aria-label", on ? "pause" : "play");
    if (!on) return;
    if (time >= to) time = from;
    last = performance.now();
    requestAnimationFrame(frame);
  }
  function frame(now) {
    if (!playing) return;
    go(time + Math.max(0, now - last) / 1000 * Number(get("speed").value));
    last = now;
    if (time >= to) set(false); else requestAnimationFrame(frame);
  }

  play.onclick = () => set(!playing);
  slider.oninput = () => go(Number(slider.value));
  document.addEventListener("keydown", event => {
    if (["SELECT", "BUTTON"].includes(event.target.tagName) && event.key === " ") return;
    const steps = {ArrowLeft: -1, ArrowRight: 1};
    if (event.key === " ") set(!playing);
    else if (event.key in steps) go(time + steps[event.key] * (plots.range.end - plots.range.start) / 200);
    else return;
    event.preventDefault();
  });
  let pressed = null;
  plots.box.addEventListener("pointerdown", event => { pressed = event.clientX; }, true);
  plots.box.addEventListener("click", event => {
    if (event.target.closest(".head") || pressed === null || Math.abs(event.clientX - pressed) > 3) return;
    go(plots.time(event.clientX));
  });
  plots.box.addEventListener("dblclick", () => plots.zoom(from, to));
  plots.box.addEventListener("pointermove", event => {
    const at = plots.time(event.clientX);
    hovered = at >= plots.range.start && at <= plots.range.end && !event.target.closest(".head") ? at : null;
    show();
  });
  plots.box.addEventListener("pointerleave", () => { hovered = null; show(); });
  if (data.robots.length > 1) {
    get("apart").hidden = false;
    get("apart").firstChild.onchange = event => robots.stand(event.target.checked);
  }
  plots.moved = show;
  await plots.show();
  show();
  window.report = {plots, samples, go, get time() { return time; }};
  document.body.dataset.ready = "true";
})();
