// The tables of README that are measured, from what the program and the benchmarks wrote; samples/figures.sh calls it.
//   node figures.mjs levels|chosen|polish|peers|damping|import KEPT.csv README.md [MEASURED...]
// KEPT.csv holds what the table shows. Measured rows take the place of those of the same creature, solver, body or file; without
// any the table is written from what is kept. MEASURED: reports NAME.LEVEL.json of 'hydrostat replay --json', creatures (for 'chosen'),
// directories with a creature 'on' and one 'off' (for 'polish'), or CSV files.
//   node figures.mjs speed KEPT.txt README.md [PRINTED.txt]
// 'levels' draws its picture beside KEPT.csv, too.
import {existsSync, readFileSync, renameSync, writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';

import {write_between_marks} from './between_marks.mjs';
import {levels_svg} from './levels_svg.mjs';

const [kind, kept_file, readme, ...measured] = process.argv.slice(2);

/** Rows of a CSV file as objects; a field may stand in quotes. */
function read_csv(file) {
  const [head, ...lines] = readFileSync(file, 'utf8').trim().split('\n').map((text) =>
    [...text.matchAll(/("([^"]*)"|([^,"]*))(,|$)/g)].map((field) => field[2] ?? field[3]));
  return lines.map((fields) => Object.fromEntries(head.map((name, k) => [name, fields[k] ?? ''])));
}

function write_whole(file, text) {
  writeFileSync(`${file}.part`, text);
  renameSync(`${file}.part`, file);
}

function write_csv(file, names, rows) {
  const field = (value) => (`${value}`.includes(',') ? `"${value}"` : `${value}`);
  write_whole(file, [names, ...rows.map((row) => names.map((name) => row[name]))].map((fields) => `${fields.map(field).join(',')}\n`).join(''));
}

/** Kept rows, in their places those measured that have the same key, behind them the other ones. */
function merged(kept, fresh, key_of) {
  const keys = [...new Set([...kept, ...fresh].map(key_of))];
  const of_key = (rows, key) => rows.filter((row) => key_of(row) === key);
  return keys.flatMap((key) => (of_key(fresh, key).length ? of_key(fresh, key) : of_key(kept, key)));
}

const short = (value, digits) => (value >= 10 ** digits ? `${Math.round(value)}` : `${Number(value.toPrecision(digits))}`);
/** Two digits without a power of ten; 0 below a billionth. */
const plain = (value) => Number(value).toFixed(Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(Math.max(1e-9, value)))))).replace(/(\.\d*[1-9])0+$|\.0+$/, '$1');
const as_power = (value) => value.toExponential(1).replace(/e([+-])(\d)$/, 'e$10$2').replace('e+0', 'e').replace('e+', 'e');
const line = (cells) => `|${cells.map((cell) => (cell === '' ? ' ' : ` ${cell} `)).join('|')}|`;
const markdown = (head, rows) => [head, head.map(() => '---'), ...rows].map(line).join('\n');

/** A row of the levels' table from a report; NAME.LEVEL.json. */
function level_row(file) {
  const report = JSON.parse(readFileSync(file, 'utf8'));
  const run = report.replay.closed_loop;
  const way = run.clip_travel_per_cycle_length;
  return {
    creature: basename(file).split('.')[0], nodes: report.level.nodes, solved_nodes: report.level.solved_nodes,
    work_ms: Number(report.level.work_ms.toPrecision(4)), falls: run.fell ? 1 : 0,
    clip_shape_rms_length: run.fell ? '' : Number(run.clip_shape_rms_length.toPrecision(4)),
    way: run.fell || Math.abs(way) < 0.01 ? '' : Number((run.travel_per_cycle_length / way).toPrecision(4)),
  };
}

function levels_table(rows) {
  let creature;
  return markdown(['creature', 'nodes', 'counted work, ms a frame', 'skin from the clip, % L', "of the clip's way"], rows.map((row) => {
    const name = row.creature === creature ? '' : `\`${row.creature}\``;
    creature = row.creature;
    const nodes = Number(row.nodes) === Number(row.solved_nodes) ? `**${row.nodes}**` : row.nodes;
    const outcome = Number(row.falls) ? ['falls', ''] :
      [(100 * row.clip_shape_rms_length).toFixed(1), row.way === '' ? 'on the spot' : `${Math.round(100 * row.way)} %`];
    return [name, nodes, short(Number(row.work_ms), 2), ...outcome];
  }));
}

