// The binary frames of procs/viewer/frames.h.

export const KIND = Object.freeze({
  submap: 1, poses: 2, scan: 3, estimate: 4, odometry: 5, truth: 6, graph: 7, trail: 8, frontier: 9,
});

export const EDGE = Object.freeze({ odometry: 0, full: 1, partial: 2, rejected: 3 });

const HEAD = 16;

/** A pose at `at` (in float32) of `numbers`: position [m] and quaternion in three.js' order x, y, z, w. */
function poseAt(numbers, at) {
  return {
    position: [numbers[at], numbers[at + 1], numbers[at + 2]],
    quaternion: [numbers[at + 4], numbers[at + 5], numbers[at + 6], numbers[at + 3]],
  };
}

const decoders = {
  [KIND.submap](view, buffer, count) {
    return {
      kind: 'submap',
      id: view.getUint32(16, true),
      voxel_m: view.getFloat32(20, true),
      last: view.getFloat64(24, true),
      // x, y, z, and two bytes of direction in the fourth.
      voxels: new Int16Array(buffer, 32, 4 * count),
    };
  },
  [KIND.poses](view, buffer, count) {
    const numbers = new Float32Array(buffer, 24, 10 * count);
    const ids = new Uint32Array(buffer, 24, 10 * count);
    const places = new Map();
    for (let i = 0; i < count; ++i) {
      const place = poseAt(numbers, 10 * i + 1);
      place.sigma_m = numbers[10 * i + 8];
      place.trueError_m = numbers[10 * i + 9];
      places.set(ids[10 * i], place);
    }
    return { kind: 'poses', version: view.getFloat64(16, true), places };
  },
  [KIND.scan](view, buffer, count) {
    const numbers = new Float32Array(buffer, HEAD, 9 + 2 * count);
    return {
      kind: 'scan', X_BS: poseAt(numbers, 0), minRange_m: numbers[7], maxRange_m: numbers[8],
      beams: numbers.subarray(9),
    };
  },
  [KIND.estimate](view, buffer) {
    const numbers = new Float32Array(buffer, HEAD, 15);
    return {
      kind: 'estimate', ...poseAt(numbers, 0), covariance: Array.from(numbers.subarray(7, 13)),
      speed_m_s: numbers[13], yawRate_rad_s: numbers[14],
    };
  },
  [KIND.odometry]: (view, buffer) =>
    ({ kind: 'odometry', ...poseAt(new Float32Array(buffer, HEAD, 7), 0) }),
  [KIND.truth]: (view, buffer) =>
    ({ kind: 'truth', ...poseAt(new Float32Array(buffer, HEAD, 7), 0) }),
  [KIND.graph](view, buffer, count) {
    const reasons = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 24 + 40 * count)));
    const edges = new Array(count);
    for (let i = 0, at = 24; i < count; ++i, at += 40) {
      const free = [];
      for (const from of [at + 16, at + 28]) {
        const direction = [0, 4, 8].map((offset) => view.getFloat32(from + offset, true));
        if (Math.hypot(...direction) > 0.5) free.push(direction);
      }
      edges[i] = {
        from: view.getUint32(at, true), to: view.getUint32(at + 4, true),
        kind: view.getUint8(at + 8), directions: view.getUint8(at + 9),
        reason: reasons[view.getUint16(at + 10, true)], chiSquare: view.getFloat32(at + 12, true),
        free,
      };
    }
    return { kind: 'graph', version: view.getFloat64(16, true), edges };
  },
  [KIND.trail](view, buffer, count) {
    const points = new Array(count);
    for (let i = 0, at = 24; i < count; ++i, at += 24) {
      points[i] = {
        t: view.getFloat64(at, true), anchor: view.getInt32(at + 8, true),
        x: view.getFloat32(at + 12, true), y: view.getFloat32(at + 16, true),
        z: view.getFloat32(at + 20, true),
      };
    }
    return { kind: 'trail', trail: view.getUint32(16, true), part: view.getUint32(20, true), points };
  },
  [KIND.frontier](view, buffer, count) {
    return {
      kind: 'frontier',
      corner: [16, 20, 24].map((at) => view.getInt32(at, true)),
      voxel_m: view.getFloat32(28, true),
      voxels: new Uint8Array(buffer, 32, 3 * count),
    };
  },
};

/** What a binary frame says; null for one of a kind that is not known. */
export function decodeFrame(buffer) {
  const view = new DataView(buffer);
  const decode = decoders[view.getUint32(0, true)];
  if (!decode) return null;
  const frame = decode(view, buffer, view.getUint32(4, true));
  frame.t = view.getFloat64(8, true);
  return frame;
}
