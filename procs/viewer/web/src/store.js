// All that the page knows: the newest of everything, and how things were where the slider stands.

/** Of these kinds the newest frame counts; the server remembers their past. */
const STATES = ['poses', 'graph', 'estimate', 'odometry', 'truth', 'scan', 'plan', 'mission', 'health'];

export const TRAIL = Object.freeze({ estimate: 0, odometry: 1, truth: 2 });

/** Columns of a sample of the series. */
export const SERIES = Object.freeze({
  t: 0, error: 1, odometryError: 2, sigma: 3, explored: 4, planning: 5, full: 6, partial: 7,
  rejected: 8, submaps: 9,
});

export class Store extends EventTarget {
  constructor() {
    super();
    this.hello = null;
    this.operators = false;
    this.loading = 1;
    this.clear();
  }

  clear() {
    this.submaps = new Map();
    this.frontiers = new Map();
    this.live = {};
    this.past = null;  // As `live`, at past.t.
    this.arriving = null;
    this.trails = [new Map(), new Map(), new Map()];
    this.seriesParts = new Map();
    this.heardAt = new Map();  // Process -> when its STATUS came, by this machine's clock [ms].
    this.dirty = new Set(['all']);
    this.counts = {};  // Of the frames taken, by kind.
  }

  /** What is to be shown: the past where the slider stands, otherwise now. */
  get shown() { return this.past ?? this.live; }

  /** Vehicle time that is shown [us]. */
  get shownTime() { return this.past ? this.past.t : Infinity; }

  get firstTime() {
    const parts = this.seriesParts.get(0);
    return parts?.[0]?.[SERIES.t] ?? this.live.estimate?.t ?? this.live.poses?.t ?? 0;
  }

  get newestTime() {
    return Math.max(this.live.estimate?.t ?? 0, this.live.odometry?.t ?? 0, this.live.poses?.t ?? 0);
  }

  /** All samples, oldest first. */
  samples() {
    return [...this.seriesParts.keys()].sort((a, b) => a - b)
      .flatMap((part) => this.seriesParts.get(part));
  }

  /** All points of a path, oldest first. */
  trail(number) {
    const parts = this.trails[number];
    return [...parts.keys()].sort((a, b) => a - b).flatMap((part) => parts.get(part));
  }

  take(frame) {
    this.counts[frame.kind] = (this.counts[frame.kind] ?? 0) + 1;
    if (this.arriving && STATES.includes(frame.kind)) {
      this.arriving[frame.kind] = frame;
      return;
    }
    if (STATES.includes(frame.kind)) {
      this.takeState(frame);
    } else {
      this[`take_${frame.kind}`]?.(frame);
    }
  }

  takeState(frame) {
    this.live[frame.kind] = frame;
    if (frame.kind === 'health') this.noteHeard(frame);
    if (!this.past) this.dirty.add(frame.kind);
  }

  noteHeard(health) {
    for (const { name, t } of health.processes) {
      const known = this.heardAt.get(name);
      if (!known || known.t !== t) this.heardAt.set(name, { t, at: performance.now() });
    }
  }

  take_reset() { this.clear(); }
  take_welcome(frame) { this.operators = frame.operators; this.dirty.add('operators'); }
  take_hello(frame) { this.hello = frame; this.dirty.add('hello'); }
  take_loading(frame) { this.loading = frame.share; this.dirty.add('loading'); }
  take_submap(frame) { this.submaps.set(frame.id, frame); this.dirty.add('submaps').add(frame.id); }
  take_frontier(frame) { this.frontiers.set(frame.corner.join(), frame); this.dirty.add('frontiers'); }
  take_trail(frame) { this.trails[frame.trail].set(frame.part, frame.points); this.dirty.add('trails'); }
  take_series(frame) { this.seriesParts.set(frame.part, frame.samples); this.dirty.add('series'); }
  take_at_begin(frame) { this.arriving = { t: frame.t }; }
  take_at_end() {
    const arrived = this.arriving;
    this.arriving = null;
    this.dispatchEvent(new CustomEvent('arrived', { detail: arrived }));
  }
  take_refused(frame) { this.dispatchEvent(new CustomEvent('told', { detail: frame.why })); }
  take_obeyed(frame) { this.dispatchEvent(new CustomEvent('told', { detail: `Sent: ${frame.command}` })); }

  showPast(past) { this.past = past; this.dirty.add('all'); }
  showLive() { this.past = null; this.dirty.add('all'); }

  /** What changed since the last call; everything where it has 'all'. */
  takeChanges() {
    const changes = this.dirty;
    this.dirty = new Set();
    return changes;
  }
}
