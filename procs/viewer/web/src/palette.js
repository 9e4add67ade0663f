// Colours that people with any kind of colour vision tell apart: Okabe and Ito's for things,
// viridis and cividis for quantities. Lines differ in their dashes and widths as well.

export const THEMES = Object.freeze({
  dark: {
    background: 0x0d1318, grid: 0x24303a, gridStrong: 0x34434f, box: 0x8fa3b3, hull: 0xe9eef2,
    truth: 0xf5f7f9, odometry: 0xe69f00, estimate: 0x56b4e9, odometryEdge: 0x7d8c99,
    full: 0x1fc7a0, partial: 0xf0e442, rejected: 0xe8743b, tree: 0xcc79a7, best: 0xffd75e,
    fan: 0x56b4e9, echo: 0xffffff, frontier: 0xcc9ae0, keepOut: 0xe8743b, ghost: 0xf5f7f9,
  },
  light: {
    background: 0xf4f6f8, grid: 0xdde3e8, gridStrong: 0xc4cdd5, box: 0x64748b, hull: 0x27313a,
    truth: 0x11181d, odometry: 0xb87400, estimate: 0x0072b2, odometryEdge: 0x8694a1,
    full: 0x00805f, partial: 0x9a8500, rejected: 0xc2470c, tree: 0xa2497b, best: 0xb35900,
    fan: 0x0072b2, echo: 0x11181d, frontier: 0x8e4fb0, keepOut: 0xc2470c, ghost: 0x11181d,
  },
});

const VIRIDIS = ['440154', '482475', '414487', '355f8d', '2a788e', '21918c', '22a884', '44bf70',
  '7ad151', 'bddf26', 'fde725'];
const CIVIDIS = ['00204d', '00306f', '2a406c', '48526b', '5e626e', '727374', '878479', '9e9677',
  'b6a971', 'd0be67', 'ead357'];

/** `stops` brought from 0 to 1, as 256 RGBA bytes. */
function ramp(stops, from = 0) {
  const rgb = stops.map((hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  const bytes = new Uint8Array(4 * 256);
  for (let i = 0; i < 256; ++i) {
    const x = (from + (1 - from) * i / 255) * (rgb.length - 1);
    const k = Math.min(Math.floor(x), rgb.length - 2);
    for (let c = 0; c < 3; ++c) {
      bytes[4 * i + c] = Math.round(rgb[k][c] + (x - k) * (rgb[k + 1][c] - rgb[k][c]));
    }
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

/** The darkest blues are left out: they vanish on a dark ground. */
export const RAMPS = Object.freeze({ viridis: ramp(VIRIDIS, 0.16), cividis: ramp(CIVIDIS, 0.14) });

export function cssRamp(bytes) {
  const stops = [0, 51, 102, 153, 204, 255].map((i) =>
    `rgb(${bytes[4 * i]} ${bytes[4 * i + 1]} ${bytes[4 * i + 2]}) ${Math.round(i / 2.55)}%`);
  return `linear-gradient(to right, ${stops.join(', ')})`;
}

export const css = (color) => `#${color.toString(16).padStart(6, '0')}`;
