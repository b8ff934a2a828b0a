// Ticks as the report's charts write them: as many digits as the step needs; exit code 1 where they are others.
import { tick_texts } from '../../io/viewer/tables.js';

const cases = [
  [[0.999, 0.9995, 1], 0.0005, '0.9990 0.9995 1.0000'],
  [[-0.25, 0, 0.25], 0.25, '-0.25 0.00 0.25'],
  [[0, 5, 10], 5, '0 5 10'],
  [[0, 2.5, 5], 2.5, '0.0 2.5 5.0'],
  [[0.1, 0.2, 0.30000000000000004], 0.1, '0.1 0.2 0.3'],
  [[0, 20000], 20000, '0 20,000'],
  [[0, 1e-9], 1e-9, '0.000000000 0.000000001'],
];
for (const [ticks, step, wanted] of cases) {
  const told = tick_texts(ticks, step).join(' ');
  if (told === wanted) continue;
  console.error(`in steps of ${step}: '${told}', not '${wanted}'`);
  process.exitCode = 1;
}
