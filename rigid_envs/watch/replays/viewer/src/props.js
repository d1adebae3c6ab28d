// What a scene is made of: parts, arrows, floor and light, as three.js objects.
import {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DataTexture,
  DirectionalLight, Group, HemisphereLight, LinearFilter, LinearMipmapLinearFilter, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, NearestFilter, PlaneGeometry, RepeatWrapping,
  ShadowMaterial, SRGBColorSpace, Vector3,
} from "three";

const HEAD = 3; // length and width of the head of an arrow, in widths of its shaft
const TO_SUN = [0.35, -0.45, 1];
const UP = new Vector3(0, 0, 1);

export function geometry(data, array) {
  const made = new BufferGeometry();
  const colors = array(data.colors);
  const linear = new Float32Array(colors.length);
  const color = new Color();
  for (let k = 0; k < colors.length; k += 3) {
    color.setRGB(colors[k] / 255, colors[k + 1] / 255, colors[k + 2] / 255, SRGBColorSpace);
    color.toArray(linear, k);
  }
  made.setAttribute("position", new BufferAttribute(array(data.vertices), 3));
  made.setAttribute("normal", new BufferAttribute(array(data.normals), 3));
  made.setAttribute("color", new BufferAttribute(linear, 3));
  made.setIndex(new BufferAttribute(array(data.triangles), 1));
  return made;
}

export function part(data, shape) {
  const ghost = data.opacity < 1;
  const material = new MeshStandardMaterial({
    vertexColors: true,
    roughness: data.shiny ? 0.42 : 0.9,
    transparent: ghost,
    opacity: data.opacity,
    depthWrite: !ghost,
  });
  const made = new Mesh(shape, material);
  made.castShadow = data.shadow && !ghost;
  made.receiveShadow = !ghost;
  made.renderOrder = ghost ? 2 : 0;
  return made;
}

export function sRGB(color) {
  return new Color().setRGB(...color, SRGBColorSpace);
}

export class ArrowShape {
  constructor(data) {
    const material = new MeshStandardMaterial({ color: sRGB(data.color), roughness: 0.5 });
    const shaft = new CylinderGeometry(0.5, 0.5, 1, 20).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    const head = new ConeGeometry(0.5, 1, 24).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    this.width = data.width;
    this.shaft = new Mesh(shaft, material);
    this.head = new Mesh(head, material);
    this.object = new Group();
    for (const mesh of [this.shaft, this.head]) {
      mesh.castShadow = true;
      mesh.frustumCulled = false;
      this.object.add(mesh);
    }
  }

  // start, direction: vectors of three.js; direction is the whole arrow
  point(start, direction) {
    const length = direction.length();
    this.object.visible = length > 1e-9;
    if (!this.object.visible) return;
    const tip = Math.min(HEAD * this.width, length);
    const size = this.width * Math.min(1, length / (HEAD * this.width));
    this.object.position.copy(start);
    this.object.quaternion.setFromUnitVectors(UP, direction.clone().normalize());
    this.shaft.scale.set(size, size, Math.max(length - tip, 1e-6));
    this.head.scale.set(size * HEAD, size * HEAD, tip);
    this.head.position.z = length - tip;
  }
}

export function floor(data) {
  const cells = Math.max(2, 2 * Math.round((0.5 * data.size) / data.cell));
  const size = cells * data.cell;
  const [a, b] = data.colors.map((color) => [...color.map((x) => Math.round(255 * x)), 255]);
  const chequers = new DataTexture(new Uint8Array([...a, ...b, ...b, ...a]), 2, 2);
  chequers.colorSpace = SRGBColorSpace;
  chequers.wrapS = chequers.wrapT = RepeatWrapping;
  chequers.repeat.set(cells / 2, cells / 2);
  chequers.magFilter = NearestFilter;
  chequers.minFilter = LinearMipmapLinearFilter;
  chequers.generateMipmaps = true;
  chequers.anisotropy = 8;
  chequers.needsUpdate = true;
  const shape = new PlaneGeometry(size, size);
  const fade = fading();
  const ground = new Mesh(
    shape, new MeshBasicMaterial({ map: chequers, alphaMap: fade, transparent: true }));
  const shade = new Mesh(
    shape, new ShadowMaterial({ color: 0x1b2536, opacity: 0.3, depthWrite: false }));
  shade.receiveShadow = true;
  shade.position.z = 1e-4 * size;
  ground.renderOrder = -2;
  shade.renderOrder = -1;
  const made = new Group();
  made.add(ground, shade);
  made.position.z = data.height;
  return made;
}

// Opacity of the floor: towards its edge it turns into the background.
function fading(n = 128) {
  const values = new Uint8Array(4 * n * n);
  for (let k = 0; k < n * n; k++) {
    const x = ((k % n) + 0.5) / n - 0.5;
    const y = (Math.floor(k / n) + 0.5) / n - 0.5;
    values.fill(255 * Math.max(0, 1 - 4 * (x * x + y * y)), 4 * k, 4 * k + 4);
  }
  const texture = new DataTexture(values, n, n);
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

export class Light {
  constructor(reach, shadows, detail) {
    this.sky = new HemisphereLight(0xffffff, 0xc4cad4, 1.8);
    this.sky.position.set(0, 0, 1);
    this.sun = new DirectionalLight(0xfffaf2, 1.8);
    this.reach = reach;
    this.sun.castShadow = shadows;
    const shadow = this.sun.shadow;
    shadow.mapSize.set(detail, detail);
    Object.assign(shadow.camera, {
      left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * reach, far: 6 * reach,
    });
    shadow.normalBias = 0.01 * reach;
    shadow.radius = 3;
  }

  addTo(scene) {
    scene.add(this.sky, this.sun, this.sun.target);
  }

  aim(target) {
    this.sun.target.position.copy(target);
    this.sun.position.set(...TO_SUN).normalize().multiplyScalar(3 * this.reach).add(target);
  }
}
