// Curves over time (uPlot), maps with equal axes, and the contact timeline; all carry the time cursor of the view.
import uPlot from 'uplot';

import { colour_of, doubles, floats, kRoles } from './data.js';
import { tick_texts } from './tables.js';

const kHeight = 168;
const kAxisWidth = 58; // shared by the timeline, so that its time axis stands under the curves'
const kMostLegends = 6;

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function element(parent, tag, name, text) {
  const made = parent.appendChild(document.createElement(tag));
  if (name) made.className = name;
  if (text !== undefined) made.textContent = text;
  return made;
}

const gaps = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : null));

/** Adds the legend of a chart's curves, each switching its curve through `toggle(index, shown)`. */
function add_legend(parent, curves, toggle) {
  const legend = element(parent, 'div', 'legend');
  curves.slice(0, kMostLegends).forEach((curve, index) => {
    const entry = element(legend, 'button', 'legend_entry', curve.name);
    entry.style.setProperty('--mark', colour_of(curve.role, curve.rank ?? index));
    entry.onclick = () => toggle(index, !entry.classList.toggle('is_off'));
  });
  if (curves.length > kMostLegends) element(legend, 'span', 'faint', `and ${curves.length - kMostLegends} more`);
}

class TimeChart {
  constructor(parent, chart, end, set_time) {
    this.parent = element(parent, 'figure', 'chart');
    const caption = element(this.parent, 'figcaption');
    element(caption, 'span', 'title', chart.title);
    element(caption, 'span', 'faint', chart.y_label);
    add_legend(caption, chart.curves, (index, shown) => this.plot.setSeries(index + 1, { show: shown }));
    const tables = chart.curves.map((curve) => [Array.from(doubles(curve.x)), gaps(floats(curve.y))]);
    const axis = { stroke: () => css('--faint'), grid: { stroke: () => css('--grid'), width: 1 }, ticks: { show: false }, font: '11px system-ui' };
    this.plot = new uPlot({
      width: this.parent.clientWidth || 500,
      height: kHeight,
      legend: { show: false },
      cursor: { sync: { key: 'time' }, drag: { x: true, y: false }, points: { size: 6 } },
      scales: { x: { time: false, range: (u, least, most) => (least === null ? [0, end] : [least, most]) } },
      axes: [
        { ...axis, size: 26, values: (u, ticks) => ticks.map((tick) => `${tick} s`) },
        { ...axis, size: kAxisWidth, values: (u, ticks, rank, space, step) => tick_texts(ticks, step) },
      ],
      series: [{}, ...chart.curves.map((curve, index) => ({
        label: curve.name,
        stroke: colour_of(curve.role, curve.rank ?? index),
        width: curve.role === 'replay' ? 1.8 : 1.3,
        points: { show: false },
      }))],
    }, tables.length > 0 ? uPlot.join(tables) : [[0, end]], this.parent);
    this.line = element(this.plot.over, 'div', 'time_line');
    this.plot.over.addEventListener('click', (event) => {
      if (this.plot.select.width === 0) set_time(this.plot.posToVal(event.offsetX, 'x'));
    });
  }

  show(t) {
    const left = this.plot.valToPos(t, 'x');
    this.line.style.display = left < 0 || left > this.plot.over.clientWidth ? 'none' : '';
    this.line.style.transform = `translateX(${left}px)`;
  }

  resize() {
    this.plot.setSize({ width: this.parent.clientWidth, height: kHeight });
  }

  redraw() {
    this.plot.redraw(false, true);
  }
}

/** Ticks at round numbers, about `count` of them. */
function round_ticks(least, most, count) {
  const raw = (most - least) / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => candidate >= raw);
  const ticks = [];
  for (let k = Math.ceil(least / step); k * step <= most; ++k) ticks.push(Number((k * step).toPrecision(8)));
  return ticks;
}

/** A map seen from above: equal axes, one line a curve, its start a ring. */
class MapChart {
  constructor(parent, chart) {
    this.parent = element(parent, 'figure', 'chart');
    const caption = element(this.parent, 'figcaption');
    element(caption, 'span', 'title', chart.title);
    element(caption, 'span', 'faint', `${chart.y_label} over ${chart.x_label}`);
    add_legend(caption, chart.curves, (index, shown) => {
      this.curves[index].shown = shown;
      this.redraw();
    });
    this.canvas = element(this.parent, 'canvas');
    this.curves = chart.curves.map((curve, index) => ({
      x: doubles(curve.x), y: floats(curve.y), colour: colour_of(curve.role, curve.rank ?? index), shown: true,
    }));
    this.redraw();
  }

  bounds() {
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    for (const { x, y, shown } of this.curves) {
      for (let i = 0; shown && i < x.length; ++i) {
        if (!Number.isFinite(x[i]) || !Number.isFinite(y[i])) continue;
        box[0] = Math.min(box[0], x[i]);
        box[1] = Math.max(box[1], x[i]);
        box[2] = Math.min(box[2], y[i]);
        box[3] = Math.max(box[3], y[i]);
      }
    }
    return box[0] <= box[1] ? box : [0, 1, 0, 1];
  }

  redraw() {
    const [width, height] = [this.parent.clientWidth || 500, kHeight];
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    this.canvas.style.height = `${height}px`;
    const pen = this.canvas.getContext('2d');
    pen.scale(ratio, ratio);
    pen.font = '11px system-ui';
    const [x0, x1, y0, y1] = this.bounds();
    const [inner_width, inner_height] = [width - kAxisWidth - 12, height - 34];
    const metre = 0.92 / Math.max((x1 - x0) / inner_width, (y1 - y0) / inner_height, 1e-6);
    const to_x = (x) => kAxisWidth + inner_width / 2 + (x - (x0 + x1) / 2) * metre;
    const to_y = (y) => 8 + inner_height / 2 - (y - (y0 + y1) / 2) * metre;
    this.draw_grid(pen, { to_x, to_y, metre, inner_width, inner_height, x: (x0 + x1) / 2, y: (y0 + y1) / 2 });
    for (const curve of this.curves) if (curve.shown) this.draw_curve(pen, curve, to_x, to_y);
  }