/** What 'hydrostat convert --max-error' chose for a creature, beside the most accurate setting that it tried. */
function chosen_row(creature) {
  const report = JSON.parse(readFileSync(join(creature, 'report.json'), 'utf8'));
  const tried = read_csv(join(creature, 'accuracy.csv'));
  const {accuracy, body, signals, replay} = report, run = replay.closed_loop;
  const most = (name) => Math.max(...tried.map((row) => Number(row[name])));
  const way = run.clip_travel_per_cycle_length;
  return {
    creature: basename(creature), max_error: accuracy.max_error_length, estimated_error: Number(accuracy.estimated_error_length.toPrecision(3)),
    method: accuracy.method, nodes: body.nodes, whole_nodes: most('nodes'), harmonics: signals.harmonics, whole_harmonics: most('harmonics'),
    ms_per_sim_s: Number(accuracy.ms_per_sim_s.toPrecision(4)), finest_ms_per_sim_s: Number(accuracy.finest_ms_per_sim_s.toPrecision(4)),
    falls: run.fell ? 1 : 0, way: run.fell || Math.abs(way) < 0.01 ? '' : Number((run.travel_per_cycle_length / way).toPrecision(4)),
  };
}

function chosen_table(rows) {
  const percent = (share) => `${short(100 * share, 2)} %`;
  return markdown(['creature', 'within', 'estimated error', 'method', 'nodes', 'harmonics', 'processor, ms a simulated second', 'the finest setting', "of the clip's way"],
    rows.map((row) => [`\`${row.creature}\``, percent(row.max_error), percent(row.estimated_error), `\`${row.method}\``, `${row.nodes} of ${row.whole_nodes}`,
      `${row.harmonics} of ${row.whole_harmonics}`, short(Number(row.ms_per_sim_s), 2), short(Number(row.finest_ms_per_sim_s), 2),
      Number(row.falls) ? 'falls' : row.way === '' ? 'on the spot' : `${Math.round(100 * row.way)} %`]));
}

function peers_table(rows) {
  const lost = (row) => (row.scene !== 'tumbling' ? '' :
    row.angular_loss < 1e-3 ? Number(row.angular_loss).toExponential(0).replace(/e-(\d)$/, 'e-0$1') : `${Math.round(100 * row.angular_loss)} %`);
  return markdown(['scene', 'tets', 'solver', 'steps/s', 'CPU ms per s', "of Bullet's at 60", 'RMS error [m]', 'angular momentum lost'],
    rows.map((row) => [row.scene, row.tets, row.solver.startsWith('Bullet') ? row.solver : `\`${row.solver}\``, row.steps_per_s,
      short(Number(row.cpu_ms_per_s), 3), Number(row.times_of_bullet_60).toFixed(3), as_power(Number(row.rms_error_m)), lost(row)]));
}

/** A row from a creature that was converted with polish ('on') and without ('off'), in a directory named as the row. */
function polish_row(directory) {
  const [off, on] = ['off', 'on'].map((way) => JSON.parse(readFileSync(join(directory, way, 'report.json'), 'utf8')));
  const round = (value) => Number(value.toPrecision(3));
  const open_loop = (report) => {
    const {fell, fall_time_s, duration_s} = report.replay.open_loop;
    return [round(fell ? fall_time_s : duration_s), fell ? 1 : 0];
  };
  const [before_s, falls_before] = open_loop(off), [after_s, falls_after] = open_loop(on);
  return {
    creature: basename(directory), correction_before: round(off.replay.closed_loop.correction_rms), correction_after: round(on.replay.closed_loop.correction_rms),
    open_loop_s_before: before_s, falls_before, open_loop_s_after: after_s, falls_after,
    shape_before: round(off.replay.closed_loop.shape_rms_length), shape_after: round(on.replay.closed_loop.shape_rms_length),
    is_left_out: on.polish ? 0 : 1,
  };
}
function polish_table(rows) {
  const named = (creature) => creature.replace(/^\S+/, '`$&`').replace(/ (.+)/, ' `$1`');
  const lasted = (seconds, falls) => `${short(Number(seconds), 2)} s${Number(falls) ? '' : ' (all)'}`;
  return markdown(['`--polish on`', 'correction before', 'after', 'open loop stays up, before', 'after', 'shape before, % L', 'after'],
    rows.map((row) => {
      const after = (value) => (Number(row.is_left_out) ? '-' : value);
      return [named(row.creature), plain(row.correction_before), Number(row.is_left_out) ? 'left out' : plain(row.correction_after),
        lasted(row.open_loop_s_before, row.falls_before), after(lasted(row.open_loop_s_after, row.falls_after)),
        (100 * row.shape_before).toFixed(2), after((100 * row.shape_after).toFixed(2))];
    }));
}

