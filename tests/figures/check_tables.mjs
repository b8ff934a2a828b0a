// The measured tables of README (samples/figures.mjs, tests/stability/table.mjs) on small ones: node check_tables.mjs; exit code 1
// where one is not as it must be.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const project = join(dirname(fileURLToPath(import.meta.url)), '..', '..');
const directory = mkdtempSync(join(tmpdir(), 'hydrostat figures '));
process.on('exit', () => rmSync(directory, {recursive: true}));
const file = (name) => join(directory, name);
const page = file('README.md');
const marks = (writer) => `<!-- ${writer} writes this table -->`, end = '<!-- end of the table -->';
const run = (...given) => spawnSync('node', given, {encoding: 'utf8'});
const figures = (...given) => run(join(project, 'samples', 'figures.mjs'), ...given);

/** Writes a page with marks for the table, calls, and gives the lines that then stand between them. */
function lines_made(kind, kept, ...measured) {
  writeFileSync(page, `before\n${marks(`samples/figures.sh ${kind}`)}\n| old |\n${end}\nafter\n${marks('other')}\n| stays |\n${end}\n`);
  const outcome = figures(kind, kept, page, ...measured);
  assert.equal(outcome.status, 0, outcome.stderr);
  const text = readFileSync(page, 'utf8');
  assert.ok(text.startsWith('before\n') && text.endsWith(`${end}\nafter\n${marks('other')}\n| stays |\n${end}\n`), text);
  assert.ok(!readdirSync(directory).some((name) => name.endsWith('.part')));
  return text.slice(text.indexOf('-->') + 4, text.indexOf(end)).trimEnd().split('\n');
}

function report(name, nodes, solved_nodes, work_ms, run_figures) {
  const closed_loop = {fell: false, clip_shape_rms_length: 0.02, travel_per_cycle_length: 0.45, clip_travel_per_cycle_length: 0.5, ...run_figures};
  writeFileSync(file(name), JSON.stringify({level: {nodes, solved_nodes, work_ms}, replay: {closed_loop}}));
  return file(name);
}

function levels() {
  const kept = file('levels.csv');
  writeFileSync(kept, 'creature,nodes,solved_nodes,work_ms,falls,clip_shape_rms_length,way\nfox,10,20,1,1,,\nfox,20,20,3,0,0.03,0.9\ndog,7,7,1,0,0.5,1\n');
  const lines = lines_made('levels', kept, report('dog.400.json', 80, 20, 30.04), report('dog.50.json', 10, 20, 4.56, {fell: true}),
    report('eel.100.json', 30, 30, 123.4, {clip_travel_per_cycle_length: 1e-4}));
  assert.deepEqual(lines.slice(2), [
    '| `fox` | 10 | 1 | falls | |', '| | **20** | 3 | 3.0 | 90 % |', '| `dog` | 10 | 4.6 | falls | |', '| | 80 | 30 | 2.0 | 90 % |',
    '| `eel` | **30** | 123 | 2.0 | on the spot |']);
  const svg = readFileSync(file('levels.svg'), 'utf8');
  for (const text of ['counted work [ms for a frame of 1/60 s]', '[% of L, RMS]', 'Ringed:', '>eel<', '&#215;']) assert.ok(svg.includes(text), text);
  assert.ok(!/NaN|undefined|Infinity/.test(svg), svg);
  const [csv, text] = [readFileSync(kept), readFileSync(page)];
  assert.deepEqual(lines_made('levels', kept), lines); // from what was kept
  assert.deepEqual([readFileSync(kept), readFileSync(page)], [csv, text]);
}

