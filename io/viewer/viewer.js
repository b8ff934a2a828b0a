// The report page: builds it around the data that it carries, and keeps the one time that view and diagrams share.
import 'uplot/dist/uPlot.min.css';
import './viewer.css';

import { add_charts } from './charts.js';
import { add_cards, add_differences, subtitle_of_comparison, title_of_comparison, verdict_of_comparison } from './comparison.js';
import { mark_of, read_page } from './data.js';
import { Stage } from './stage.js';
import { add_tables, verdict } from './tables.js';

const page = read_page();
const report = page.report;

document.body.insertAdjacentHTML('beforeend', `
  <header>
    <h1></h1><span class="faint" id="subtitle"></span>
    <button id="theme" title="dark or light">◐</button>
  </header>
  <p id="banner" role="alert" hidden></p>
  <main>
    <div id="left">
      <div id="view"><canvas tabindex="0"></canvas><div id="scale" class="faint"></div></div>
      <div id="transport">
        <button id="play" title="play or pause (space)">▶</button>
        <input id="scrub" type="range" min="0" step="0.001" aria-label="time">
        <output id="clock"></output>
        <select id="speed" title="speed">
          <option value="0.1">0.1 ×</option><option value="0.25">¼ ×</option><option value="0.5">½ ×</option>
          <option value="1" selected>1 ×</option><option value="2">2 ×</option>
        </select>
      </div>
      <div id="switches">
        <span class="group" id="shown"></span>
        <span class="group" id="arrangement">
          <label><input type="radio" name="view" value="overlay" checked>overlaid</label>
          <label><input type="radio" name="view" value="side">side by side</label>
        </span>
        <span class="group">
          <label><input type="checkbox" id="follow" checked>follow</label>
          <label><input type="checkbox" id="mesh">springs</label>
        </span>
      </div>
      <div id="contacts"></div>
    </div>
    <div id="charts"></div>
  </main>
  <div id="tables"></div>`);

const find = (id) => document.getElementById(id);
const longest = (motions) => Math.max(0, ...motions.map((motion) => motion.duration_s));
const end = longest(page.motions.filter((motion) => motion.role === 'replay')) || longest(page.motions) || 1;
const state = { t: 0, playing: false, speed: 1 };

function title_of_report() {
  const file = report.source.file.split('/').pop();
  return report.source.clip || (report.simulation && file.replace(/\.toml$/, '').replaceAll('_', ' ')) || 'motion';
}

const subtitle_of_report = () =>
  [report.source.file, `${report.body.nodes} nodes`, report.signals?.kind.replaceAll('_', ' '), report.accuracy.method].filter(Boolean).join(' · ');

function say_what_this_is() {
  const { comparison } = page;
  const name = comparison ? title_of_comparison(comparison) : title_of_report();
  document.title = `${name} – hydrostat`;
  document.querySelector('h1').textContent = name;
  find('subtitle').textContent = comparison ? subtitle_of_comparison(comparison) : subtitle_of_report();
  const trouble = comparison ? verdict_of_comparison(comparison) : verdict(report);
  find('banner').hidden = trouble === null;
  find('banner').textContent = trouble ?? '';
}

/** The view, or null where the browser has no WebGL; the rest of the page does without. */
function make_stage() {
  try {
    return new Stage(document.querySelector('#view canvas'), page);
  } catch (reason) {
    find('view').textContent = `This browser shows no 3D view (${reason.message}).`;
    find('view').classList.add('is_empty');
    return null;
  }
}

say_what_this_is();
const stage = make_stage();
const charts = add_charts({ charts: find('charts'), contacts: find('contacts') }, page, end, set_time);
if (page.comparison) {
  add_cards(find('contacts'), page.comparison);
  add_differences(find('tables'), page.comparison);
} else {
  add_tables(find('tables'), report, page.accuracy_svg);
}

function set_time(t) {
  state.t = Math.min(Math.max(0, t), end);
  find('scrub').value = state.t;
  find('clock').textContent = `${state.t.toFixed(2)} / ${end.toFixed(2)} s`;
  stage?.show(state.t);
  for (const chart of charts) chart.show(state.t);
}

