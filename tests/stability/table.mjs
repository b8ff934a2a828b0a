// table.mjs STABILITY.csv [README.md]: the suite's table, a row a case: of how many runs how many passed, how much of the time
// the guard stepped, and what failed. With a README, puts it between its marks. Exit code 1 where a run failed.
import {readFileSync} from 'node:fs';

import {write_between_marks} from '../../samples/between_marks.mjs';

const [csv, readme] = process.argv.slice(2);
const rows = readFileSync(csv, 'utf8').trim().split('\n').slice(1).map((line) => line.split(','));
const methods = [...new Set(rows.map((row) => row[3]))], cases = [...new Set(rows.map((row) => row[0]))];
const passed = (row) => row[5] === 'pass' || row[5] === 'refused';

function cell(runs) {
  const well = runs.filter(passed).length;
  const guarded = Math.max(...runs.map((row) => Number(row[8] || 0)));
  const failures = [...new Set(runs.filter((row) => !passed(row)).map((row) => `${row[2]} ${row[4]}: ${row[5]}`))];
  const guard = guarded >= 0.0005 ? `, guard ${guarded < 0.01 ? '< 1' : `up to ${Math.round(100 * guarded)}`} %` : '';
  return runs.every((row) => row[5] === 'refused') ? 'refused' : `${well} of ${runs.length}${guard}${failures.length ? `; ${failures.join('; ')}` : ''}`;
}

const table = [
  `| case | ${methods.map((name) => `\`${name}\``).join(' | ')} |`,
  `| --- |${' --- |'.repeat(methods.length)}`,
  ...cases.map((name) => `| ${name} | ${methods.map((method) => cell(rows.filter((row) => row[0] === name && row[3] === method))).join(' | ')} |`),
].join('\n');
console.log(table);

if (readme) write_between_marks(readme, 'tests/stability/run.sh -r', table);
process.exit(rows.every(passed) ? 0 : 1);
