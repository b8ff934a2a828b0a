// The report's figures as tables.

const kUnits = [
  ['_rms_length', 100, '% L'], ['_per_cycle_length', 100, '% L'], ['_length', 100, '% L'], ['_max_size', 100, '% D'], ['_size', 100, '% D'],
  ['_l0', 100, '% l0'], ['_mgl', 1, 'mgL'], ['_mg', 1, 'mg'], ['_deg_per_cycle', 1, 'deg'], ['_m_s', 1, 'm/s'], ['_kg', 1, 'kg'], ['_pa', 1, 'Pa'],
  ['_hz', 1, 'Hz'], ['_ms_per_sim_s', 1, 'ms/s'], ['_ms', 1, 'ms'], ['_time_factor', 1, '×'], ['_m', 1, 'm'], ['_s', 1, 's'],
];
const kShares = new Set(['saturated', 'max_strain', 'p95_strain', 'limit', 'volume_error_max', 'volume_error_end', 'volume_error_rms', 'feedback_rms', 'correction_rms', 'correction_buzz_rms', 'style_range', 'style_range_least', 'work_saved']);
const kNames = {
  clip_shape_rms_length: 'shape against the imported clip', shape_rms_length: 'shape against the target',
  world_rms_length: 'position against the target', drift_per_cycle_length: 'drift a cycle', heading_deg_per_cycle: 'heading a cycle',
  travel_per_cycle_length: 'travel a cycle', clip_travel_per_cycle_length: 'travel of the clip', slip_per_stance_length: 'slip a stance',
  held_slip_per_stance_length: 'of it, where the target holds',
  sole_gap_length: 'sole gap', penetration_max_size: 'deepest penetration', self_penetration_max_size: 'deepest in itself', volume_error_max: 'volume error, greatest',
  momentum_residual_mg: 'momentum unaccounted for', angular_residual_mgl: 'angular momentum unaccounted for',
  external_assist_mg: 'assist from outside', feedback_rms: 'all feedback', correction_rms: 'correction', correction_buzz_rms: 'of it, faster than 10 Hz',
  style_range: 'swing against the clip', style_range_least: 'swing of the stiffest limb', real_time_factor: 'speed over real time', duration_s: 'duration',
  fell: 'fell', fall_time_s: 'time of the fall', fall_cause: 'cause of the fall', apex_rise_length: 'highest rise of the COM',
  clip_apex_rise_length: 'highest rise in the clip', diverged_time_s: 'time at which it diverged', diverged_cause: 'what was seen then',
  energy_start_mgl: 'energy at the start', energy_end_mgl: 'energy at the end', work_mgl: 'work done on the body',
  energy_excess_mgl: 'energy beyond start and work, greatest', volume_error_end: 'volume error at the end',
  travel_length: 'travel of the COM', ms_per_sim_s: 'computing for a second',
  inverted_elements: 'inverted elements, most', inverted_elements_end: 'inverted elements at the end', guard_steps: 'steps by the guard',
};

export function element(parent, tag, name, text) {
  const made = parent.appendChild(document.createElement(tag));
  if (name) made.className = name;
  if (text !== undefined) made.textContent = text;
  return made;
}

function number(value) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e7) return value.toExponential(1);
  if (Number.isInteger(value)) return value.toLocaleString('en');
  return size >= 1000 ? Math.round(value).toLocaleString('en') : String(Number(value.toPrecision(3)));
}

/** Ticks of an axis with as many digits behind the point as tell one step from the next. */
export function tick_texts(ticks, step) {
  let digits = 0;
  while (digits < 12 && Math.abs(step * 10 ** digits - Math.round(step * 10 ** digits)) > 1e-6 * step * 10 ** digits) ++digits;
  return ticks.map((tick) => tick.toLocaleString('en', { minimumFractionDigits: digits, maximumFractionDigits: digits }));
}

function unit_of(key) {
  if (kShares.has(key)) return ['', 100, '%'];
  return kUnits.find(([ending]) => `_${key}`.endsWith(ending)) ?? ['', 1, ''];
}

export function name_of(key) {
  const ending = unit_of(key)[0];
  return kNames[key] ?? (ending ? `_${key}`.slice(1, 1 + key.length + 1 - ending.length) || key : key).replaceAll('_', ' ');
}

export function text_of(key, value) {
  if (value === null || value === undefined) return '–';
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (typeof value === 'string') return value || '–';
  const [, factor, unit] = unit_of(key);
  return `${number(value * factor)}${unit ? ` ${unit}` : ''}`;
}

export function section(parent, title) {
  const made = element(parent, 'section', 'card');
  element(made, 'h2', '', title);
  return made;
}

