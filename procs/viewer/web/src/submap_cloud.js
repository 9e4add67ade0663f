// A submap's occupied voxels as points that move with its pose, lit as the surface they lie on.

import * as THREE from 'three';

const VERTEX = /* glsl */`
  in vec4 key;
  uniform float voxel, pixels, tone, grow;
  uniform vec2 heights;
  uniform int colourBy;
  uniform mat4 modelViewMatrix, modelMatrix, projectionMatrix;
  uniform sampler2D ramp;
  out vec3 colour;
  out float size;

  vec3 fromOctahedral(int packed) {
    vec2 p = vec2(float((packed << 24) >> 24), float((packed << 16) >> 24)) / 127.0;
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n);
  }

  void main() {
    vec4 p_M = vec4((key.xyz + 0.5) * voxel, 1.0);
    vec4 p_C = modelViewMatrix * p_M;
    gl_Position = projectionMatrix * p_C;
    size = voxel * grow * pixels / -p_C.z;
    gl_PointSize = clamp(size, 1.0, 96.0);
    float t = tone;
    if (colourBy == 1) t = ((modelMatrix * p_M).z - heights.x) / max(heights.y - heights.x, 1e-3);
    vec3 n_C = normalize(mat3(modelViewMatrix) * fromOctahedral(int(key.w)));
    float light = 0.62 + 0.38 * dot(n_C, normalize(vec3(-0.35, 0.55, 0.76)));
    colour = texture(ramp, vec2(clamp(t, 0.004, 0.996), 0.5)).rgb * light * 1.12;
  }`;

const FRAGMENT = /* glsl */`
  precision highp float;
  in vec3 colour;
  in float size;
  out vec4 pixel;
  void main() {
    // A thin rim tells near voxels apart.
    vec2 d = abs(gl_PointCoord - 0.5);
    float rim = size > 7.0 ? smoothstep(0.5, 0.5 - 1.6 / size, max(d.x, d.y)) : 1.0;
    pixel = vec4(colour * mix(0.72, 1.0, rim), 1.0);
  }`;

/** What all clouds share; `value`s may be changed at any time. */
export function sharedUniforms() {
  const ramp = new THREE.DataTexture(new Uint8Array(4 * 256), 256, 1);
  ramp.magFilter = ramp.minFilter = THREE.LinearFilter;
  return {
    pixels: { value: 500 }, grow: { value: 1.12 }, heights: { value: new THREE.Vector2(-2, 2) },
    colourBy: { value: 0 }, ramp: { value: ramp },
  };
}

export class SubmapCloud extends THREE.Points {
  constructor(submap, shared) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('key', new THREE.BufferAttribute(submap.voxels, 4));
    const count = submap.voxels.length / 4;
    geometry.setDrawRange(0, count);
    const material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT,
      uniforms: { ...shared, voxel: { value: submap.voxel_m }, tone: { value: 0.5 } },
    });
    super(geometry, material);
    this.count = count;
    this.voxel_m = submap.voxel_m;
    this.box_M = this.boxOf(submap.voxels);
    geometry.boundingSphere = this.box_M.getBoundingSphere(new THREE.Sphere());
    this.matrixAutoUpdate = false;
    this.visible = false;  // Until it has a place.
  }

  boxOf(voxels) {
    const box = new THREE.Box3();
    const p = new THREE.Vector3();
    for (let i = 0; i < voxels.length; i += 4) {
      box.expandByPoint(p.set(voxels[i], voxels[i + 1], voxels[i + 2]));
    }
    if (!box.isEmpty()) {
      box.max.addScalar(1);
      box.min.multiplyScalar(this.voxel_m);
      box.max.multiplyScalar(this.voxel_m);
    }
    return box;
  }

  place({ position, quaternion }) {
    this.matrix.compose(new THREE.Vector3(...position), new THREE.Quaternion(...quaternion),
      new THREE.Vector3(1, 1, 1));
    this.matrixWorldNeedsUpdate = true;
    this.visible = true;
  }

  setTone(tone) { this.material.uniforms.tone.value = tone; }

  /** Shows that share of the voxels, from all over. */
  setDetail(share) { this.geometry.setDrawRange(0, Math.ceil(this.count * share)); }

  dispose() {
    this.geometry.dispose();
    this.material.dispose();
  }
}