/** The Young's modulus from which on implicit is cheaper, between the two measured ones where the ratio of the times passes 1. */
function crossing(rows) {
  const points = rows.map((row) => [Number(row.youngs_modulus_pa), row.explicit_ms_per_s / row.implicit_ms_per_s]);
  const k = points.findIndex(([, ratio]) => ratio >= 1);
  if (k < 0) return `above ${points.at(-1)[0].toExponential(0).replace('+', '')} Pa`;
  if (k === 0) return `below ${points[0][0].toExponential(0).replace('+', '')} Pa`;
  const [[e0, r0], [e1, r1]] = [points[k - 1], points[k]];
  return as_power(e0 * (e1 / e0) ** (Math.log(r0) / (Math.log(r0) - Math.log(r1))));
}

function damping_table(rows) {
  const times = [...new Set(rows.map((row) => row.damping_time_s))];
  const bodies = [...new Set(rows.map((row) => row.body))];
  const cell = (body, time) => crossing(rows.filter((row) => row.body === body && row.damping_time_s === time));
  return markdown(['damping time [s]', ...times], bodies.map((body) => [body, ...times.map((time) => cell(body, time))]));
}

/** Processor time alone: the clock's is the load's as much as the program's. */
function import_table(rows) {
  return markdown(['file', 'kB', 'vertices', 'frames', 'reading process, ms of the processor', 'its memory, MiB'],
    rows.map((row) => [`\`${row.file}\``, Math.round(row.bytes / 1000), row.vertices, row.frames, short(1000 * row.read_cpu_s, 2), Math.round(row.read_peak_mib)]));
}

const kinds = {
  levels: {
    columns: ['creature', 'nodes', 'solved_nodes', 'work_ms', 'falls', 'clip_shape_rms_length', 'way'],
    read: (files) => files.map(level_row).sort((a, b) => a.nodes - b.nodes), key: (row) => row.creature, table: levels_table,
  },
  chosen: {
    columns: ['creature', 'max_error', 'estimated_error', 'method', 'nodes', 'whole_nodes', 'harmonics', 'whole_harmonics', 'ms_per_sim_s',
      'finest_ms_per_sim_s', 'falls', 'way'],
    read: (creatures) => creatures.map(chosen_row), key: (row) => row.creature, table: chosen_table,
  },
  polish: {
    columns: ['creature', 'correction_before', 'correction_after', 'open_loop_s_before', 'falls_before', 'open_loop_s_after', 'falls_after',
      'shape_before', 'shape_after', 'is_left_out'],
    read: (directories) => directories.map(polish_row), key: (row) => row.creature, table: polish_table,
  },
  peers: {
    columns: ['scene', 'tets', 'solver', 'steps_per_s', 'cpu_ms_per_s', 'times_of_bullet_60', 'rms_error_m', 'angular_loss'],
    read: (files) => files.flatMap(read_csv).filter((row) => row.cpu_ms_per_s !== ''), table: peers_table,
    key: (row) => `${row.scene}/${row.tets}/${row.solver}/${row.steps_per_s}`,
  },
  damping: {
    columns: ['body', 'damping_time_s', 'youngs_modulus_pa', 'explicit_ms_per_s', 'implicit_ms_per_s'],
    read: (files) => files.flatMap(read_csv), key: (row) => row.body, table: damping_table,
  },
  import: {
    columns: ['file', 'bytes', 'read_cpu_s', 'read_peak_mib', 'vertices', 'frames'],
    read: (files) => files.flatMap(read_csv).filter((row) => row.bytes !== ''), key: (row) => row.file, table: import_table,
  },
};

if (kind === 'speed') {
  if (measured.length > 0) write_whole(kept_file, readFileSync(measured[0], 'utf8'));
  write_between_marks(readme, 'samples/figures.sh speed', readFileSync(kept_file, 'utf8').trimEnd());
} else if (kinds[kind]) {
  const {columns, read, key, table} = kinds[kind];
  const rows = merged(existsSync(kept_file) ? read_csv(kept_file) : [], read(measured), key);
  if (rows.length === 0) {
    console.error(`figures.mjs: ${kept_file}: holds nothing to show. Measure it first.`);
    process.exit(1);
  }
  if (measured.length > 0) write_csv(kept_file, columns, rows);
  write_between_marks(readme, `samples/figures.sh ${kind}`, table(rows));
  if (kind === 'levels') write_whole(kept_file.replace(/csv$/, 'svg'), levels_svg(rows));
} else {
  console.error(`figures.mjs: '${kind}' is no table. Name levels, chosen, polish, peers, damping, import or speed.`);
  process.exit(2);
}
