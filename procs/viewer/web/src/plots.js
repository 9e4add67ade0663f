// Small plots over the run.

import uPlot from 'uplot';

import { duration, length } from './format.js';
import { css } from './palette.js';
import { SERIES } from './store.js';

const HEIGHT_PX = 118;
const MAX_POINTS = 1200;

const PLOTS = [
  {
    title: 'Position error', unit: length,
    lines: [['odometry', SERIES.odometryError, 'odometry', [6, 4]], ['estimate', SERIES.error, 'estimate', []],
      ['1 σ told', SERIES.sigma, 'odometryEdge', [2, 3]]],
  },
  { title: 'Explored volume', unit: (v) => `${Math.round(v)} m³`, lines: [['explored', SERIES.explored, 'full', []]] },
  { title: 'Planning time', unit: (v) => (v < 1 ? `${Math.round(1000 * v)} ms` : `${v.toFixed(1)} s`), lines: [['plan', SERIES.planning, 'tree', []]] },
  {
    title: 'Loop closures', unit: (v) => String(Math.round(v)),
    lines: [['full', SERIES.full, 'full', []], ['partial', SERIES.partial, 'partial', [6, 4]],
      ['rejected', SERIES.rejected, 'rejected', [2, 3]]],
  },
];

export class Plots {
  constructor(parent, store, goTo) {
    Object.assign(this, { parent, store, goTo });
    this.plots = [];
    new ResizeObserver(() => this.resize()).observe(parent);
  }

  setTheme(theme, ink) {
    this.plots.forEach(({ plot }) => plot.destroy());
    this.parent.replaceChildren();
    this.plots = PLOTS.map((description) => this.make(description, theme, ink));
    this.update();
  }

  make(description, theme, ink) {
    const figure = document.createElement('figure');
    const caption = document.createElement('figcaption');
    const title = document.createElement('b');
    title.textContent = description.title;
    caption.append(title);
    const values = description.lines.map(([name, , colour, dash]) => {
      const item = document.createElement('span');
      item.className = 'line';
      const swatch = document.createElement('i');
      swatch.style.borderTop = `2px ${dash.length === 0 ? 'solid' : dash[0] > 3 ? 'dashed' : 'dotted'} ${css(theme[colour])}`;
      const value = document.createElement('output');
      item.append(swatch, ...(description.lines.length > 1 ? [name, ' '] : []), value);
      caption.append(item);
      return value;
    });
    figure.append(caption);
    this.parent.append(figure);
    const axis = { stroke: ink.soft, grid: { stroke: ink.rule, width: 1 }, ticks: { show: false }, font: '11px system-ui, sans-serif' };
    const plot = new uPlot({
      width: Math.max(120, figure.clientWidth), height: HEIGHT_PX,
      legend: { show: false }, cursor: { y: false, sync: { key: 'run' }, points: { size: 5 } }, select: { show: false },
      scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(0, low ?? 0), high > 0 ? 1.08 * high : 1] } },
      axes: [
        { ...axis, size: 22, values: (_, ticks) => ticks.map((t) => duration(t)) },
        { ...axis, size: 52, values: (_, ticks) => ticks.map(description.unit) },
      ],
      series: [{}, ...description.lines.map(([, , colour, dash]) => ({
        stroke: css(theme[colour]), width: 1.8, dash, points: { show: false }, spanGaps: true }))],
      hooks: { draw: [(u) => this.drawNow(u, ink)] },
    }, [[], ...description.lines.map(() => [])], figure);
    plot.over.addEventListener('click', () => {
      if (plot.cursor.left >= 0) this.goTo(this.store.firstTime + 1e6 * plot.posToVal(plot.cursor.left, 'x'));
    });
    return { plot, description, values };
  }

  /** Where the slider stands. */
  drawNow(u, ink) {
    if (!this.store.past) return;
    const x = u.valToPos((this.store.past.t - this.store.firstTime) / 1e6, 'x', true);
    u.ctx.save();
    u.ctx.strokeStyle = ink.strong;
    u.ctx.lineWidth = window.devicePixelRatio;
    u.ctx.setLineDash([]);
    u.ctx.beginPath();
    u.ctx.moveTo(x, u.bbox.top);
    u.ctx.lineTo(x, u.bbox.top + u.bbox.height);
    u.ctx.stroke();
    u.ctx.restore();
  }

  update() {
    const samples = this.store.samples();
    this.parent.hidden = samples.length === 0;
    this.resize();
    const stride = Math.max(1, Math.ceil(samples.length / MAX_POINTS));
    const drawn = samples.filter((_, i) => i % stride === 0 || i === samples.length - 1);
    const first = this.store.firstTime;
    const times = drawn.map((sample) => (sample[SERIES.t] - first) / 1e6);
    const shown = samples.findLast((sample) => sample[SERIES.t] <= this.store.shownTime);
    for (const { plot, description, values } of this.plots) {
      plot.setData([times, ...description.lines.map(([, column]) => drawn.map((sample) => sample[column]))]);
      description.lines.forEach(([, column], i) => {
        const value = shown?.[column];
        values[i].textContent = value === null || value === undefined ? '' : description.unit(value);
      });
    }
  }

  resize() {
    for (const { plot } of this.plots) {
      const width = plot.root.parentElement.clientWidth;
      if (width > 0 && width !== plot.width) plot.setSize({ width, height: HEIGHT_PX });
    }
  }
}
