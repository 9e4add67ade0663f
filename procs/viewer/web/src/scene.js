// The picture: what the store shows, as three.js draws it. Drawn anew only when something changed.

import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { EDGE } from './frames.js';
import { boxSegments, pathSegments, rotation, Segments, vector } from './lines.js';
import { RAMPS, THEMES } from './palette.js';
import { TRAIL } from './store.js';
import { sharedUniforms, SubmapCloud } from './submap_cloud.js';
import { Fan, Ghost, Uncertainty, Vehicle } from './vehicle.js';

const FIELD_OF_VIEW_DEG = 50;
const MAX_PATH_POINTS = 12000;   // A path; longer ones are drawn more coarsely.
const FRONTIER_SHARE = 0.55;     // Of a voxel's side: they are many.
const FREE_LENGTH_M = 0.45;
const LABELLED_NODES = 8;
const LABEL_PX = [40, 16];
const AIMED_FRAME_MS = 45;       // More makes the map coarser, less finer.
const TRAIL_INTERVAL_MS = 300;   // Paths grow at every pose; they are drawn less often.

export const COLOUR_BY = Object.freeze(['age', 'height', 'sigma', 'trueError']);

export class Scene {
  constructor(canvas, labels, store) {
    this.store = store;
    this.labels = labels;
    this.layers = {};
    this.colourBy = 'age';
    this.following = false;
    this.framed = false;
    this.detail = 1;
    this.stats = { drawn: 0, frame_ms: 16, points: 0 };
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.1, 2000);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-9, -12, 9);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.requestDraw());
    this.controls.addEventListener('start', () => { this.framed = true; });
    this.build();
    this.wantsDraw = true;
    this.trailsAt = 0;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.renderer.setAnimationLoop(() => this.tick());
  }

  build() {
    this.shared = sharedUniforms();
    this.clouds = new Map();
    this.cloudGroup = new THREE.Group();
    this.frontierGroup = new THREE.Group();
    this.frontierClouds = new Map();
    this.frontierMaterial = new THREE.PointsMaterial({ size: 0.05, transparent: true, opacity: 0.55, depthWrite: false });
    this.vehicle = new Vehicle();
    this.ghost = new Ghost();
    this.uncertainty = new Uncertainty();
    this.fan = new Fan();
    this.lines = {
      truth: new Segments({ width_px: 1.6 }),
      odometry: new Segments({ width_px: 2.2, dash: [0.28, 0.16] }),
      estimate: new Segments({ width_px: 2.8 }),
      odometryEdge: new Segments({ width_px: 1.6 }),
      full: new Segments({ width_px: 2.4 }),
      partial: new Segments({ width_px: 2.4, dash: [0.3, 0.12] }),
      free: new Segments({ width_px: 3.2 }),
      rejected: new Segments({ width_px: 1.2, dash: [0.08, 0.12], opacity: 0.5 }),
      tree: new Segments({ width_px: 1.6, opacity: 0.85 }),
      best: new Segments({ width_px: 4 }),
      exploration: new Segments({ width_px: 1.8, dash: [0.3, 0.2] }),
      keepOut: new Segments({ width_px: 2.6 }),
    };
    this.nodes = new THREE.Points(new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 7, sizeAttenuation: false }));
    this.treeNodes = new THREE.Points(new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 8, sizeAttenuation: false }));
    this.nodes.frustumCulled = this.treeNodes.frustumCulled = false;
    this.keepOutFaces = new THREE.Group();
    this.gridGroup = new THREE.Group();
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.scene.add(this.gridGroup, this.cloudGroup, this.frontierGroup, this.vehicle, this.ghost,
      this.uncertainty, this.fan, this.nodes, this.treeNodes, this.keepOutFaces, this.sun,
      new THREE.HemisphereLight(0xffffff, 0x556677, 1.6), ...Object.values(this.lines));
  }

  setTheme(name) {
    const theme = this.theme = THEMES[name];
    this.scene.background = new THREE.Color(theme.background);
    const colours = { ...theme, free: theme.partial, exploration: theme.box };
    for (const [line, segments] of Object.entries(this.lines)) segments.setColor(colours[line]);
    this.nodes.material.color.setHex(theme.odometryEdge);
    this.treeNodes.material.color.setHex(theme.tree);
    this.frontierMaterial.color.setHex(theme.frontier);
    this.uncertainty.material.color.setHex(theme.estimate);
    this.ghost.material.color.setHex(theme.ghost);
    this.vehicle.paint(theme);
    this.fan.paint(theme);
    this.drawBoxes();
    this.requestDraw();
  }

  /** `layers`: name -> whether it is shown. */
  setLayers(layers) {
    this.layers = layers;
    this.cloudGroup.visible = layers.submaps;
    this.frontierGroup.visible = layers.frontiers;
    this.lines.truth.show(layers.truth);
    this.lines.odometry.show(layers.odometry);
    this.lines.estimate.show(layers.estimate);
    this.lines.odometryEdge.show(layers.graph);
    this.nodes.visible = layers.graph;
    this.lines.full.show(layers.full);
    this.lines.partial.show(layers.partial);
    this.lines.free.show(layers.partial);
    this.lines.rejected.show(layers.rejected);
    this.lines.tree.show(layers.plan);
    this.lines.best.show(layers.plan);
    this.treeNodes.visible = layers.plan;
    this.lines.exploration.show(layers.boxes);
    this.lines.keepOut.show(layers.boxes);
    this.keepOutFaces.visible = layers.boxes;
    this.gridGroup.visible = layers.boxes;
    this.placeVehicle();
    this.drawLabels();
    this.requestDraw();
  }

  setColourBy(what) {
    this.colourBy = what;
    this.paintClouds();
    this.requestDraw();
  }

  requestDraw() { this.wantsDraw = true; }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    const drawn = this.renderer.getDrawingBufferSize(new THREE.Vector2());
    this.shared.pixels.value = drawn.y / (2 * Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW_DEG) / 2));
    this.requestDraw();
  }

  tick() {
    const changes = this.store.takeChanges();
    if (changes.size > 0) {
      this.update(changes);
      this.onChanges?.(changes);
    }
    if (this.trailsWait && performance.now() - this.trailsAt > TRAIL_INTERVAL_MS) this.drawTrails();
    if (!this.wantsDraw) return;
    this.wantsDraw = false;
    const start = performance.now();
    this.sun.position.copy(this.camera.position).add(new THREE.Vector3(-4, 2, 9));
    this.renderer.render(this.scene, this.camera);
    this.moveLabels();
    this.stats.drawn += 1;
    this.adaptDetail(start);
  }

  /** Draws fewer voxels where the machine is slow, all where it is not. */
  adaptDetail(start) {
    const since = start - (this.lastDraw ?? 0);
    const wasBusy = this.lastDraw !== undefined && since < 500;
    this.lastDraw = start;
    if (!wasBusy) return;
    this.stats.frame_ms += 0.2 * (since - this.stats.frame_ms);
    if (this.stats.frame_ms > AIMED_FRAME_MS && this.stats.points > 100000) this.setDetail(0.85 * this.detail);
    else if (this.stats.frame_ms < 0.6 * AIMED_FRAME_MS) this.setDetail(1.1 * this.detail);
  }

  setDetail(share) {
    const detail = Math.min(1, Math.max(0.03, share));
    if (Math.abs(detail - this.detail) < 0.02 * this.detail) return;
    this.detail = detail;
    // Fewer ones are drawn larger, so that surfaces stay whole.
    this.shared.grow.value = 1.12 * Math.min(2.2, Math.pow(detail, -0.4));
    for (const cloud of this.clouds.values()) cloud.setDetail(detail);
  }

  update(changes) {
    const has = (...kinds) => changes.has('all') || kinds.some((kind) => changes.has(kind));
    if (has('submaps')) this.takeSubmaps(changes);
    if (has('submaps', 'poses')) this.placeClouds();
    if (has('frontiers')) this.takeFrontiers();
    if (has('hello')) this.drawBoxes();
    if (has('poses', 'graph')) this.drawGraph();
    if (has('plan')) this.drawPlan();
    if (has('estimate', 'odometry', 'truth', 'scan')) this.placeVehicle();
    if (has('trails', 'poses')) this.trailsWait = true;
    if (!this.framed) this.frameAll();
    this.requestDraw();
  }

  takeSubmaps(changes) {
    const { submaps } = this.store;
    for (const [id, cloud] of this.clouds) {
      if (submaps.has(id) && !changes.has(id)) continue;
      this.cloudGroup.remove(cloud);
      cloud.dispose();
      this.clouds.delete(id);
    }
    for (const [id, submap] of submaps) {
      if (this.clouds.has(id)) continue;
      const cloud = new SubmapCloud(submap, this.shared);
      cloud.setDetail(this.detail);
      this.clouds.set(id, cloud);
      this.cloudGroup.add(cloud);
    }
  }

  placeClouds() {
    const places = this.store.shown.poses?.places;
    this.stats.points = 0;
    for (const [id, cloud] of this.clouds) {
      const place = places?.get(id);
      const isThere = place && this.store.submaps.get(id).last <= this.store.shownTime;
      if (isThere) {
        cloud.place(place);
        this.stats.points += cloud.count;
      } else {
        cloud.visible = false;
      }
    }
    this.paintClouds();
  }

  /** The quantity that submaps are coloured by, and its ends. */
  tones() {
    const places = [...(this.store.shown.poses?.places ?? [])].filter(([id]) => this.clouds.has(id));
    if (this.colourBy === 'age') {
      const times = places.map(([id]) => [id, this.store.submaps.get(id).t]);
      const newest = Math.max(...times.map(([, t]) => t), 0);
      return { values: times.map(([id, t]) => [id, (newest - t) / 6e7]), unit: 'min ago', isReversed: true };
    }
    const key = this.colourBy === 'trueError' ? 'trueError_m' : 'sigma_m';
    return { values: places.map(([id, place]) => [id, place[key]]), unit: 'm' };
  }

  paintClouds() {
    const isByHeight = this.colourBy === 'height';
    const ramp = RAMPS[this.colourBy === 'age' || isByHeight ? 'viridis' : 'cividis'];
    this.shared.ramp.value.image.data.set(ramp);
    this.shared.ramp.value.needsUpdate = true;
    this.shared.colourBy.value = isByHeight ? 1 : 0;
    if (isByHeight) {
      const box = this.mapBox();
      if (!box.isEmpty()) this.shared.heights.value.set(box.min.z, box.max.z);
      this.scale = { low: this.shared.heights.value.x, high: this.shared.heights.value.y, unit: 'm', ramp };
      return;
    }
    const { values, unit, isReversed } = this.tones();
    const known = values.map(([, value]) => value).filter(Number.isFinite);
    const high = Math.max(...known, 1e-3);
    for (const [id, value] of values) {
      const share = Number.isFinite(value) ? value / high : 0;
      this.clouds.get(id).setTone(isReversed ? 1 - share : share);
    }
    this.scale = isReversed ? { low: high, high: 0, unit, ramp } : { low: 0, high, unit, ramp };
  }

  takeFrontiers() {
    const { frontiers } = this.store;
    const isLive = !this.store.past;  // The past's frontiers nobody remembers.
    for (const [key, cloud] of this.frontierClouds) {
      if (frontiers.get(key) === cloud.frame && isLive) continue;
      this.frontierGroup.remove(cloud);
      cloud.geometry.dispose();
      this.frontierClouds.delete(key);
    }
    if (!isLive) return;
    for (const [key, frame] of frontiers) {
      if (this.frontierClouds.has(key) || frame.voxels.length === 0) continue;
      const geometry = new THREE.BufferGeometry();
      const positions = new Float32Array(frame.voxels.length);
      for (let i = 0; i < positions.length; ++i) {
        positions[i] = (frame.corner[i % 3] + frame.voxels[i] + 0.5) * frame.voxel_m;
      }
      geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
      this.frontierMaterial.size = FRONTIER_SHARE * frame.voxel_m;
      const cloud = new THREE.Points(geometry, this.frontierMaterial);
      cloud.frame = frame;
      this.frontierClouds.set(key, cloud);
      this.frontierGroup.add(cloud);
    }
  }

  drawBoxes() {
    const boxes = this.store.hello?.boxes ?? [];
    const of = (kind) => boxes.filter((box) => box.kind === kind);
    this.lines.exploration.setSegments(of('exploration').flatMap(boxSegments));
    this.lines.keepOut.setSegments(of('keep_out').flatMap(boxSegments));
    this.keepOutFaces.clear();
    for (const { min, max } of of('keep_out')) {
      const face = new THREE.Mesh(new THREE.BoxGeometry(...max.map((m, i) => m - min[i])),
        new THREE.MeshBasicMaterial({ color: this.theme.keepOut, transparent: true, opacity: 0.12, depthWrite: false }));
      face.position.set(...max.map((m, i) => (m + min[i]) / 2));
      this.keepOutFaces.add(face);
    }
    this.drawGrid(of('exploration')[0]);
  }

  /** A floor of one-metre squares under the exploration box. */
  drawGrid(box) {
    this.gridGroup.clear();
    if (!this.theme) return;
    const size = box ? 2 * Math.ceil(0.7 * Math.max(box.max[0] - box.min[0], box.max[1] - box.min[1])) : 20;
    const grid = new THREE.GridHelper(size, size, this.theme.gridStrong, this.theme.grid);
    grid.rotation.x = Math.PI / 2;
    if (box) grid.position.set(Math.round((box.min[0] + box.max[0]) / 2), Math.round((box.min[1] + box.max[1]) / 2), box.min[2]);
    this.gridGroup.add(grid);
  }

  drawGraph() {
    const { poses, graph } = this.store.shown;
    const places = poses?.places ?? new Map();
    const parts = { odometryEdge: [], full: [], partial: [], rejected: [], free: [] };
    const lineOf = { [EDGE.odometry]: 'odometryEdge', [EDGE.full]: 'full', [EDGE.partial]: 'partial', [EDGE.rejected]: 'rejected' };
    for (const edge of graph?.edges ?? []) {
      const from = places.get(edge.from), to = places.get(edge.to);
      if (!from || !to) continue;
      parts[lineOf[edge.kind]]?.push(...from.position, ...to.position);
      for (const direction of edge.free) {
        const at = vector(to.position);
        const way = vector(direction).applyQuaternion(rotation(to.quaternion)).multiplyScalar(FREE_LENGTH_M);
        parts.free.push(...at.clone().sub(way).toArray(), ...at.add(way).toArray());
      }
    }
    for (const [line, positions] of Object.entries(parts)) this.lines[line].setSegments(positions);
    this.setPoints(this.nodes, [...places.values()].flatMap((place) => place.position));
  }

  setPoints(points, positions) {
    points.geometry.dispose();
    points.geometry = new THREE.BufferGeometry();
    points.geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
  }

  drawPlan() {
    const plan = this.store.shown.plan;
    const tree = plan?.tree ?? [];
    const edges = [], best = [];
    const onBest = new Set();
    for (let node = plan?.best ?? -1; node >= 0; node = tree[node][0]) onBest.add(node);
    tree.forEach(([parent, x, y, z], number) => {
      if (parent < 0) return;
      (onBest.has(number) ? best : edges).push(...tree[parent].slice(1, 4), x, y, z);
    });
    const path = plan?.path ?? [];
    for (let i = 1; i < path.length; ++i) best.push(...path[i - 1].slice(0, 3), ...path[i].slice(0, 3));
    this.lines.tree.setSegments(edges);
    this.lines.best.setSegments(best);
    this.setPoints(this.treeNodes, tree.flatMap(([, x, y, z]) => [x, y, z]));
    this.drawLabels();
  }

  /** The gains of the nodes that promise most, beside them. */
  drawLabels() {
    const tree = this.layers.plan ? this.store.shown.plan?.tree ?? [] : [];
    const most = tree.filter(([parent, , , , , gain]) => parent >= 0 && gain > 0)
      .sort((a, b) => b[5] - a[5]).slice(0, LABELLED_NODES);
    this.labels.replaceChildren(...most.map(([, x, y, z, , gain]) => {
      const label = document.createElement('span');
      label.textContent = gain >= 10 ? Math.round(gain) : gain.toFixed(1);
      label.position_W = new THREE.Vector3(x, y, z);
      return label;
    }));
  }

  moveLabels() {
    const { clientWidth: width, clientHeight: height } = this.labels;
    const p = new THREE.Vector3();
    const placed = [];
    for (const label of this.labels.children) {
      p.copy(label.position_W).project(this.camera);
      const x = (p.x + 1) * width / 2 + 7, y = (1 - p.y) * height / 2 - 9;
      // Where two would lie upon each other, the larger gain stays.
      label.hidden = p.z > 1 || placed.some(([u, v]) => Math.abs(u - x) < LABEL_PX[0] && Math.abs(v - y) < LABEL_PX[1]);
      if (!label.hidden) placed.push([x, y]);
      label.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  placeVehicle() {
    const { estimate, truth, scan } = this.store.shown;
    const body = estimate ?? this.store.shown.odometry;
    this.vehicle.place(this.layers.vehicle ? body : null);
    this.uncertainty.visible = Boolean(estimate && this.layers.vehicle);
    if (estimate) this.uncertainty.place(estimate);
    this.ghost.visible = Boolean(truth && this.layers.truth);
    if (truth) {
      this.ghost.position.set(...truth.position);
      this.ghost.quaternion.set(...truth.quaternion);
    }
    this.fan.visible = Boolean(body && scan && this.layers.fan);
    if (this.fan.visible) this.fan.place(body, scan);
    if (this.following && body) {
      const move = vector(body.position).sub(this.controls.target);
      this.controls.target.add(move);
      this.camera.position.add(move);
      this.controls.update();
    }
  }

  drawTrails() {
    this.trailsWait = false;
    this.trailsAt = performance.now();
    const places = this.store.shown.poses?.places;
    const frames = new Map();
    const frameOf = (id) => {
      if (!frames.has(id)) {
        const place = places?.get(id);
        frames.set(id, place ? { p: vector(place.position), q: rotation(place.quaternion) } : null);
      }
      return frames.get(id);
    };
    for (const [name, number] of Object.entries(TRAIL)) {
      const all = this.store.trail(number).filter(({ t }) => t <= this.store.shownTime);
      const stride = Math.ceil(all.length / MAX_PATH_POINTS);
      const points = all.filter((_, i) => i % stride === 0 || i === all.length - 1).map((point) => {
        const p = new THREE.Vector3(point.x, point.y, point.z);
        if (point.anchor < 0) return p;
        const frame = frameOf(point.anchor);
        return frame ? p.applyQuaternion(frame.q).add(frame.p) : null;
      }).filter(Boolean);
      this.lines[name].setSegments(pathSegments(points));
    }
    this.requestDraw();
  }

  /** The box of all submaps that are shown. */
  mapBox() {
    const box = new THREE.Box3();
    for (const cloud of this.clouds.values()) {
      if (cloud.visible && !cloud.box_M.isEmpty()) box.union(cloud.box_M.clone().applyMatrix4(cloud.matrix));
    }
    return box;
  }

  /** Puts all that there is into the picture. */
  frameAll() {
    const exploration = this.store.hello?.boxes?.find(({ kind }) => kind === 'exploration');
    const box = exploration ? new THREE.Box3(vector(exploration.min), vector(exploration.max)) : this.mapBox();
    if (this.store.shown.estimate) box.expandByPoint(vector(this.store.shown.estimate.position));
    if (box.isEmpty()) return;
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    const narrow = Math.min(1, this.camera.aspect);
    const distance = 0.92 * Math.max(sphere.radius, 2) / (narrow * Math.sin(THREE.MathUtils.degToRad(FIELD_OF_VIEW_DEG) / 2));
    this.lookFrom(new THREE.Vector3(-0.62, -0.7, 0.62).normalize(), sphere.center, distance);
  }

  lookFrom(direction, target = this.controls.target.clone(), distance = this.camera.position.distanceTo(this.controls.target)) {
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.controls.update();
    this.requestDraw();
  }
}
