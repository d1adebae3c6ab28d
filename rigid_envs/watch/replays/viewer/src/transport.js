// Play, pause, scrub and speed, by mouse, touch and keys.
import { SPEEDS } from "./clock.js";

const PLAY = '<svg viewBox="0 0 24 24"><path d="M8 5v14l11-7z"/></svg>';
const PAUSE = '<svg viewBox="0 0 24 24"><path d="M7 5h4v14H7zM13 5h4v14h-4z"/></svg>';

export function addTransport(clock, panels) {
  const [play, label, scrub, speed, loop] =
    ["play", "clock", "scrub", "speed", "loop"].map((id) => document.getElementById(id));
  for (const value of SPEEDS) speed.append(new Option(`${value}\u00d7`, value));
  play.addEventListener("click", () => { clock.play(); play.blur(); });
  loop.addEventListener("click", () => { clock.loop = !clock.loop; clock.changed(); });
  speed.addEventListener("change", () => { clock.setSpeed(Number(speed.value)); speed.blur(); });
  scrub.max = clock.duration;
  scrub.addEventListener("input", () => clock.seek(Number(scrub.value)));
  let shown = null;
  clock.listeners.push(() => {
    if (shown !== clock.playing) play.innerHTML = (shown = clock.playing) ? PAUSE : PLAY;
    play.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    scrub.value = clock.time;
    scrub.style.setProperty("--done", `${(100 * clock.time) / (clock.duration || 1)}%`);
    label.textContent = `${clock.time.toFixed(2)} / ${clock.duration.toFixed(2)} s`;
    speed.value = clock.speed;
    loop.setAttribute("aria-pressed", clock.loop);
  });
  const keys = {
    " ": () => clock.play(),
    ArrowRight: (event) => clock.step(event.shiftKey ? 10 : 1),
    ArrowLeft: (event) => clock.step(event.shiftKey ? -10 : -1),
    ArrowUp: () => clock.setSpeed(neighbour(clock.speed, 1)),
    ArrowDown: () => clock.setSpeed(neighbour(clock.speed, -1)),
    Home: () => clock.seek(0),
    End: () => clock.seek(clock.duration),
    r: () => panels.resetCameras(),
    l: () => loop.click(),
  };
  document.addEventListener("keydown", (event) => {
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act(event);
  });
}

function neighbour(speed, by) {
  const at = SPEEDS.indexOf(speed) + by;
  return SPEEDS[Math.min(Math.max(at, 0), SPEEDS.length - 1)];
}
