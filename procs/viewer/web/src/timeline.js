// The slider over the run: asks the server how things were, and plays the past.

import { duration } from './format.js';
import { css } from './palette.js';
import { SERIES } from './store.js';

const LIVE = 1000;       // Of the slider's steps: its right end.
const PLAY_INTERVAL_MS = 100;

export class Timeline {
  constructor(elements, store, send) {
    Object.assign(this, { elements, store, send });
    this.isAsked = false;      // A question is under way.
    this.wanted = null;        // The time to ask for next [us].
    this.isPlaying = false;
    elements.slider.max = LIVE;
    elements.slider.addEventListener('input', () => this.onSlide());
    elements.play.addEventListener('click', () => this.togglePlay());
    elements.live.addEventListener('click', () => this.goLive());
    store.addEventListener('arrived', ({ detail }) => this.onArrived(detail));
    setInterval(() => this.playOn(), PLAY_INTERVAL_MS);
    new ResizeObserver(() => this.draw()).observe(elements.marks);
  }

  get span() {
    const first = this.store.firstTime;
    return { first, last: Math.max(this.store.newestTime, first + 1) };
  }

  onSlide() {
    const { first, last } = this.span;
    const step = Number(this.elements.slider.value);
    if (step >= LIVE) return this.goLive();
    this.pause();
    this.goTo(first + (last - first) * step / LIVE);
  }

  goTo(t) {
    const { first, last } = this.span;
    if (t >= last) return this.goLive();
    this.wanted = Math.max(first, t);
    this.ask();
  }

  ask() {
    if (this.isAsked || this.wanted === null) return;
    this.isAsked = this.send({ k: 'at', t: this.wanted });
    if (this.isAsked) this.wanted = null;
  }

  onArrived(past) {
    this.isAsked = false;
    if (this.isLeaving) {
      this.isLeaving = false;
      return;
    }
    this.store.showPast(past);
    this.ask();
  }

  /** The server is another one: it knows nothing of questions. */
  forget() {
    this.isAsked = this.isLeaving = false;
    this.wanted = null;
  }

  goLive() {
    this.pause();
    this.wanted = null;
    this.isLeaving = this.isAsked;
    this.store.showLive();
  }

  /** Seconds back or forward. */
  step(seconds) {
    this.pause();
    const now = this.store.past?.t ?? this.store.newestTime;
    this.goTo(now + 1e6 * seconds);
  }

  togglePlay() {
    if (this.isPlaying) return this.pause();
    this.isPlaying = true;
    this.isLeaving = false;
    if (!this.store.past) this.goTo(this.span.first);
    this.show();
  }

  pause() {
    this.isPlaying = false;
    this.show();
  }

  playOn() {
    if (!this.isPlaying || this.isAsked || !this.store.past) return;
    this.goTo(this.store.past.t + 1000 * PLAY_INTERVAL_MS * Number(this.elements.speed.value));
  }

  /** Brings what stands on the page up to date. */
  show() {
    const { first, last } = this.span;
    const { past } = this.store;
    const t = past?.t ?? last;
    const { elements } = this;
    if (document.activeElement !== elements.slider || past === null || this.isPlaying) {
      elements.slider.value = past ? LIVE * (t - first) / (last - first) : LIVE;
    }
    elements.slider.style.setProperty('--at', `${100 * (t - first) / (last - first)}%`);
    const text = duration((t - first) / 1e6);
    elements.slider.setAttribute('aria-valuetext', past ? `at ${text}` : 'now');
    elements.now.textContent = text;
    elements.total.textContent = duration((last - first) / 1e6);
    elements.play.dataset.state = this.isPlaying ? 'playing' : 'paused';
    elements.play.setAttribute('aria-label', this.isPlaying ? 'Pause the replay' : 'Replay the run');
    elements.live.setAttribute('aria-pressed', String(!past));
  }

  setTheme(theme) {
    this.theme = theme;
    this.draw();
  }

  /** Closures as marks along the run. */
  draw() {
    const canvas = this.elements.marks;
    const ratio = window.devicePixelRatio;
    const width = canvas.width = Math.round(canvas.clientWidth * ratio);
    const height = canvas.height = Math.round(canvas.clientHeight * ratio);
    if (!this.theme || width === 0) return;
    const context = canvas.getContext('2d');
    const { first, last } = this.span;
    let before = null;
    for (const sample of this.store.samples()) {
      const x = Math.round(width * (sample[SERIES.t] - first) / (last - first));
      for (const [column, colour, from] of [[SERIES.full, this.theme.full, 0], [SERIES.partial, this.theme.partial, 0.5]]) {
        if (before && sample[column] > before[column]) {
          context.fillStyle = css(colour);
          context.fillRect(x, from * height, Math.max(1, Math.round(1.5 * ratio)), height / 2 - ratio);
        }
      }
      before = sample;
    }
  }
}
