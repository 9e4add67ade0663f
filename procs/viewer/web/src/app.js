import 'uplot/dist/uPlot.min.css';
import './app.css';

import * as THREE from 'three';

import { Connection } from './connection.js';
import { css, THEMES } from './palette.js';
import { showCounts, showFacts, showHealth, showScale } from './panels.js';
import { Plots } from './plots.js';
import { COLOUR_BY, Scene } from './scene.js';
import { Store } from './store.js';
import { Timeline } from './timeline.js';

const WORDS_INTERVAL_MS = 250;  // Words change no oftener than they can be read.
const PLOTS_INTERVAL_MS = 1000;
const TOAST_MS = 3500;
const $ = (id) => document.getElementById(id);

const store = new Store();
const scene = new Scene($('canvas'), $('labels'), store);
const connection = new Connection((frame) => store.take(frame));
const timeline = new Timeline({
  slider: $('slider'), play: $('play'), live: $('live'), speed: $('speed'), now: $('now'),
  total: $('total'), marks: $('marks'),
}, store, (message) => connection.send(message));
const plots = new Plots($('plots'), store, (t) => { timeline.pause(); timeline.goTo(t); });

// Themes.

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  localStorage.setItem('vogmap.theme', name);
  const theme = THEMES[name];
  for (const swatch of document.querySelectorAll('[data-colour]')) {
    swatch.style.setProperty('--swatch', css(theme[swatch.dataset.colour]));
  }
  const style = getComputedStyle(document.documentElement);
  const ink = (variable) => style.getPropertyValue(variable).trim();
  scene.setTheme(name);
  timeline.setTheme(theme);
  plots.setTheme(theme, { soft: ink('--soft'), rule: ink('--rule'), strong: ink('--ink') });
}

function otherTheme() {
  setTheme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
}

// Layers.

const boxes = [...document.querySelectorAll('[data-layer]')];

function applyLayers() {
  scene.setLayers(Object.fromEntries(boxes.map((box) => [box.dataset.layer, box.checked])));
}

function toggleLayer(name) {
  const box = boxes.find(({ dataset }) => dataset.layer === name);
  box.checked = !box.checked;
  applyLayers();
}

function setColourBy(what) {
  $('colour-by').value = what;
  scene.setColourBy(what);
  showScale($('scale'), scene.scale);
}

// What stands on the page.

let wordsAt = 0, plotsAt = 0, hasNews = true;

function showConnection() {
  const { state } = connection;
  const source = store.hello?.source ?? 'live';
  const [shown, text] = state === 'locked' ? ['locked', 'Locked']
    : state === 'closed' ? ['closed', 'Connection lost, trying again']
      : state !== 'open' ? ['connecting', 'Connecting']
        : store.past ? ['past', 'Looking back']
          : { live: ['live', 'Live'], log: ['past', 'Log'], map: ['past', 'Map'] }[source];
  $('connection').dataset.state = shown;
  $('connection').textContent = text;
  $('live').textContent = source === 'live' ? 'Live' : 'End';
  document.querySelector('footer').hidden = source === 'map';
}

function showWords() {
  showConnection();
  showFacts($('facts'), store);
  showHealth($('health'), store);
  showCounts(store, scene);
  showScale($('scale'), scene.scale);
  timeline.show();
  const { mission } = store.shown;
  $('mission-state').hidden = !mission?.state;
  $('mission-state').textContent = mission?.state ?? '';
  $('run-name').textContent = store.hello?.name ?? '';
  document.title = store.hello ? `${store.hello.name} · Vogmap` : 'Vogmap';
  $('loading').hidden = store.loading >= 1;
  $('loading').firstElementChild.value = store.loading;
  $('loading').lastElementChild.textContent = `Reading the log, ${Math.floor(100 * store.loading)} %`;
  const isEmpty = connection.state === 'open' && store.submaps.size === 0 && !store.live.estimate && store.loading >= 1;
  $('empty').hidden = !isEmpty;
  $('empty').firstElementChild.textContent = 'Nothing heard yet';
  $('empty').lastElementChild.textContent = 'The picture appears as soon as the processes speak.';
  $('operator').hidden = !store.operators || connection.state !== 'open';
}

function keepUp() {
  const now = performance.now();
  if (now - wordsAt >= WORDS_INTERVAL_MS) {
    wordsAt = now;
    showWords();
  }
  if (hasNews && now - plotsAt >= PLOTS_INTERVAL_MS) {
    plotsAt = now;
    hasNews = false;
    plots.update();
    timeline.draw();
  }
}