/** Naive, open loop and closed loop side by side. */
function add_metrics(parent, replay) {
  if (!replay) return;
  const runs = [['naive', 'naive'], ['open_loop', 'open loop'], ['closed_loop', 'closed loop']];
  const keys = Object.keys(replay.closed_loop ?? replay.open_loop ?? replay.naive ?? {});
  if (keys.length === 0) return;
  const table = element(section(parent, 'The free replay'), 'table', 'metrics');
  const head = element(element(table, 'thead'), 'tr');
  element(head, 'th');
  for (const [key, label] of runs) element(head, 'th', `of_${key}`, label);
  const body = element(table, 'tbody');
  for (const key of keys) {
    if (key === 'fall_cause' && runs.every(([run]) => !replay[run]?.fall_cause)) continue;
    const row = element(body, 'tr');
    element(row, 'th', '', name_of(key)).title = key;
    for (const [run] of runs) {
      const cell = element(row, 'td', '', text_of(key, replay[run]?.[key]));
      cell.classList.toggle('is_bad', key === 'fell' && replay[run]?.fell === true);
      cell.classList.toggle('words', key === 'fall_cause');
    }
  }
}

function add_effects(parent, effects) {
  if (effects.length === 0) return;
  const table = element(section(parent, 'Effects'), 'table', 'effects');
  const head = element(element(table, 'thead'), 'tr');
  for (const title of ['effect', 'state', 'why', 'cost']) element(head, 'th', '', title);
  const body = element(table, 'tbody');
  for (const effect of effects) {
    const row = element(body, 'tr', effect.state === 'off' ? 'faint' : '');
    element(row, 'th', '', effect.name.replaceAll('_', ' '));
    element(row, 'td', '', effect.state);
    element(row, 'td', 'words', effect.reason);
    element(row, 'td', '', effect.ms_per_sim_s > 0 ? text_of('_ms_per_sim_s', effect.ms_per_sim_s) : '–');
  }
}

function add_group(parent, title, group) {
  const table = element(section(parent, title), 'table');
  for (const [key, value] of Object.entries(group)) {
    if (value === undefined || (value === null && key.startsWith('diverged_'))) continue;
    const row = element(table, 'tr');
    element(row, 'th', '', name_of(key)).title = key;
    const cell = element(row, 'td', '', text_of(key, value));
    if (key === 'sha256') cell.classList.add('hash');
  }
}

function add_timing(parent, timing) {
  const table = element(section(parent, 'Time spent'), 'table', 'timing');
  for (const [stage, seconds] of Object.entries(timing)) {
    const row = element(table, 'tr', stage === 'total' ? 'total' : '');
    element(row, 'th', '', stage.replaceAll('_', ' '));
    const cell = element(row, 'td', 'bar_cell');
    if (stage !== 'total' && timing.total > 0) element(cell, 'span', 'bar').style.width = `${(100 * seconds) / timing.total}%`;
    element(row, 'td', '', text_of('_s', seconds));
  }
}

/** Error against time of what was tried; empty where no accuracy was asked for. */
function add_accuracy(parent, svg) {
  if (svg) element(section(parent, 'Accuracy against time'), 'div').innerHTML = svg;
}

export function add_tables(parent, report, accuracy_svg) {
  const main = element(parent, 'div');
  const details = element(parent, 'div', 'details');
  if (report.warnings.length > 0) {
    const list = element(section(main, 'Warnings'), 'ul', 'warnings');
    for (const warning of report.warnings) element(list, 'li', '', warning);
  }
  add_metrics(main, report.replay);
  add_accuracy(main, accuracy_svg);
  if (report.simulation) add_group(main, 'The simulation', report.simulation);
  add_effects(main, report.effects);
  add_timing(main, report.timing_s);
  const groups = [
    ['Preparation of the target', report.preparation], ['Inverse dynamics', report.inverse], ['Signals', report.signals],
    ['Body', { ...report.body, coupling_error_rms_length: report.coupling?.error_rms_length }], ['Accuracy', report.accuracy],
    ['Source', report.source],
  ];
  for (const [title, group] of groups) {
    if (group) add_group(details, title, group);
  }
}

/** What to say above everything: null when the run did what was asked. */
export function verdict(report) {
  if (report.simulation?.diverged) return `The simulation diverged: ${report.simulation.diverged_cause}.`;
  const run = report.replay?.closed_loop;
  if (run?.fell) return `The replay fell at ${text_of('_s', run.fall_time_s)}: ${run.fall_cause || 'no cause was found'}.`;
  if (!report.outcome_ok) return 'The outcome is short of what was asked: see the warnings below.';
  return null;
}