function chosen() {
  mkdirSync(file('eel'));
  writeFileSync(join(file('eel'), 'accuracy.csv'), 'method,element,nodes,harmonics\nexplicit,tet,90,16\nspring,tet,40,4\n');
  const closed_loop = {fell: false, travel_per_cycle_length: 0.49, clip_travel_per_cycle_length: 0.5};
  const accuracy = {max_error_length: 0.02, estimated_error_length: 0.01234, method: 'spring', ms_per_sim_s: 61.04, finest_ms_per_sim_s: 256.1};
  writeFileSync(join(file('eel'), 'report.json'), JSON.stringify({accuracy, body: {nodes: 40}, signals: {harmonics: 4}, replay: {closed_loop}}));
  const lines = lines_made('chosen', file('chosen.csv'), file('eel'));
  assert.deepEqual(lines.slice(2), ['| `eel` | 2 % | 1.2 % | `spring` | 40 of 90 | 4 of 16 | 61 | 256 | 98 % |']);
  assert.deepEqual(lines_made('chosen', file('chosen.csv')), lines);
}

function polish() {
  const creature = (name, way, correction_rms, shape_rms_length, open_loop, told) => {
    mkdirSync(join(file(name), way), {recursive: true});
    writeFileSync(join(file(name), way, 'report.json'), JSON.stringify({polish: told, replay: {closed_loop: {correction_rms, shape_rms_length}, open_loop}}));
  };
  creature('eel --nodes 40', 'off', 0.00213, 0.00481, {fell: true, fall_time_s: 3.12, duration_s: 9});
  creature('eel --nodes 40', 'on', 0.0000049, 0.00476, {fell: false, fall_time_s: null, duration_s: 9}, {rounds: 4});
  for (const way of ['off', 'on']) creature('snail', way, 0.00034, 0.00222, {fell: false, fall_time_s: null, duration_s: 10});
  writeFileSync(file('polish.csv'), 'creature,correction_before,correction_after,open_loop_s_before,falls_before,open_loop_s_after,falls_after,shape_before,shape_after,is_left_out\n' +
    'eel --nodes 40,1,1,1,1,1,1,1,1,1\nworm,0.001,0.0000001,10,0,10,0,0.001,0.001,0\n');
  const lines = lines_made('polish', file('polish.csv'), file('eel --nodes 40'), file('snail'));
  assert.deepEqual(lines.slice(2), ['| `eel` `--nodes 40` | 0.0021 | 0.0000049 | 3.1 s | 9 s (all) | 0.48 | 0.48 |',
    '| `worm` | 0.001 | 0.0000001 | 10 s (all) | 10 s (all) | 0.10 | 0.10 |', '| `snail` | 0.00034 | left out | 10 s (all) | - | 0.22 | - |']);
  assert.deepEqual(lines_made('polish', file('polish.csv')), lines);
}

/** The ratio of the times goes with a power of E and passes 1 at a known one. */
function damping() {
  const measured = file('measured.csv');
  const row = (body, time, modulus, ratio) => `${body},${time},${modulus},9,${7 * ratio},7,0,0,0`;
  const moduli = [1e5, 1e6, 1e7];
  const rows = [0, 0.01].flatMap((time) => moduli.map((modulus) => row('"springs, 200 nodes"', time, modulus, (modulus / (time ? 3e5 : 1e9)) ** 0.5)));
  rows.push(...[0, 0.01].flatMap((time) => moduli.map((modulus) => row('192 tets', time, modulus, 2))));
  writeFileSync(measured, ['body,damping_time_s,youngs_modulus_pa,explicit_substeps_per_s,explicit_ms_per_s,implicit_ms_per_s,apart_m,a,b', ...rows].join('\n'));
  const expected = ['| damping time [s] | 0 | 0.01 |', '| --- | --- | --- |', '| springs, 200 nodes | above 1e7 Pa | 3.0e5 |', '| 192 tets | below 1e5 Pa | below 1e5 Pa |'];
  assert.deepEqual(lines_made('damping', file('damping.csv'), measured), expected);
  assert.deepEqual(lines_made('damping', file('damping.csv')), expected);
}

