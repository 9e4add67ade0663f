// The words beside the picture.

import { duration, length, number } from './format.js';
import { EDGE } from './frames.js';
import { cssRamp } from './palette.js';
import { SERIES } from './store.js';

const SILENT_AFTER_MS = 3000;
const SILENT_AFTER_US = 3e6;

const END_REASONS = {
  nothing_to_gain: 'nothing left to gain', max_submaps: 'all submaps used', max_duration: 'time used up',
  max_distance: 'distance used up', stuck: 'stuck', go_home: 'sent home', abort: 'aborted',
  end_of_log: 'the log ends',
};

function element(tag, text, className) {
  const made = document.createElement(tag);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}

export function showFacts(list, store) {
  const { mission, estimate, truth, graph, poses } = store.shown;
  const samples = store.samples();
  const sample = samples.findLast((s) => s[SERIES.t] <= store.shownTime);
  const facts = [];
  const tell = (name, value) => { if (value) facts.push([name, value]); };
  if (mission?.state) {
    const reason = END_REASONS[mission.end_reason] ?? mission.end_reason;
    tell('State', reason ? `${mission.state}: ${reason}` : mission.state);
    tell('Holds', mission.hold);
    tell('Home', mission.home && 'yes');
    const [unseen, inVain] = mission.unseen ?? [0, 0];
    tell('Left unseen', unseen && `${unseen} voxels, ${inVain} looked at in vain`);
    tell('Order refused', mission.refused);
  }
  if (poses || mission) {
    const most = store.hello?.max_submaps;
    const closed = mission?.submaps ?? poses?.places.size ?? 0;
    tell('Submaps', most ? `${closed} of ${most}` : String(closed));
  }
  if (mission?.fault) tell('Map', mission.fault);
  else if (mission?.complete) tell('Map', 'complete and saved');
  if (mission?.explored_m3) tell('Explored', `${mission.explored_m3.toFixed(0)} m³`);
  if (estimate) {
    const [x, y, z] = estimate.position;
    tell('Position', `${number(x, 1)}, ${number(y, 1)}, ${number(z, 1)} m`);
    tell('Speed', `${number(estimate.speed_m_s)} m/s`);
    const [xx, , , yy, , zz] = estimate.covariance;
    tell('Sure to (1 σ)', length(Math.sqrt(Math.max(0, xx + yy + zz))));
    if (truth) tell('True error', length(Math.hypot(...estimate.position.map((p, i) => p - truth.position[i]))));
  }
  if (graph) {
    const count = (kind) => graph.edges.filter((edge) => edge.kind === kind).length;
    tell('Closures', `${count(EDGE.full)} full, ${count(EDGE.partial)} partial`);
    tell('Rejected', String(count(EDGE.rejected)));
  }
  if (mission?.plans) {
    const took = sample?.[SERIES.planning];
    tell('Plans', took === null || took === undefined ? String(mission.plans)
      : `${mission.plans}, last in ${took < 1 ? `${Math.round(1000 * took)} ms` : `${took.toFixed(1)} s`}`);
  }
  list.replaceChildren(...facts.flatMap(([name, value]) => [element('dt', name), element('dd', value)]));
}

function healthOf(process, store) {
  const heard = store.heardAt.get(process.name);
  const isLive = !store.past && store.hello?.source === 'live';
  const silentFor_s = isLive ? (performance.now() - (heard?.at ?? 0)) / 1000
    : (Math.min(store.shownTime, store.newestTime) - process.t) / 1e6;
  const isSilent = isLive ? silentFor_s > SILENT_AFTER_MS / 1000 : silentFor_s > SILENT_AFTER_US / 1e6;
  if (isSilent) return ['silent', '✕', `silent for ${duration(silentFor_s)}`];
  if (process.health === 'ok') return ['ok', '✓', 'ok'];
  return ['waits', '!', process.health];
}

export function showHealth(list, store) {
  const processes = store.shown.health?.processes ?? [];
  list.replaceChildren(...processes.map((process) => {
    const [health, mark, what] = healthOf(process, store);
    const item = document.createElement('li');
    item.dataset.health = health;
    item.title = Object.entries(process.counters).map(([name, value]) => `${name}: ${value}`).join('\n');
    item.append(element('span', mark, 'mark'), element('span', process.name.replace(/^vog-/, '')),
      element('span', what, 'what'));
    return item;
  }));
  list.parentElement.hidden = processes.length === 0;
}

export function showScale(parent, scale) {
  if (!scale) return;
  const [low, bar, high] = parent.children;
  const text = (value) => (scale.unit === 'm' ? `${value.toFixed(2)} m`
    : value === 0 ? 'now' : `${value.toFixed(value < 10 ? 1 : 0)} ${scale.unit}`);
  low.textContent = text(scale.low);
  high.textContent = text(scale.high);
  bar.style.background = cssRamp(scale.ramp);
}

export function showCounts(store, scene) {
  const edges = store.shown.graph?.edges ?? [];
  for (const output of document.querySelectorAll('[data-edges]')) {
    output.textContent = edges.filter((edge) => edge.kind === EDGE[output.dataset.edges]).length;
  }
  const shown = [...scene.clouds.values()].filter((cloud) => cloud.visible).length;
  document.getElementById('submap-count').textContent = shown || '';
  let frontiers = 0;
  for (const { voxels } of store.frontiers.values()) frontiers += voxels.length / 3;
  document.getElementById('frontier-count').textContent = store.past ? 'now only' : frontiers || '';
}
