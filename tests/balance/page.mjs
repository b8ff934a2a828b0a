// Writes DIR/balance.html from DIR/balance.csv and DIR/frames: a table of survival and medians, survival curves, looping pictures.
// Prints the table as well; with a README, puts those of the usual variant between its marks and the survival curves beside it. Fails where a run had a hidden hand. Usage: node page.mjs DIR [README.md]
import { existsSync, readFileSync, renameSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { write_between_marks } from "../../samples/between_marks.mjs";
import { survival_svg } from "./survival_svg.mjs";

const [directory, readme] = process.argv.slice(2);
const [head, ...lines] = readFileSync(join(directory, "balance.csv"), "utf8").trim().split("\n");
const names = head.split(",");
const rows = lines.map((line) => Object.fromEntries(line.split(",").map((value, k) => [names[k], value])));

const median = (values) => {
  const sorted = values.map(Number).sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length === 0 ? NaN : sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
};
const most = (rows, name) => Math.max(...rows.map((row) => Number(row[name])));
const grouped = new Map();
for (const row of rows) {
  const key = `${row.clip},${row.variant}`;
  if (!grouped.has(key)) grouped.set(key, { clip: row.clip, variant: row.variant, seeds: [], pushes: [] });
  grouped.get(key)[row.push === "none" ? "seeds" : "pushes"].push(row);
}
const summary = [...grouped.values()].map(({ clip, variant, seeds, pushes }) => {
  const of = (name) => median(seeds.filter((row) => row.outcome === "up").map((row) => Math.abs(row[name])).filter((value) => !Number.isNaN(value)));
  return {
    clip,
    variant,
    up: `${seeds.filter((row) => row.outcome === "up").length}/${seeds.length}`,
    pushes: `${pushes.filter((row) => row.outcome === "up").length}/${pushes.length}`,
    "median s up": median(seeds.map((row) => row.time_s)),
    "shape %L": 100 * of("shape"),
    "clip shape %L": 100 * of("clip_shape"),
    "drift %L": 100 * of("drift"),
    "heading deg": of("heading_deg"),
    travel: of("travel"),
    "slip %L": 100 * of("slip"),
    "held slip %L": 100 * of("held_slip"),
    "buzz": of("buzz"),
    "style": of("style"),
    "stiffest": of("style_least"),
    "momentum unexplained, mg": most([...seeds, ...pushes], "momentum_mg"),
    "angular, mgL": most([...seeds, ...pushes], "angular_mgl"),
    "assist, mg": most([...seeds, ...pushes], "assist_mg"),
    "x real time": median(seeds.map((row) => row.real_time_factor)),
  };
});
const shown = (value) => (typeof value === "number" ? (Number.isNaN(value) ? "-" : String(+value.toPrecision(3))) : value);
console.table(Object.fromEntries(summary.map(({ clip, variant, ...rest }) => [`${clip} ${variant}`,
  Object.fromEntries(Object.entries(rest).map(([name, value]) => [name, shown(value)]))])));

const report_of = (clip) => JSON.parse(readFileSync(join(directory, "creatures", clip, "report.json"), "utf8"));

/** What a page for people wants of the usual variant; clips that fall have no medians of what stays up. */
function readme_table() {
  const lines = summary.filter((row) => row.variant === "usual").map((row) => {
    const cells = ["shape %L", "clip shape %L", "drift %L", "slip %L", "held slip %L"].map((name) => Number.isNaN(row[name]) ? "-" : row[name].toFixed(2));
    const way = Number.isNaN(row.travel) ? "-" : `${(100 * row.travel).toFixed(0)} %`;
    const { seeds } = grouped.get(`${row.clip},${row.variant}`);
    const fallen = seeds.filter((one) => one.outcome !== "up").map((one) => Number(one.time_s));
    const falls = fallen.length === 0 ? "-" : `${Math.min(...fallen).toFixed(1)} to ${Math.max(...fallen).toFixed(1)} s`;
    const moved = (100 * report_of(row.clip).preparation.total_shift_rms_length).toFixed(1);
    const heading = Number.isNaN(row["heading deg"]) ? "-" : row["heading deg"].toFixed(2);
    return `| \`${row.clip}\` | ${moved} | ${row.up.replace("/", " of ")} | ${falls} | ${cells.join(" | ")} | ${heading} | ${way} | ${row.pushes.replace("/", " of ")} | ${row["x real time"].toFixed(1)} |`;
  });
  return ["| clip | moved by preparation, % L | keeps its feet | falls at | from its plan, % L | from the clip, % L | drift a cycle, % L | slip a stance, % L | of it, where the target holds | turns a cycle, degrees | way | bears pushes | times real time |",
          "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |", ...lines].join("\n");
}

/** The same settings on other meshes: a line for each clip and mesh, of what README wants. */
function mesh_table() {
  const lines = summary.filter((row) => row.variant === "usual").map((row) => {
    const creature = join(directory, "creatures", row.clip);
    // What a creature's record says of its feedback is only what it has instead of the usual.
    const record = readFileSync(join(creature, "creature.toml"), "utf8");
    const otherwise = [...record.matchAll(/^corrector_(\w+) = /gm)].map(([, name]) => name.replace("_", " "));
    if (record.includes("rest_lengths = 'fitted'")) otherwise.push("fitted rest lengths");
    if (record.includes("load = 'spread'")) otherwise.push("load spread");
    const { seeds } = grouped.get(`${row.clip},${row.variant}`);
    const [clip, asked] = row.clip.split("@");
    const of = (name, digits) => Number.isNaN(row[name]) ? "-" : row[name].toFixed(digits);
    const away = seeds.filter((one) => one.outcome === "up").map((one) => 100 * Math.abs(one.drift)).filter((value) => !Number.isNaN(value));
    const farthest = away.length === 0 ? "-" : Math.max(...away).toFixed(2);
    const way = Number.isNaN(row.travel) ? "-" : `${(100 * row.travel).toFixed(0)} %`;
    return `| \`${clip}\` | ${asked} | ${report_of(row.clip).body.nodes} | ${row.up.replace("/", " of ")} | ${of("shape %L", 2)} | ${of("drift %L", 2)} | ${farthest} | ${of("held slip %L", 2)} | ${way} | ${otherwise.join(", ") || "-"} | ${row["x real time"].toFixed(2)} |`;
  });
  return ["| clip | nodes asked for | got | keeps its feet | from its plan, % L | drift a cycle, % L | farthest of all | slip where the target holds | way | instead of the usual | times real time |",
          "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |", ...lines].join("\n");
}

/** Of each clip that falls: when, and by which limb it was told. */
function falls_table() {
  const lines = [];
  for (const { clip, variant, seeds } of grouped.values()) {
    const causes = seeds.filter((row) => variant === "usual" && row.outcome === "fell")
      .map((row) => row.fall_cause.match(/\(frame (\d+)\) limb '(.*)' is ([\d.]+) m .*; (\d+) % .* limit of ([\d.]+)/)).filter(Boolean);
    if (causes.length === 0) continue;
    const range = (k, digits) => {
      const values = causes.map((cause) => Number(cause[k]));
      return [...new Set([Math.min(...values), Math.max(...values)].map((value) => value.toFixed(digits)))].join(" to ");
    };
    const bodies = (limb) => causes.filter((cause) => cause[2] === limb).length;
    const limbs = [...new Set(causes.map((cause) => cause[2]))].sort((a, b) => bodies(b) - bodies(a));
    const told = limbs.map((limb) => `\`${limb}\` (${bodies(limb)})`).join(", ");
    lines.push(`| \`${clip}\` | ${range(1, 0)} | ${told} | ${range(3, 2)} | ${range(4, 0)} % of ${range(5, 2)} |`);
  }
  return ["| clip | falls in the clip's frames (60 Hz) | limbs farthest from their target then (bodies) | by, m | their constraints at the limit |", "| --- | --- | --- | --- | --- |",
          ...lines].join("\n");
}

// Survival: the share of the seeds that are still up, over the share of the time that was asked.
const kColours = ["#2563eb", "#dc2626", "#059669", "#d97706", "#7c3aed", "#0891b2", "#be185d", "#4d7c0f"];
const variants = [...new Set(rows.map((row) => row.variant))];
const kUntilTold = 0.2;  // [s] from a fall on, that count among the cycles of a run
/** How long a run was to last [s]; of a one-shot, how long it did. */
function asked_s(row) {
  const simulated = Number(row.time_s) + (row.outcome === "up" ? 0 : kUntilTold);
  return row.loop === "1" ? Number(row.cycles_wanted) * simulated / Number(row.cycles) : simulated;
}
const of_meshes = rows.filter((row) => row.clip.includes("@")).length;
if (readme && of_meshes > 0 && of_meshes < rows.length) {
  console.error("page.mjs: creatures on the usual mesh and on others together have no table in README. Leave 'usual' out of -m, or -r.");
  process.exit(2);
} else if (readme && of_meshes > 0) {
  write_between_marks(readme, "tests/balance/run.sh -m -r", mesh_table());
} else if (readme) {
  write_between_marks(readme, "tests/balance/run.sh -r", readme_table());
  write_between_marks(readme, "tests/balance/run.sh -r: falls", falls_table());
  const clips = [...grouped.values()].filter(({ variant, seeds }) => variant === "usual" && seeds.length > 0).map(({ clip, seeds }) => ({
    name: clip,
    bodies: seeds.length,
    asked_s: Math.max(...seeds.map(asked_s)),
    fall_times_s: seeds.filter((row) => row.outcome === "fell").map((row) => Number(row.time_s)),
  }));
  const picture = join(dirname(readme), "samples/figures/survival.svg");
  writeFileSync(`${picture}.part`, survival_svg(clips));
  renameSync(`${picture}.part`, picture);
}

function curve(seeds) {
  const longest = Math.max(...seeds.map(asked_s));
  const falls = seeds.filter((row) => row.outcome === "fell").map((row) => Number(row.time_s) / longest).sort((a, b) => a - b);
  let path = "M0 0";
  falls.forEach((at, k) => (path += `H${(at * 100).toFixed(2)}V${((100 * (k + 1)) / seeds.length).toFixed(2)}`));
  return `${path}H100`;
}
const clips = [...new Set(rows.map((row) => row.clip))];
const charts = clips.map((clip) => {
  const curves = [...grouped.values()].filter((group) => group.clip === clip && group.seeds.length > 0)
    .map((group) => `<path d="${curve(group.seeds)}" stroke="${kColours[variants.indexOf(group.variant) % kColours.length]}"/>`);
  const pictures = variants.filter((variant) => existsSync(join(directory, "frames", `${clip},${variant}.json`)))
    .map((variant) => {
      const frames = readFileSync(join(directory, "frames", `${clip},${variant}.json`), "utf8").trim();
      return `<figure><canvas width="300" height="150" data-frames='${frames}'></canvas><figcaption>${variant}, seed 1</figcaption></figure>`;
    });
  return `<section><h2>${clip}</h2><svg viewBox="-2 -4 104 108" preserveAspectRatio="none">${curves.join("")}</svg>${pictures.join("")}</section>`;
});
const columns = Object.keys(summary[0] ?? {});
const table = `<table><tr>${columns.map((name) => `<th>${name}</th>`).join("")}</tr>${summary.map((row) =>
  `<tr>${columns.map((name) => `<td>${shown(row[name])}</td>`).join("")}</tr>`).join("")}</table>`;
const legend = variants.map((variant, k) => `<span style="color:${kColours[k % kColours.length]}">&#9632; ${variant}</span>`).join(" ");
const page = `<!doctype html><meta charset="utf-8"><title>Balance</title>
<style>body{font:14px system-ui;margin:2em;max-width:1300px}table{border-collapse:collapse}td,th{padding:2px 10px;text-align:right;border-bottom:1px solid #ddd}
section{display:inline-block;vertical-align:top;margin:1em 2em 1em 0;width:300px}svg{width:300px;height:120px;border:1px solid #999}
path{fill:none;stroke-width:1.5;vector-effect:non-scaling-stroke}figure{margin:4px 0}canvas{background:#f4f4f5}</style>
<h1>Balance</h1><p>Seeds differ from the plan by up to 10 % in mass, friction and stiffness and get a shove of up to 0.1 m/s at the start.
Curves: share of the seeds still up over the time that was asked. ${legend}</p>${table}${charts.join("")}
<script>
for (const canvas of document.querySelectorAll("canvas")) {
  const { rate_hz, edges, frames } = JSON.parse(canvas.dataset.frames), pen = canvas.getContext("2d");
  const nodes = frames[0].length / 3;
  const draw = (now) => {
    const x = frames[Math.floor((now / 1000) * rate_hz) % frames.length];
    let middle = [0, 0];
    for (let i = 0; i < nodes; ++i) middle = [middle[0] + x[3 * i] / nodes, middle[1] + x[3 * i + 2] / nodes];
    const place = (i) => {  // from the side and a little above, the view going along
      const a = x[3 * i] - middle[0], b = x[3 * i + 2] - middle[1];
      return [150 + 110 * (0.5 * a + 0.87 * b), 130 - 110 * (x[3 * i + 1] + 0.25 * (0.87 * a - 0.5 * b))];
    };
    pen.clearRect(0, 0, 300, 150);
    pen.strokeStyle = "#a1a1aa";
    for (let k = -9; k < 9; ++k) {  // marks on the ground that stay where they are
      const z = k * 0.5 - ((middle[1] % 0.5) + 0.5) % 0.5;
      pen.strokeRect(150 + 110 * 0.87 * z, 131, 8, 1);
    }
    pen.strokeStyle = "#1e3a8a";
    pen.globalAlpha = 0.35;
    pen.beginPath();
    for (let e = 0; e < edges.length; e += 2) {
      pen.moveTo(...place(edges[e]));
      pen.lineTo(...place(edges[e + 1]));
    }
    pen.stroke();
    pen.globalAlpha = 1;
    requestAnimationFrame(draw);
  };
  requestAnimationFrame(draw);
}
</script>
`;
writeFileSync(join(directory, "balance.html.part"), page);
renameSync(join(directory, "balance.html.part"), join(directory, "balance.html"));

// No hidden hand: the ground, gravity and declared effects explain every change of momentum, and nothing else turned the body.
const kUnexplained = 1e-6;
const assisted = rows.filter((row) => Number(row.assist_mg) !== 0 || !(Number(row.momentum_mg) < kUnexplained && Number(row.angular_mgl) < kUnexplained));
for (const row of assisted) {
  console.error(`hidden hand in ${row.clip}, ${row.variant}, seed ${row.seed}, push ${row.push}: assist ${row.assist_mg} mg, unexplained ${row.momentum_mg} mg, ${row.angular_mgl} mgL`);
}
if (assisted.length > 0) process.exitCode = 1;