  draw_grid(pen, { to_x, to_y, metre, inner_width, inner_height, x, y }) {
    const [half_x, half_y] = [inner_width / 2 / metre, inner_height / 2 / metre];
    pen.strokeStyle = css('--grid');
    pen.fillStyle = css('--faint');
    pen.beginPath();
    const step_count = (pixels) => Math.max(2, Math.round(pixels / 55));
    pen.textAlign = 'center';
    for (const tick of round_ticks(x - half_x, x + half_x, step_count(inner_width))) {
      pen.moveTo(to_x(tick), 8);
      pen.lineTo(to_x(tick), 8 + inner_height);
      pen.fillText(`${tick}`, to_x(tick), inner_height + 24);
    }
    pen.textAlign = 'right';
    for (const tick of round_ticks(y - half_y, y + half_y, step_count(inner_height))) {
      pen.moveTo(kAxisWidth, to_y(tick));
      pen.lineTo(kAxisWidth + inner_width, to_y(tick));
      pen.fillText(`${tick}`, kAxisWidth - 6, to_y(tick) + 4);
    }
    pen.stroke();
  }

  draw_curve(pen, { x, y, colour }, to_x, to_y) {
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    pen.lineJoin = 'round';
    pen.beginPath();
    let is_down = false;
    for (let i = 0; i < x.length; ++i) {
      const is_number = Number.isFinite(x[i]) && Number.isFinite(y[i]);
      if (is_number && is_down) pen.lineTo(to_x(x[i]), to_y(y[i]));
      else if (is_number) pen.moveTo(to_x(x[i]), to_y(y[i]));
      is_down = is_number;
    }
    pen.stroke();
    if (x.length === 0) return;
    pen.beginPath();
    pen.arc(to_x(x[0]), to_y(y[0]), 3, 0, 2 * Math.PI);
    pen.stroke();
  }

  show() {}

  resize() {
    this.redraw();
  }
}

const kRowHeight = 15;

/** Contact of every patch over time: solid where it sticks, hatched pale where it slides, empty where it is off. */
class ContactTimeline {
  constructor(parent, rows, end, set_time) {
    this.rows = rows;
    this.end = end;
    this.parent = element(parent, 'figure', 'chart');
    const caption = element(this.parent, 'figcaption');
    element(caption, 'span', 'title', 'Contacts');
    const legend = element(caption, 'div', 'legend');
    for (const role of new Set(rows.map((row) => row.role))) {
      element(legend, 'span', 'legend_entry', kRoles[role]?.label ?? role).style.setProperty('--mark', colour_of(role, 0));
    }
    element(legend, 'span', 'faint', 'full: stick, pale: slide, empty: off');
    this.box = element(this.parent, 'div', 'timeline');
    this.names = element(this.box, 'div', 'timeline_names');
    this.track = element(this.box, 'div', 'timeline_track');
    this.canvas = element(this.track, 'canvas');
    this.line = element(this.track, 'div', 'time_line');
    let patch;
    for (const row of rows) {
      element(this.names, 'div', '', row.patch === patch ? '' : row.patch).style.height = `${kRowHeight}px`;
      patch = row.patch;
    }
    this.track.addEventListener('click', (event) => set_time((event.offsetX / this.track.clientWidth) * end));
    this.redraw();
  }

  redraw() {
    const [width, height] = [this.track.clientWidth || 500, this.rows.length * kRowHeight];
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    this.canvas.style.height = `${height}px`;
    const pen = this.canvas.getContext('2d');
    pen.scale(ratio, ratio);
    const pixel = width / this.end;
    this.rows.forEach((row, rank) => this.draw_row(pen, row, rank * kRowHeight, pixel));
  }

  draw_row(pen, row, top, pixel) {
    const [count, states] = [row.states.length, row.states];
    const last = row.loop ? Math.ceil(this.end * row.rate_hz) : Math.min(count, Math.ceil(this.end * row.rate_hz));
    pen.fillStyle = css('--grid');
    pen.fillRect(0, top + kRowHeight - 1, this.end * pixel, 0.5);
    pen.fillStyle = colour_of(row.role, 0);
    for (let from = 0; count > 0 && from < last; ) {
      const state = states[from % count];
      let to = from + 1;
      while (to < last && states[to % count] === state) ++to;
      pen.globalAlpha = state === 'S' ? 1 : state === 'L' ? 0.35 : 0;
      pen.fillRect((from / row.rate_hz) * pixel, top + 2, ((to - from) / row.rate_hz) * pixel, kRowHeight - 4);
      from = to;
    }
    pen.globalAlpha = 1;
  }

  show(t) {
    this.line.style.transform = `translateX(${(t / this.end) * this.track.clientWidth}px)`;
  }

  resize() {
    this.redraw();
  }
}

/** Builds all diagrams: the contact timeline under the view, the others in their own column. Returns those that were made. */
export function add_charts(places, page, end, set_time) {
  const charts = page.charts.filter((chart) => chart.curves.length > 0).map((chart) =>
    chart.over_time ? new TimeChart(places.charts, chart, end, set_time) : new MapChart(places.charts, chart));
  if (page.contacts.length > 0) charts.push(new ContactTimeline(places.contacts, page.contacts, end, set_time));
  return charts;
}
