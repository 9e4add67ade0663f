// Lines with a width in pixels and, where wanted, dashes in metres.

import * as THREE from 'three';
import { LineMaterial } from 'three/addons/lines/LineMaterial.js';
import { LineSegments2 } from 'three/addons/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/addons/lines/LineSegmentsGeometry.js';

export class Segments extends LineSegments2 {
  /** `dash`: [drawn, left out] in metres, or nothing for a whole line. */
  constructor({ width_px = 2, dash = null, opacity = 1, depthTest = true } = {}) {
    super(new LineSegmentsGeometry(), new LineMaterial({
      linewidth: width_px, dashed: Boolean(dash), dashSize: dash?.[0] ?? 1, gapSize: dash?.[1] ?? 1,
      opacity, transparent: opacity < 1, depthTest, depthWrite: opacity >= 1,
    }));
    this.frustumCulled = false;
    this.visible = false;
    this.wanted = true;
    this.isEmpty = true;
  }

  /** Replaces all segments: [x, y, z, x, y, z, ...], two points each. */
  setSegments(positions) {
    this.isEmpty = positions.length < 6;
    this.visible = this.wanted && !this.isEmpty;
    if (this.isEmpty) return;
    this.geometry.dispose();
    this.geometry = new LineSegmentsGeometry();
    this.geometry.setPositions(positions);
    if (this.material.dashed) this.computeLineDistances();
  }

  show(wanted) {
    this.wanted = wanted;
    this.visible = wanted && !this.isEmpty;
  }

  setColor(color) { this.material.color.setHex(color); }
}

/** The twelve edges of a box, as segments. */
export function boxSegments({ min, max }) {
  const corner = (i) => [i & 1 ? max[0] : min[0], i & 2 ? max[1] : min[1], i & 4 ? max[2] : min[2]];
  const positions = [];
  for (let i = 0; i < 8; ++i) {
    for (const bit of [1, 2, 4]) if (!(i & bit)) positions.push(...corner(i), ...corner(i | bit));
  }
  return positions;
}

/** A path of points as segments. */
export function pathSegments(points) {
  const positions = [];
  for (let i = 1; i < points.length; ++i) {
    const a = points[i - 1], b = points[i];
    positions.push(a.x, a.y, a.z, b.x, b.y, b.z);
  }
  return positions;
}

export const vector = (p) => new THREE.Vector3(...p);
export const rotation = (q) => new THREE.Quaternion(...q);
