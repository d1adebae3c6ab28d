// One scene with its camera: the motion of an episode, or an inset beside it.
import { PerspectiveCamera, Quaternion, Scene, Vector3 } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Rows } from "./payload.js";
import { ArrowShape, Light, floor, part } from "./props.js";
import { TraceLine } from "./trace.js";

const SHORTEST = 14; // pixels; a shorter arrow has no label
const radians = (degrees) => (degrees * Math.PI) / 180;

export class Stage {
  // element: where it is seen; shapes: geometries by number; array: reader of references;
  // detail: pixels of the shadow map; cover: an element over a part of it, if there is one
  constructor(element, data, shapes, array, detail, cover) {
    this.element = element;
    this.cover = cover;
    this.times = array(data.times);
    this.look = data.camera;
    this.scene = new Scene();
    this.parts = new Map();
    this.camera = new PerspectiveCamera(this.look.fov, 1, 0.02 * this.look.distance,
      60 * this.look.distance);
    this.camera.up.set(0, 0, 1);
    this.light = new Light(1.1 * this.look.distance, data.floor !== null, detail);
    this.light.addTo(this.scene);
    if (data.floor) this.scene.add(floor(data.floor));
    for (const item of data.parts) this.addPart(item, shapes, array);
    this.arrows = data.arrows.map((item) => this.addArrow(item, array));
    this.traces = data.traces.map((item) => {
      const line = new TraceLine(item, array(item.points));
      (item.part === null ? this.scene : this.parts.get(item.part).object).add(line.object);
      return line;
    });
    this.followed = new Vector3();
    this.controls = new OrbitControls(this.camera, element);
    this.resetCamera();
  }

  addPart(item, shapes, array) {
    const object = part(item, shapes[item.mesh]);
    this.scene.add(object);
    const rows = {};
    for (const [key, width] of [["position", 3], ["q", 4], ["scale", 3]]) {
      rows[key] = new Rows(array(item[key]), width);
    }
    this.parts.set(item.name, { object, ...rows });
  }

  addArrow(item, array) {
    const shape = new ArrowShape(item);
    this.scene.add(shape.object);
    const label = document.createElement("span");
    label.className = item.label.length > 2 ? "arrow-label word" : "arrow-label";
    label.textContent = item.label;
    label.style.color = `rgb(${item.color.map((x) => Math.round(200 * x)).join(",")})`;
    this.element.append(label);
    const rows = (ref) => new Rows(array(ref), 3);
    return { shape, label, start: rows(item.start), vector: rows(item.vector), tip: new Vector3() };
  }

  resetCamera() {
    const { target, azimuth, elevation, distance } = this.look;
    const level = Math.cos(radians(elevation));
    this.controls.target.set(...target).add(this.followed);
    this.camera.position
      .set(level * Math.cos(radians(azimuth)), level * Math.sin(radians(azimuth)),
        Math.sin(radians(elevation)))
      .multiplyScalar(distance)
      .add(this.controls.target);
    this.controls.update();
  }

  // Look from where another stage looks from, each at its own target.
  lookAs(other) {
    const offset = other.camera.position.clone().sub(other.controls.target);
    const shift = other.controls.target.clone().sub(other.followed);
    this.controls.target.copy(shift).add(this.followed);
    this.camera.position.copy(this.controls.target).add(offset);
    this.camera.lookAt(this.controls.target);
  }

  // The frame before a time, and how far the time is on the way to the next one.
  place(time) {
    const times = this.times;
    let low = 0;
    let high = times.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    if (time >= times[high]) return [high, 0];
    return [low, Math.max(0, (time - times[low]) / (times[high] - times[low]))];
  }

  show(time) {
    const [frame, share] = this.place(time);
    for (const item of this.parts.values()) pose(item, frame, share);
    for (const arrow of this.arrows) point(arrow, frame, share);
    for (const trace of this.traces) trace.show(frame);
    this.follow();
    this.light.aim(this.controls.target);
  }

  follow() {
    const item = this.look.follow === null ? undefined : this.parts.get(this.look.follow);
    if (!item || !item.object.visible) return;
    const { x, y } = item.object.position;
    const moved = new Vector3(x, y, 0).sub(this.followed);
    this.followed.add(moved);
    this.controls.target.add(moved);
    this.camera.position.add(moved);
  }

  render(renderer, bounds) {
    const box = this.element.getBoundingClientRect();
    const { width, height } = box;
    if (!width || !height) return;
    const aspect = width / height;
    const narrow = Math.min(1, aspect); // a narrow picture shows as much from side to side
    this.camera.aspect = aspect;
    this.camera.fov = (2 * Math.atan(Math.tan(radians(this.look.fov) / 2) / narrow) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    const place = [box.left - bounds.left, bounds.bottom - box.bottom, width, height];
    renderer.setViewport(...place);
    renderer.setScissor(...place);
    renderer.render(this.scene, this.camera);
    const cover = this.cover?.getBoundingClientRect();
    const edges = cover?.height ? [cover.left - box.left, cover.top - box.top] : [width, height];
    for (const arrow of this.arrows) this.placeLabel(arrow, width, height, edges);
  }

  // A label stays inside, and is hidden where a cover in the lower right corner begins.
  placeLabel({ shape, label, tip }, width, height, [right, bottom]) {
    label.hidden = !shape.object.visible;
    if (label.hidden) return;
    const seen = tip.clone().project(this.camera);
    const foot = shape.object.position.clone().project(this.camera);
    const size = Math.hypot((seen.x - foot.x) * width, (seen.y - foot.y) * height) / 2;
    label.hidden = size < SHORTEST;
    const room = 6 + 8 * label.textContent.length; // pixels, of the letters to the right
    const x = Math.min(Math.max((0.5 + 0.5 * seen.x) * width, 12), width - 6 - room);
    const y = Math.min(Math.max((0.5 - 0.5 * seen.y) * height, 18), height - 12);
    label.hidden ||= x + 5 + room > right && y > bottom;
    label.style.transform = `translate(${x + 5}px, ${y - 18}px)`;
  }
}

const one = new Float64Array(4);
const other = new Float64Array(4);

function between(rows, frame, share) {
  rows.copy(frame, one);
  if (!share || rows.constant) return one;
  rows.copy(frame + 1, other);
  for (let k = 0; k < rows.width; k++) {
    if (Number.isFinite(other[k])) one[k] += share * (other[k] - one[k]);
  }
  return one;
}

function pose({ object, position, q, scale }, frame, share) {
  object.position.fromArray(between(position, frame, share));
  object.visible = Number.isFinite(object.position.x);
  if (!object.visible) return;
  object.scale.fromArray(between(scale, frame, share));
  const [w, x, y, z] = q.copy(frame, one);
  object.quaternion.set(x, y, z, w);
  if (share && !q.constant) {
    const [w1, x1, y1, z1] = q.copy(frame + 1, other);
    if (Number.isFinite(w1)) object.quaternion.slerp(new Quaternion(x1, y1, z1, w1), share);
  }
}

function point({ shape, start, vector, tip }, frame, share) {
  const from = new Vector3().fromArray(between(start, frame, share));
  const along = new Vector3().fromArray(between(vector, frame, share));
  shape.object.visible = Number.isFinite(from.x + along.x);
  if (!shape.object.visible) return;
  shape.point(from, along);
  tip.copy(from).add(along);
}