function peers() {
  const measured = file('peers_measured.csv');
  writeFileSync(file('peers.csv'), 'scene,tets,solver,steps_per_s,cpu_ms_per_s,times_of_bullet_60,rms_error_m,angular_loss\n' +
    'tumbling,5,explicit,60,1,1,1,1\ntumbling,6,euler,60,1003.4,1.5,0.046,0.474\n');
  writeFileSync(measured, 'scene,tets,solver,steps_per_s,cpu_ms_per_s,times_of_bullet_60,rms_error_m,least_jacobian,volume_error,angular_loss,sound\n' +
    'tumbling,5,"explicit",60,4.372,0.0694,4.51e-05,1,1,2.2e-16,1\ncantilever,5,"Bullet explicit, double",960,16.84,1,0.0121,1,1,0,1\ntumbling,5,"reference against implicit",960,,,0.009,,,,\n');
  assert.deepEqual(lines_made('peers', file('peers.csv'), measured).slice(2), [
    '| tumbling | 5 | `explicit` | 60 | 4.37 | 0.069 | 4.5e-05 | 2e-16 |', '| tumbling | 6 | `euler` | 60 | 1003 | 1.500 | 4.6e-02 | 47 % |',
    '| cantilever | 5 | Bullet explicit, double | 960 | 16.8 | 1.000 | 1.2e-02 | |']);
}

function imports_and_speed() {
  const measured = file('import_measured.csv');
  writeFileSync(measured, 'file,bytes,read_wall_s,read_cpu_s,read_peak_mib,import_s,own_peak_mib,vertices,frames\na.glb,12345,0.0512,0.0081,30.2,0.2,60,5,6\nbroken.glb,,,,,,,,"no, not one"\n');
  assert.deepEqual(lines_made('import', file('import.csv'), measured).slice(2), ['| `a.glb` | 12 | 5 | 6 | 8.1 | 30 |']);
  writeFileSync(file('printed.txt'), 'reading 5 ms\n\n| nodes | 150 |\n| --- | --- |\n');
  assert.deepEqual(lines_made('speed', file('speed.txt'), file('printed.txt')), ['reading 5 ms', '', '| nodes | 150 |', '| --- | --- |']);
}

function refusals() {
  writeFileSync(page, 'no marks\n');
  const lost = figures('levels', file('levels.csv'), page);
  assert.equal(lost.status, 2);
  assert.match(lost.stderr, /README\.md: the marks are missing\. Put '<!-- samples\/figures\.sh levels writes this table -->'/);
  assert.equal(readFileSync(page, 'utf8'), 'no marks\n');
  assert.equal(figures('absent', file('levels.csv'), page).status, 2);
  assert.equal(figures('import', file('absent.csv'), page).status, 1);
}

function stability() {
  const writer = 'tests/stability/run.sh -r';
  writeFileSync(page, `${marks(writer)}\n${end}\n`);
  writeFileSync(file('stability.csv'), 'case,name,body,method,nodes_wanted,verdict,nodes,elements,guarded\ndrop,a,tets,euler,81,pass,81,9,0.2\ndrop,b,tets,euler,81,pass,81,9,0\n');
  const outcome = run(join(project, 'tests', 'stability', 'table.mjs'), file('stability.csv'), page);
  assert.equal(outcome.status, 0, outcome.stderr);
  assert.equal(readFileSync(page, 'utf8'), `${marks(writer)}\n| case | \`euler\` |\n| --- | --- |\n| drop | 2 of 2, guard up to 20 % |\n${end}\n`);
}

/** The tables that README shows are those of the CSV files beside its pictures. */
function readme_is_true() {
  for (const kept of readdirSync(join(project, 'samples', 'figures')).filter((name) => /\.(csv|txt)$/.test(name))) {
    const kind = kept.split('.')[0];
    const [from, to] = [join(project, 'samples', 'figures', kept), file(kept)];
    writeFileSync(to, readFileSync(from));
    writeFileSync(page, readFileSync(join(project, 'README.md')));
    assert.equal(figures(kind, to, page).status, 0);
    assert.equal(readFileSync(page, 'utf8'), readFileSync(join(project, 'README.md'), 'utf8'), `README's table '${kind}' is not that of ${kept}: samples/figures.sh draw`);
  }
}

for (const check of [levels, chosen, polish, damping, peers, imports_and_speed, refusals, stability, readme_is_true]) check();
