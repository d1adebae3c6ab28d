// A replay: poses, vectors, points and plots that were computed before, shown in step.
import { Clock } from "./clock.js";
import { Panels, element } from "./panels.js";
import { readPayload } from "./payload.js";
import { Plot } from "./plots.js";
import { addTransport } from "./transport.js";

function addFacts(payload) {
  document.title = `${payload.title}: replay`;
  document.getElementById("title").textContent = payload.title;
  document.getElementById("subtitle").textContent = payload.subtitle;
  const list = document.getElementById("facts");
  for (const [name, text] of payload.facts) {
    element("dt", "", list).textContent = name;
    element("dd", "", list).textContent = text;
  }
}

function makePlots(payload, array, clock) {
  const labels = payload.episodes.map((episode) => episode.label);
  const section = document.getElementById("plots");
  return payload.plots.map((data) => {
    const episodes = data.episodes.map((item) => item && {
      x: array(item.x),
      end: item.end,
      times: item.times && array(item.times),
      lines: item.lines.map(array),
    });
    return new Plot(section, { ...data, episodes }, clock, labels);
  });
}

async function begin() {
  const { payload, array } = await readPayload(document.getElementById("replay"));
  addFacts(payload);
  const all = payload.episodes.map((episode) => array(episode.times));
  const longest = all.reduce((a, b) => (b[b.length - 1] > a[a.length - 1] ? b : a));
  const clock = new Clock(longest[longest.length - 1], [...longest]);
  const section = document.getElementById("stages");
  const panels = new Panels(section, document.getElementById("canvas"), payload, array);
  const plots = makePlots(payload, array, clock);
  addTransport(clock, panels);
  clock.listeners.push(() => {
    panels.show(clock.time);
    for (const plot of plots) plot.draw();
  });
  const layout = () => {
    panels.resize();
    for (const plot of plots) plot.layout();
  };
  new ResizeObserver(layout).observe(section);
  window.addEventListener("resize", layout);
  layout();
  clock.seek(0);
  if (location.hash === "#play") clock.play(); // as a page asks for that shows it in a frame
  let last = performance.now();
  const tick = (now) => {
    clock.advance(Math.min(now - last, 400) / 1000); // after a pause it does not jump
    last = now;
    panels.render();
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
  // for programs: what is plotted, and where the time is
  window.rigidReplay = { clock, panels, plots, payload };
}

begin().catch((error) => {
  const failure = document.getElementById("failure");
  failure.hidden = false;
  failure.textContent = `This replay cannot be shown: ${error.message}`;
  throw error;
});
