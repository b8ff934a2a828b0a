// What the page holds, decoded, and the motions as functions of time.

function bytes(base64) {
  const text = atob(base64);
  const result = new Uint8Array(text.length);
  for (let i = 0; i < result.length; ++i) result[i] = text.charCodeAt(i);
  return result.buffer;
}

export const floats = (text) => new Float32Array(bytes(text));
export const doubles = (text) => new Float64Array(bytes(text));
export const indices = (text) => new Uint32Array(bytes(text));

export function read_page() {
  const page = JSON.parse(document.getElementById('data').textContent);
  page.motions = page.motions.map((motion) => new Motion(motion));
  return page;
}

/** Positions over time, kept as 16-bit steps from every frame's own corner. */
class Motion {
  constructor(told) {
    Object.assign(this, told);
    this.corners = floats(told.corners);
    this.steps = new Uint16Array(bytes(told.steps));
    this.size = this.steps.length / this.frames; // 3 a point
    this.positions = new Float32Array(this.size);
    this.next = new Float32Array(this.size);
  }

  /** Frame `f` of period `cycle`, written into `out`. From one period to the next a loop turns by yaw, then moves by travel. */
  read_frame(f, cycle, out) {
    let [tx, tz] = [0, 0];
    const [c1, s1] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    for (let k = 0; k < cycle; ++k) [tx, tz] = [c1 * tx + s1 * tz + this.travel[0], -s1 * tx + c1 * tz + this.travel[2]];
    const [c, s] = [Math.cos(this.yaw * cycle), Math.sin(this.yaw * cycle)];
    const [cx, cy, cz] = this.corners.subarray(3 * f, 3 * f + 3);
    for (let i = 0, j = f * this.size; i < this.size; i += 3, j += 3) {
      const x = cx + this.step * this.steps[j];
      const z = cz + this.step * this.steps[j + 2];
      out[i] = c * x + s * z + tx;
      out[i + 1] = cy + this.step * this.steps[j + 1];
      out[i + 2] = -s * x + c * z + tz;
    }
  }

  /** Positions at time t [s], x y z by point. Before its start and after its end a motion that is no loop stands still. */
  at(t) {
    const cycle = this.loop ? Math.max(0, Math.floor(t / this.duration_s)) : 0;
    const local = Math.min(Math.max(0, t - cycle * this.duration_s), this.duration_s);
    const f = Math.min(Math.floor(local * this.rate_hz + 1e-9), this.frames - 1);
    this.read_frame(f, cycle, this.positions);
    const is_last = f + 1 === this.frames;
    if (is_last && !this.loop) return this.positions;
    this.read_frame(is_last ? 0 : f + 1, is_last ? cycle + 1 : cycle, this.next);
    const interval = is_last ? this.duration_s - f / this.rate_hz : 1 / this.rate_hz;
    const share = Math.min(1, Math.max(0, (local - f / this.rate_hz) / interval));
    for (let i = 0; i < this.size; ++i) this.positions[i] += share * (this.next[i] - this.positions[i]);
    return this.positions;
  }
}

export function centre(positions) {
  const sum = [0, 0, 0];
  for (let i = 0; i < positions.length; ++i) sum[i % 3] += positions[i];
  return sum.map((part) => (part * 3) / positions.length);
}

export const kRoles = {
  clip: { label: 'imported clip', colour: '#4f8ef7' },
  target: { label: 'target', colour: '#20a884' },
  replay: { label: 'replay', colour: '#f2803a' },
  open_loop: { label: 'open loop', colour: '#a875f0' },
  naive: { label: 'naive', colour: '#e0527a' },
};
const kPalette = ['#f2803a', '#4f8ef7', '#20a884', '#a875f0', '#e0527a', '#c9a227', '#3bb3c9', '#8d9a3a', '#b5714a', '#7784a8'];

export const colour_of = (role, index) => kRoles[role]?.colour ?? kPalette[index % kPalette.length];

/** What the page calls a motion, and its colour: of a comparison's runs their names, otherwise its role's. */
export const mark_of = (motion) =>
  motion.name === undefined ? kRoles[motion.role] : { label: motion.name, colour: colour_of('other', motion.performer) };
