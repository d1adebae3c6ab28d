// The stages of a page: one for each episode, with insets, on one canvas.
import { PCFShadowMap, WebGLRenderer } from "three";
import { geometry } from "./props.js";
import { lineSample } from "./scales.js";
import { Stage } from "./stage.js";

export class Panels {
  constructor(section, canvas, payload, array) {
    this.section = section;
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    const shapes = payload.meshes.map((mesh) => geometry(mesh, array));
    this.main = [];
    this.insets = [];
    this.texts = [];
    section.dataset.count = payload.episodes.length;
    const several = payload.episodes.length > 1;
    for (const episode of payload.episodes) this.add(episode, several, shapes, array);
    this.stages = [...this.main, ...this.insets.flat()];
    this.link(this.main);
    const most = Math.max(...this.insets.map((insets) => insets.length));
    for (let k = 0; k < most; k++) this.link(this.insets.map((insets) => insets[k]).filter(Boolean));
    this.dirty = true;
  }

  add(episode, several, shapes, array) {
    const panel = element("div", "panel", this.section);
    const view = element("div", "view", panel);
    const head = element("div", "head", panel);
    element("strong", "", head).textContent = episode.label;
    if (several) element("i", "", head).style.background = lineSample(this.main.length, "#66707e");
    element("span", `badge ${episode.success ? "good" : ""}`, head).textContent = episode.result;
    const text = element("div", "text", panel);
    this.texts.push({ node: text, lines: episode.text, times: array(episode.times), shown: -1 });
    const reset = element("button", "reset", panel);
    reset.textContent = "\u2302";
    reset.title = "First point of view (R)";
    reset.addEventListener("click", () => this.resetCameras());
    const tray = element("div", "insets", panel);
    this.main.push(new Stage(view, episode.stage, shapes, array, several ? 1024 : 2048, tray));
    this.insets.push(episode.insets.map((inset) => {
      const box = element("div", "inset", tray);
      element("span", "name", box).textContent = inset.title;
      return new Stage(element("div", "view", box), inset.stage, shapes, array, 512);
    }));
  }

  // Stages of a kind are looked at from the same side.
  link(stages) {
    for (const stage of stages) {
      stage.controls.addEventListener("change", () => {
        for (const other of stages) if (other !== stage) other.lookAs(stage);
        this.dirty = true;
      });
    }
  }

  resetCameras() {
    for (const stage of this.stages) stage.resetCamera();
    this.dirty = true;
  }

  show(time) {
    for (const stage of this.stages) stage.show(time);
    for (const text of this.texts) showText(text, time);
    this.dirty = true;
  }

  resize() {
    const { clientWidth, clientHeight } = this.section;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.dirty = true;
  }

  render() {
    if (!this.dirty) return;
    this.dirty = false;
    const bounds = this.canvas.getBoundingClientRect();
    this.renderer.setScissorTest(true);
    for (const stage of this.stages) stage.render(this.renderer, bounds);
  }
}

function showText(text, time) {
  let step = text.times.findIndex((t) => t > time + 1e-9);
  step = (step < 0 ? text.times.length : step) - 1;
  if (step === text.shown) return;
  text.shown = step;
  text.node.textContent = text.lines[Math.max(step, 0)].join("\n");
}

export function element(kind, className, parent) {
  const node = document.createElement(kind);
  if (className) node.className = className;
  parent.append(node);
  return node;
}
