// Plays morph targets as the report's view does, on one tet that turns by more and more; exit code 1 where they are not where they belong.
import { Morphs } from '../../io/viewer/morphs.js';

const base64 = (array) => Buffer.from(array.buffer).toString('base64');
const told = {
  targets: [{ vertices: base64(new Uint32Array([1])), offsets: base64(new Float32Array([0.1, 0, 0.2])) }],
  weights: base64(new Float32Array([0, 1, 0.5])), frames: 3, rate_hz: 10, loop: true,
};
const skin = { nodes: new Uint32Array([0, 1, 2, 3, 0, 1, 2, 3]) };
const rest = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
const morphs = new Morphs(told, skin, rest);
const turns = new Map();
let worst = 0;
for (let step = 0; step <= 30; ++step) {
  const t = 0.1 * step;
  const [c, s] = [Math.cos(0.4 * step), Math.sin(0.4 * step)];
  const turn = ([x, y, z]) => [c * x - s * y, s * x + c * y, z];
  // Longer along x than at rest: the offset turns, it does not stretch.
  const nodes = new Float32Array([[0, 0, 0], [1.5, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap(turn));
  const out = new Float32Array(6);
  morphs.put_on(t, nodes, turns, out);
  const weight = [0, 1, 0.5][step % 3];
  const expected = turn([0.1 * weight, 0, 0.2 * weight]);
  for (let d = 0; d < 3; ++d) worst = Math.max(worst, Math.abs(out[3 + d] - expected[d]), Math.abs(out[d]));
}
if (!(worst < 1e-4)) {
  console.error(`off by ${worst}`);
  process.exitCode = 1;
}
