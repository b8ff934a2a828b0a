// What a page of several runs says of them: their names above, a card each beneath the view, figures with differences below.
import { colour_of } from './data.js';
import { element, name_of, section, text_of } from './tables.js';

// Figures that are told by how many times they are the first's; the others by their difference.
const kRatios = new Set(['nodes', 'elements', 'solved_nodes', 'harmonics', 'dt_s', 'total', 'work_ms', 'real_time_factor', 'ms_per_sim_s']);
const kTitles = {
  total: 'time it took', real_time_factor: 'speed over real time', dt_s: 'substep', error_rms_l0: 'error of the signals',
  estimated_error_length: 'estimated error', max_error_length: 'error that was asked for', work_saved: 'work saved', work_ms: 'counted work a frame',
};
// Of a card: what was set and cost, and what came out.
const kSettings = ['body.nodes', 'accuracy.method', 'accuracy.dt_s', 'signals.harmonics', 'accuracy.estimated_error_length', 'timing_s.total'];
const kOutcome = ['replay.duration_s', 'replay.clip_shape_rms_length', 'replay.drift_per_cycle_length', 'replay.travel_per_cycle_length', 'replay.travel_length'];

const key_of = (figure) => figure.split('.').pop();
const unit_key = (figure) => ({ total: '_s', work_ms: '_ms' })[key_of(figure)] ?? key_of(figure);
const title_of = (figure) => kTitles[key_of(figure)] ?? name_of(key_of(figure));
const is_known = (value) => value !== null && value !== undefined;

/** How a figure differs from the first run's: '× 0.1', '+0.2 % L'; empty where it does not or cannot. */
export function change_of(figure, first, value) {
  if (typeof first !== 'number' || typeof value !== 'number' || first === value) return '';
  if (kRatios.has(key_of(figure))) return first === 0 ? '' : `× ${Number((value / first).toPrecision(2))}`;
  return `${value > first ? '+' : '−'}${text_of(unit_key(figure), Math.abs(value - first))}`;
}

export const title_of_comparison = ({ runs }) => runs.map((run) => run.name).join(', ');

/** The clips that are played, each once. */
export function subtitle_of_comparison({ runs }) {
  const played = runs.map(({ source }) => [source.file?.split('/').pop(), source.clip].filter(Boolean).join(', '));
  return [...new Set(played)].join(' · ');
}

/** One sentence on those that fell or diverged; null where none did. */
export function verdict_of_comparison({ runs }) {
  const falls = runs.filter(({ figures }) => figures['replay.fell'] || figures['replay.diverged']);
  if (falls.length === 0) return null;
  return falls.map(({ name, figures }) => {
    const cause = figures['replay.fall_cause'] ?? figures['replay.diverged_cause'] ?? 'no cause was found';
    return figures['replay.fell'] ? `${name} fell at ${text_of('_s', figures['replay.fall_time_s'])}: ${cause}.` : `${name} diverged: ${cause}.`;
  }).join(' ');
}

function distance_sentence(distance, first) {
  if (!distance.comparable) return `Its skin is not held against that of ${first}: ${distance.reason}.`;
  const percent = (value) => text_of('_length', value);
  return `Its skin is ${percent(distance.rms_length)} from that of ${first} (RMS over ${text_of('_s', distance.duration_s)}), ` +
    `${percent(distance.most_length)} at most; ${percent(distance.shape_rms_length)} without place and turn.`;
}

/** A card for each run: what it was made with, what came out, how far it is from the first. */
export function add_cards(parent, { runs, distances }) {
  const cards = element(parent, 'div', 'cards');
  runs.forEach(({ name, figures }, rank) => {
    const card = element(cards, 'section', 'card');
    element(card, 'h2', 'legend_entry', name).style.setProperty('--mark', colour_of('other', rank));
    for (const keys of [kSettings, kOutcome]) {
      const list = element(card, 'dl');
      for (const key of keys.filter((known) => is_known(figures[known]))) {
        element(list, 'dt', '', title_of(key));
        element(list, 'dd', '', text_of(unit_key(key), figures[key]));
      }
    }
    if (figures['replay.fell'] || figures['replay.diverged']) element(card, 'p', 'is_bad', figures['replay.fell'] ? 'It fell.' : 'It diverged.');
    if (rank > 0) element(card, 'p', '', distance_sentence(distances[rank - 1], runs[0].name));
  });
}

/** All figures, a column for each run, and beside each but the first how it differs from that. */
export function add_differences(parent, { runs }) {
  const table = element(section(parent, `Figures, and how they differ from those of ${runs[0].name}`), 'table', 'differences');
  const head = element(element(table, 'thead'), 'tr');
  element(head, 'th');
  runs.forEach(({ name }, rank) => {
    element(head, 'th', 'legend_entry', name).style.setProperty('--mark', colour_of('other', rank));
    if (rank > 0) element(head, 'th', '', 'difference');
  });
  const body = element(table, 'tbody');
  for (const [figure, first] of Object.entries(runs[0].figures)) {
    const row = element(body, 'tr');
    element(row, 'th', '', title_of(figure)).title = figure;
    runs.forEach(({ figures }, rank) => {
      const value = figures[figure];
      const cell = element(row, 'td', '', text_of(unit_key(figure), value));
      cell.classList.toggle('is_bad', value === true);
      if (rank > 0) element(row, 'td', 'faint', change_of(figure, first, value));
    });
  }
}