scene.onChanges = (changes) => {
  if (changes.has('all') || changes.has('series')) hasNews = true;
  // Where the slider stands is seen at once.
  if (changes.has('all')) {
    plotsAt = 0;
    wordsAt = 0;
  }
};

let toastTimer;
function tell(text) {
  $('toast').textContent = text;
  $('toast').classList.add('on');
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => $('toast').classList.remove('on'), TOAST_MS);
}

// Commands.

async function confirmed(title, text) {
  const dialog = $('confirm');
  dialog.querySelector('h2').textContent = title;
  dialog.querySelector('p').textContent = text;
  dialog.returnValue = 'cancel';
  dialog.showModal();
  await new Promise((done) => dialog.addEventListener('close', done, { once: true }));
  return dialog.returnValue === 'ok';
}

async function command(name) {
  if (name === 'abort' && !await confirmed('Abort the mission?',
    'The vehicle stops where it is, and the mission cannot be resumed.')) return;
  if (!connection.send({ k: 'command', command: name })) tell('Not sent: no connection');
}

async function askToken() {
  const dialog = $('token');
  if (dialog.open) return;
  dialog.showModal();
  await new Promise((done) => dialog.addEventListener('close', done, { once: true }));
  connection.useToken($('token-text').value);
}

// Views.

const VIEWS = [new THREE.Vector3(0, -0.001, 1), new THREE.Vector3(0, -1, 0.04), new THREE.Vector3(-0.62, -0.7, 0.62)];
let view = 2;

function setView(index) {
  view = index;
  scene.framed = true;
  scene.frameAll();
  scene.lookFrom(VIEWS[index].clone().normalize());
}

function setFollowing(isOn) {
  scene.following = isOn;
  $('follow').setAttribute('aria-pressed', String(isOn));
  if (isOn) scene.placeVehicle();
  scene.requestDraw();
}

// Hands on it.

const KEYS = {
  ' ': () => timeline.togglePlay(),
  ArrowLeft: (event) => timeline.step(event.shiftKey ? -60 : -10),
  ArrowRight: (event) => timeline.step(event.shiftKey ? 60 : 10),
  l: () => timeline.goLive(),
  h: () => scene.frameAll(),
  f: () => setFollowing(!scene.following),
  1: () => setView(0), 2: () => setView(1), 3: () => setView(2),
  c: () => setColourBy(COLOUR_BY[(COLOUR_BY.indexOf(scene.colourBy) + 1) % COLOUR_BY.length]),
  s: () => toggleLayer('submaps'), g: () => toggleLayer('graph'), r: () => toggleLayer('rejected'),
  p: () => toggleLayer('plan'),
  t: otherTheme,
  '?': () => $('help').showModal(),
};

document.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog[open]')) return;
  if (event.target.matches('input:not([type=checkbox], [type=range]), select')) return;
  if (event.key === ' ' && event.target.matches('button, input')) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (!KEYS[key]) return;
  event.preventDefault();
  KEYS[key](event);
});

for (const box of boxes) box.addEventListener('change', applyLayers);
for (const button of document.querySelectorAll('[data-command]')) {
  button.addEventListener('click', () => command(button.dataset.command));
}
for (const tab of document.querySelectorAll('[data-panel]')) {
  tab.addEventListener('click', () => {
    for (const other of document.querySelectorAll('[data-panel]')) {
      const isOpen = other === tab && !$(other.dataset.panel).classList.contains('open');
      $(other.dataset.panel).classList.toggle('open', isOpen);
      other.setAttribute('aria-pressed', String(isOpen));
    }
  });
}
$('colour-by').addEventListener('change', () => setColourBy($('colour-by').value));
$('theme').addEventListener('click', otherTheme);
$('help-open').addEventListener('click', () => $('help').showModal());
$('fit').addEventListener('click', () => scene.frameAll());
$('top').addEventListener('click', () => setView((view + 1) % VIEWS.length));
$('follow').addEventListener('click', () => setFollowing(!scene.following));
connection.addEventListener('state', () => {
  if (connection.state === 'locked') askToken();
  if (connection.state === 'closed') timeline.forget();
  showConnection();
});
store.addEventListener('told', ({ detail }) => tell(detail));

const asked = new URLSearchParams(location.search).get('theme') ?? localStorage.getItem('vogmap.theme');
const prefersLight = window.matchMedia('(prefers-color-scheme: light)').matches;
setTheme(asked in THEMES ? asked : prefersLight ? 'light' : 'dark');
applyLayers();
setInterval(keepUp, WORDS_INTERVAL_MS / 2);

// For those who look from outside: tests, and the console.
window.vogmap = { store, scene, connection, timeline };
