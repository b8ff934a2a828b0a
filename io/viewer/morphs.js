// Morph targets that a creature wears over the skin that its control nodes carry.
import { floats, indices } from './data.js';

const kTurns = 8; // steps of a rotation's search, from where it was found last

/** Inverse of a 3 x 3 matrix given by columns; zeros where it has none. */
function inverse([a, b, c]) {
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const rows = [cross(b, c), cross(c, a), cross(a, b)];
  const determinant = a[0] * rows[0][0] + a[1] * rows[0][1] + a[2] * rows[0][2];
  return rows.map((row) => row.map((part) => (determinant === 0 ? 0 : part / determinant)));
}

const edges_of = (places, nodes) =>
  [1, 2, 3].map((k) => [0, 1, 2].map((d) => places[3 * nodes[k] + d] - places[3 * nodes[0] + d]));

/** The columns of the rotation that a unit quaternion x y z w stands for. */
function columns_of([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/** Brings a quaternion to the rotation nearest to a matrix given by columns. Source: Müller, Bender, Chentanez, Macklin, "A Robust
    Method to Extract the Rotational Part of Deformations", MIG 2016. */
function follow(turn, matrix) {
  for (let step = 0; step < kTurns; ++step) {
    const own = columns_of(turn);
    const sum = [0, 0, 0];
    let along = 0;
    for (let k = 0; k < 3; ++k) {
      const [r, a] = [own[k], matrix[k]];
      sum[0] += r[1] * a[2] - r[2] * a[1];
      sum[1] += r[2] * a[0] - r[0] * a[2];
      sum[2] += r[0] * a[1] - r[1] * a[0];
      along += r[0] * a[0] + r[1] * a[1] + r[2] * a[2];
    }
    const scale = 1 / (Math.abs(along) + 1e-9);
    const angle = scale * Math.hypot(...sum);
    if (angle < 1e-6) return;
    const [s, c] = [(Math.sin(0.5 * angle) / angle) * scale, Math.cos(0.5 * angle)];
    const [u, v, w] = sum.map((part) => s * part);
    const [x, y, z, q] = turn;
    turn[0] = c * x + u * q + v * z - w * y;
    turn[1] = c * y - u * z + v * q + w * x;
    turn[2] = c * z + u * y - v * x + w * q;
    turn[3] = c * q - u * x - v * y - w * z;
  }
}

export class Morphs {
  /** `skin`: nodes of each vertex; `rest`: places of the nodes in the bind pose, x y z by node. */
  constructor(told, skin, rest) {
    Object.assign(this, told);
    this.weights = floats(told.weights); // frame by frame
    this.targets = told.targets.map(({ vertices, offsets }) => ({ vertices: indices(vertices), offsets: floats(offsets) }));
    this.skin = skin;
    this.bind = new Map(); // of each moved vertex: its nodes and the inverse of their edges
    for (const { vertices } of this.targets) {
      for (const v of vertices) {
        if (this.bind.has(v)) continue;
        const nodes = skin.nodes.subarray(4 * v, 4 * v + 4);
        this.bind.set(v, { nodes, undo: inverse(edges_of(rest, nodes)), offset: [0, 0, 0] });
      }
    }
  }

  /** The weights at time t [s], straight between frames; a loop goes on for ever. */
  at(t) {
    const last = this.frames - (this.loop ? 0 : 1);
    let place = t * this.rate_hz;
    place = this.loop ? place - last * Math.floor(place / last) : Math.min(place, last);
    const f = Math.min(Math.floor(place), this.frames - 1);
    const next = this.loop ? (f + 1) % this.frames : Math.min(f + 1, this.frames - 1);
    const count = this.targets.length;
    return this.targets.map((_, k) => {
      const [here, there] = [this.weights[f * count + k], this.weights[next * count + k]];
      return here + (place - f) * (there - here);
    });
  }

  /** Puts the targets on the skin that nodes at `nodes` carry; `turns` keeps for one body how it turned at each vertex. */
  put_on(t, nodes, turns, skin) {
    for (const { offset } of this.bind.values()) offset.fill(0);
    this.at(t).forEach((weight, k) => {
      const { vertices, offsets } = this.targets[k];
      for (let i = 0; weight !== 0 && i < vertices.length; ++i) {
        const { offset } = this.bind.get(vertices[i]);
        for (let d = 0; d < 3; ++d) offset[d] += weight * offsets[3 * i + d];
      }
    });
    for (const [v, { nodes: carriers, undo, offset }] of this.bind) {
      if (offset[0] === 0 && offset[1] === 0 && offset[2] === 0) continue;
      const edges = edges_of(nodes, carriers);
      const deformation = [0, 1, 2].map((c) => [0, 1, 2].map((r) => edges[0][r] * undo[0][c] + edges[1][r] * undo[1][c] + edges[2][r] * undo[2][c]));
      if (!turns.has(v)) turns.set(v, [0, 0, 0, 1]);
      follow(turns.get(v), deformation);
      const own = columns_of(turns.get(v));
      for (let d = 0; d < 3; ++d) skin[3 * v + d] += own[0][d] * offset[0] + own[1][d] * offset[1] + own[2][d] * offset[2];
    }
  }
}
