// Path of a point: a line in the world or on a part, which grows with time.
import { Group } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";

export class TraceLine {
  // points: x, y, z of every frame; a point that is not finite interrupts the line
  constructor(data, points) {
    const [pairs, until] = segments(points);
    this.until = until;
    this.pairs = pairs;
    this.length = data.length;
    this.whole = data.whole;
    this.object = new Group();
    const total = pairs.length / 6;
    if (!total) return;
    const shown = this.length ? Math.min(this.length, total) : total;
    this.geometry = new LineSegmentsGeometry();
    this.geometry.setPositions(pairs.slice(0, 6 * shown));
    const color = `rgb(${data.color.map((part) => Math.round(255 * part)).join(",")})`;
    const material = new LineMaterial({ color, linewidth: data.width, worldUnits: true });
    const line = new LineSegments2(this.geometry, material);
    line.frustumCulled = false;
    this.object.add(line);
  }

  show(frame) {
    if (!this.geometry || this.whole) return;
    const last = this.until[frame];
    if (!this.length) {
      this.geometry.instanceCount = last;
      return;
    }
    const first = this.until[Math.max(0, frame - this.length + 1)];
    const buffer = this.geometry.attributes.instanceStart.data;
    buffer.array.set(this.pairs.subarray(6 * first, 6 * last));
    buffer.needsUpdate = true;
    this.geometry.instanceCount = last - first;
  }
}

// Segments between neighbouring points, and for each frame how many end there or before.
function segments(points) {
  const count = points.length / 3;
  const pairs = new Float32Array(6 * Math.max(count - 1, 0));
  const until = new Uint32Array(count);
  let n = 0;
  for (let k = 1; k < count; k++) {
    const pair = points.subarray(3 * k - 3, 3 * k + 3);
    const moved = pair[0] !== pair[3] || pair[1] !== pair[4] || pair[2] !== pair[5];
    if (moved && pair.every(Number.isFinite)) pairs.set(pair, 6 * n++);
    until[k] = n;
  }
  return [pairs.slice(0, 6 * n), until];
}