function set_playing(playing) {
  state.playing = playing;
  find('play').textContent = playing ? '❚❚' : '▶';
  if (!playing) return;
  let before = performance.now();
  requestAnimationFrame(function tick(now) {
    if (!state.playing) return;
    const next = state.t + (state.speed * Math.max(0, now - before)) / 1000;
    before = now;
    set_time(next > end ? 0 : next);
    requestAnimationFrame(tick);
  });
}

function set_view(view) {
  for (const choice of document.querySelectorAll('[name=view]')) choice.checked = choice.value === view;
  stage?.set_view(view);
}

function set_theme(theme) {
  document.documentElement.dataset.theme = theme;
  const css = getComputedStyle(document.documentElement);
  const colour = (name) => css.getPropertyValue(name).trim();
  stage?.set_theme({ background: colour('--sky'), floor: colour('--floor'), grid: colour('--lines') });
  for (const chart of charts) chart.redraw();
}

function add_body_switches() {
  for (const body of stage?.bodies ?? []) {
    const { label, colour } = mark_of(body.motion);
    const entry = document.createElement('label');
    const box = Object.assign(document.createElement('input'), { type: 'checkbox', checked: body.visible });
    entry.className = 'legend_entry';
    entry.style.setProperty('--mark', colour);
    entry.append(box, label);
    box.onchange = () => {
      body.visible = box.checked;
      set_time(state.t);
    };
    find('shown').append(entry);
  }
}

/** What there is but one of needs no arrangement. */
function hide_what_has_no_use() {
  const hide = (element) => element.style.setProperty('display', 'none');
  if (page.motions.length < 2) hide(find('arrangement'));
  if (stage?.whole) hide(find('follow').parentElement);
}

function resize() {
  stage?.resize();
  for (const chart of charts) chart.resize();
  set_time(state.t);
}

function read_address() {
  const wish = new URLSearchParams(location.hash.slice(1));
  if (wish.has('theme')) set_theme(wish.get('theme'));
  if (wish.has('view')) set_view(wish.get('view') === 'side' ? 'side' : 'overlay');
  if (wish.has('mesh') && stage) stage.shows_mesh = find('mesh').checked = wish.get('mesh') === '1';
  const t = Number.parseFloat(wish.get('t'));
  if (Number.isFinite(t)) {
    set_playing(false);
    set_time(t);
  }
  return Number.isFinite(t);
}

find('scrub').max = end;
if (stage) find('scale').textContent = !page.has_ground ? '' : `grid ${stage.grid_step} m and ${stage.grid_step / 10} m`;
find('scrub').oninput = () => {
  set_playing(false);
  set_time(Number(find('scrub').value));
};
find('play').onclick = () => set_playing(!state.playing);
find('speed').onchange = () => (state.speed = Number(find('speed').value));
find('theme').onclick = () => {
  set_theme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  set_time(state.t);
};
find('follow').onchange = () => stage && (stage.follows = find('follow').checked);
find('mesh').onchange = () => {
  if (stage) stage.shows_mesh = find('mesh').checked;
  set_time(state.t);
};
for (const choice of document.querySelectorAll('[name=view]')) {
  choice.onchange = () => {
    set_view(choice.value);
    set_time(state.t);
  };
}
document.addEventListener('keydown', (event) => {
  if (event.target.matches('select, input:not([type=range]), button') || event.ctrlKey || event.metaKey || event.altKey) return;
  const step = { ArrowLeft: -1 / 60, ArrowRight: 1 / 60 }[event.key];
  if (event.key !== ' ' && step === undefined) return;
  event.preventDefault();
  if (event.key === ' ') return set_playing(!state.playing);
  set_playing(false);
  set_time(state.t + step);
});
window.addEventListener('hashchange', read_address);

add_body_switches();
hide_what_has_no_use();
set_theme(matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
resize();
if (stage) set_view(page.comparison ? 'side' : 'overlay');
const has_time = read_address();
resize();
new ResizeObserver(resize).observe(find('left'));
if (!has_time) set_playing(true);
