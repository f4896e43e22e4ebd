// viewer.js: animated glTFs side by side under one camera. Bundled with what it needs of three.js.
import {
  Box3, BufferGeometry, CanvasTexture, Color, DirectionalLight, DoubleSide, Float32BufferAttribute, HemisphereLight, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const surfaceColors = { mechanical: 0xe0a063, geometric: 0x7fb2e0 };

// The last key at or before the time; the first one before all of them.
function keyAt(times, time) {
  let low = 0, high = times.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  return low;
}

// A stretch of frames of one connectivity: shown where its scale is not 0. three.js would draw a mesh of scale 0, at full cost.
class Piece {
  constructor(mesh, wires) {
    Object.assign(this, { mesh, wires, scale: null, weights: null, still: mesh.scale.x !== 0 });
    mesh.scale.set(1, 1, 1);
    mesh.frustumCulled = false; // its morph targets leave its bounds
  }

  setTrack(property, track) {
    if (property === 'scale') this.scale = track;
    else this.weights = track.createInterpolant();
  }

  isShownAt(time) {
    if (time < 0) return false; // frames that were skipped at the beginning
    return this.scale ? this.scale.values[3 * keyAt(this.scale.times, time)] !== 0 : this.still;
  }

  show(time, withWires) {
    this.mesh.visible = this.isShownAt(time);
    if (!this.mesh.visible) return 0;
    if (this.weights) this.mesh.morphTargetInfluences.splice(0, Infinity, ...this.weights.evaluate(time));
    if (withWires && !this.edges) this.addEdges();
    if (this.edges) this.edges.visible = withWires;
    return this.mesh.geometry.index.count / 3;
  }

  addEdges() {
    this.edges = new Mesh(this.mesh.geometry, this.wires);
    this.edges.morphTargetInfluences = this.mesh.morphTargetInfluences;
    this.edges.frustumCulled = false;
    this.mesh.add(this.edges);
  }
}

// Rings, seen through the surface.
function makeMarks() {
  const canvas = document.createElement('canvas'), size = canvas.width = canvas.height = 64, pen = canvas.getContext('2d');
  for (const [width, color] of [[15, '#000000a0'], [8, '#fff34d']]) {
    pen.beginPath();
    pen.arc(size / 2, size / 2, 22, 0, 2 * Math.PI);
    pen.lineWidth = width;
    pen.strokeStyle = color;
    pen.stroke();
  }
  const material = new PointsMaterial({ map: new CanvasTexture(canvas), size: 22, sizeAttenuation: false, transparent: true, depthTest: false });
  const marks = new Points(new BufferGeometry(), material);
  marks.frustumCulled = false;
  marks.renderOrder = 1;
  marks.visible = false;
  return marks;
}

// One glTF in a scene of its own.
class Pane {
  constructor(kind, gltf, light) {
    const color = new Color(surfaceColors[kind]);
    const surface = new MeshStandardMaterial({ color, roughness: 0.55, metalness: 0, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    const wires = new MeshBasicMaterial({ color: color.clone().multiplyScalar(0.1), wireframe: true, transparent: true, opacity: 0.5 });
    const byName = new Map();
    this.kind = kind;
    this.scene = new Scene();
    this.bounds = new Box3();
    this.marks = makeMarks();
    gltf.scene.traverse(o => { if (o.isMesh) byName.set(o.name, new Piece(o, wires)); });
    for (const track of gltf.animations[0]?.tracks ?? []) {
      const dot = track.name.lastIndexOf('.');
      byName.get(track.name.slice(0, dot))?.setTrack(track.name.slice(dot + 1), track);
    }
    this.pieces = [...byName.values()];
    gltf.scene.updateMatrixWorld(true); // places may be whole numbers on a grid that a parent spans
    for (const { mesh } of this.pieces) {
      mesh.material = surface;
      const places = new Box3().setFromBufferAttribute(mesh.geometry.attributes.position); // its own box holds targets, by far
      this.bounds.union(places.applyMatrix4(mesh.matrixWorld));
    }
    this.scene.add(gltf.scene, this.marks, new HemisphereLight(0xffffff, 0x59544e, 1.3), light);
  }

  show(time, withWires) { return this.pieces.reduce((triangles, piece) => triangles + piece.show(time, withWires), 0); }
}

class Viewer {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setScissorTest(true);
    this.camera = new PerspectiveCamera(35, 1, 0.01, 100);
    this.panes = [];
    this.kinds = [];
    this.time = 0;
    this.wireframe = false;
    this.asked = false;
    new ResizeObserver(() => this.ask()).observe(canvas);
  }

  async add(kind, bytes) {
    const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, '');
    const light = new DirectionalLight(0xffffff, 2.1);
    this.panes.push(new Pane(kind, gltf, light));
    this.kinds.push(kind);
  }

  get shownPanes() { return this.panes.filter(p => this.kinds.includes(p.kind)); }

  // Looks at all of it from a little above; `up`: 'y' or 'z'.
  fit(up) {
    const bounds = this.panes.reduce((box, pane) => box.union(pane.bounds), new Box3());
    const center = bounds.getCenter(new Vector3()), radius = Math.max(1e-12, bounds.getSize(new Vector3()).length() / 2);
    const from = up === 'z' ? new Vector3(0.35, -1, 0.38) : new Vector3(0.35, 0.38, 1);
    this.camera.up.set(0, up === 'y' ? 1 : 0, up === 'z' ? 1 : 0);
    this.camera.position.copy(center).add(from);
    this.camera.lookAt(center);
    this.camera.position.copy(center).addScaledVector(from.normalize(), this.distanceToHold(bounds, center));
    Object.assign(this.camera, { near: radius / 200, far: radius * 40 });
    this.controls?.dispose(); // it takes `up` when it is made
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.target.copy(center);
    this.controls.update();
    this.controls.addEventListener('change', () => this.ask());
    this.ask();
  }

  // How far from the center the camera, turned as it is, sees all corners of the box.
  distanceToHold(bounds, center) {
    const { clientWidth: width, clientHeight: height } = this.canvas, back = this.camera.quaternion.clone().invert();
    const tall = Math.tan(this.camera.fov * Math.PI / 360), wide = tall * width / height / Math.max(1, this.shownPanes.length);
    let distance = 0;
    for (let i = 0; i < 8; i++) {
      const corner = new Vector3(...['x', 'y', 'z'].map((axis, a) => bounds[i >> a & 1 ? 'max' : 'min'][axis]));
      corner.sub(center).applyQuaternion(back);
      distance = Math.max(distance, corner.z + 1.06 * Math.max(Math.abs(corner.x) / wide, Math.abs(corner.y) / tall));
    }
    return distance;
  }

  // Seconds; returns the triangles of each mesh at that time.
  show(time) {
    this.time = time;
    this.ask();
    return Object.fromEntries(this.panes.map(p => [p.kind, p.show(time, this.wireframe)]));
  }

  // Marks places, as a list of [x, y, z].
  mark(places) {
    for (const { marks } of this.panes) {
      marks.geometry.setAttribute('position', new Float32BufferAttribute(places.flat(), 3));
      marks.visible = places.length > 0;
    }
    this.ask();
  }

  // Draws once, soon, however often it was asked to.
  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas, panes = this.shownPanes;
    if (!width || !panes.length || !this.controls) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.renderer.setScissor(0, 0, width, height);
    panes.forEach((pane, i) => this.drawPane(pane, Math.round(i * width / panes.length), 0, Math.floor(width / panes.length), height));
  }

  drawPane(pane, x, y, width, height) {
    const light = pane.scene.children.find(o => o.isDirectionalLight);
    light.position.set(-0.6, 0.9, 1).applyQuaternion(this.camera.quaternion); // over the shoulder
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    this.renderer.render(pane.scene, this.camera);
  }

  // Draws a time into another canvas, by way of a corner of this one.
  drawInto(target, kind, time) {
    const pane = this.panes.find(p => p.kind === kind), ratio = this.renderer.getPixelRatio(), was = this.time;
    const { width, height } = target, marked = pane.marks.visible;
    pane.marks.visible = false;
    pane.show(time, false);
    this.drawPane(pane, 0, 0, width / ratio, height / ratio);
    target.getContext('2d').drawImage(this.canvas, 0, this.canvas.height - height, width, height, 0, 0, width, height);
    pane.marks.visible = marked;
    this.show(was);
    this.draw();
  }
}

globalThis.makeViewer = canvas => new Viewer(canvas);
