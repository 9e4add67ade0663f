// The vehicle, its true place, how sure it is of its own, and what the sonar sees.

import * as THREE from 'three';
import { RoundedBoxGeometry } from 'three/addons/geometries/RoundedBoxGeometry.js';

import { rotation, vector } from './lines.js';

const HULL_M = [1.0, 1.0, 0.5];  // Also the box that collisions are judged by.
const SIGMAS = 3;

/** A hull with a nose: it is plain which way it looks. */
export class Vehicle extends THREE.Group {
  constructor() {
    super();
    this.hull = new THREE.MeshLambertMaterial();
    this.accent = new THREE.MeshLambertMaterial();
    const body = new THREE.Mesh(new RoundedBoxGeometry(...HULL_M, 3, 0.14), this.hull);
    const head = new THREE.Mesh(new THREE.ConeGeometry(0.16, 0.42, 20), this.accent);
    head.rotation.z = -Math.PI / 2;
    head.position.x = 0.66;
    this.add(body, head);
    for (const side of [-1, 1]) {
      const thruster = new THREE.Mesh(new THREE.CylinderGeometry(0.11, 0.11, 0.34, 18), this.accent);
      thruster.rotation.z = Math.PI / 2;
      thruster.position.set(-0.28, 0.56 * side, 0);
      this.add(thruster);
    }
    this.visible = false;
  }

  paint(theme) {
    this.hull.color.setHex(theme.hull);
    this.accent.color.setHex(theme.estimate);
  }

  place(pose) {
    this.visible = Boolean(pose);
    if (!pose) return;
    this.position.set(...pose.position);
    this.quaternion.set(...pose.quaternion);
  }
}

/** The edges of the hull where it truly is. */
export class Ghost extends THREE.LineSegments {
  constructor() {
    super(new THREE.EdgesGeometry(new THREE.BoxGeometry(...HULL_M)),
      new THREE.LineBasicMaterial({ transparent: true, opacity: 0.9 }));
    this.visible = false;
  }
}

/** The places where the vehicle may be: an ellipsoid of three standard deviations. */
export class Uncertainty extends THREE.Mesh {
  constructor() {
    super(new THREE.SphereGeometry(1, 32, 20), new THREE.MeshBasicMaterial({
      transparent: true, opacity: 0.16, depthWrite: false }));
    this.matrixAutoUpdate = false;
    this.visible = false;
  }

  place(estimate) {
    const [xx, xy, xz, yy, yz, zz] = estimate.covariance;
    // The sphere goes to the ellipsoid by the covariance's Cholesky factor.
    const a = Math.sqrt(Math.max(xx, 1e-8)), b = xy / a, c = xz / a;
    const d = Math.sqrt(Math.max(yy - b * b, 1e-8)), e = (yz - b * c) / d;
    const f = Math.sqrt(Math.max(zz - c * c - e * e, 1e-8));
    const [x, y, z] = estimate.position;
    const s = SIGMAS;
    this.matrix.set(s * a, 0, 0, x, s * b, s * d, 0, y, s * c, s * e, s * f, z, 0, 0, 0, 1);
    this.matrixWorldNeedsUpdate = true;
  }
}

/** The fan up to what each beam met, and the echoes. */
export class Fan extends THREE.Group {
  constructor() {
    super();
    this.sheet = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({
      transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false }));
    this.echoes = new THREE.Points(new THREE.BufferGeometry(),
      new THREE.PointsMaterial({ size: 5, sizeAttenuation: false }));
    this.sheet.frustumCulled = this.echoes.frustumCulled = false;
    this.add(this.sheet, this.echoes);
    this.visible = false;
  }

  paint(theme) {
    this.sheet.material.color.setHex(theme.fan);
    this.echoes.material.color.setHex(theme.echo);
  }

  place(body, scan) {
    const X_WB = new THREE.Matrix4().compose(vector(body.position), rotation(body.quaternion),
      new THREE.Vector3(1, 1, 1));
    const X_BS = new THREE.Matrix4().compose(vector(scan.X_BS.position),
      rotation(scan.X_BS.quaternion), new THREE.Vector3(1, 1, 1));
    X_WB.multiply(X_BS).decompose(this.position, this.quaternion, this.scale);
    const rim = [0, 0, 0], echoes = [], faces = [];
    for (let i = 0; i < scan.beams.length; i += 2) {
      const bearing = scan.beams[i], range = scan.beams[i + 1];
      const reach = range > 0 ? range : scan.maxRange_m;
      const x = reach * Math.cos(bearing), y = reach * Math.sin(bearing);
      rim.push(x, y, 0);
      if (range > 0) echoes.push(x, y, 0);
      // Where nothing is known, nothing is drawn.
      if (i > 0 && range >= 0 && scan.beams[i - 1] >= 0) faces.push(0, i / 2, i / 2 + 1);
    }
    this.sheet.geometry.dispose();
    this.sheet.geometry = new THREE.BufferGeometry();
    this.sheet.geometry.setAttribute('position', new THREE.Float32BufferAttribute(rim, 3));
    this.sheet.geometry.setIndex(faces);
    this.echoes.geometry.dispose();
    this.echoes.geometry = new THREE.BufferGeometry();
    this.echoes.geometry.setAttribute('position', new THREE.Float32BufferAttribute(echoes, 3));
  }
}
