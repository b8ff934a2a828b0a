// The view: skins of the motions over a ground with a grid in metres.
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Fog, HemisphereLight,
  LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, MeshStandardMaterial, PCFSoftShadowMap, PerspectiveCamera,
  PlaneGeometry, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { centre, floats, indices, kRoles, mark_of } from './data.js';
import { Looks } from './looks.js';
import { Morphs } from './morphs.js';

const kLowLeap = 0.25; // of L: how far a creature rises before the camera rises with it

/** The skin that control nodes carry: vertex v is the weighted sum of its four nodes. */
function embed(nodes, skin, out) {
  for (let v = 0; v < out.length / 3; ++v) {
    let [x, y, z] = [0, 0, 0];
    for (let k = 4 * v; k < 4 * v + 4; ++k) {
      const n = 3 * skin.nodes[k];
      const weight = skin.weights[k];
      x += weight * nodes[n];
      y += weight * nodes[n + 1];
      z += weight * nodes[n + 2];
    }
    out[3 * v] = x;
    out[3 * v + 1] = y;
    out[3 * v + 2] = z;
  }
}

/** Extents of points along the horizontal direction `along` (x, z). */
function width_along(positions, along) {
  let [least, most] = [Infinity, -Infinity];
  for (let i = 0; i < positions.length; i += 3) {
    const place = positions[i] * along[0] + positions[i + 2] * along[1];
    least = Math.min(least, place);
    most = Math.max(most, place);
  }
  return most - least;
}

/** Horizontal direction (x, z) in which the motion goes; where it stays, the body's longer axis. */
function heading_of(motion, length) {
  const start = centre(motion.at(0));
  const end = centre(motion.at(motion.duration_s));
  const way = [end[0] - start[0], end[2] - start[2]];
  const size = Math.hypot(...way);
  if (size > 0.2 * length) return [way[0] / size, way[1] / size];
  const positions = motion.at(0);
  return width_along(positions, [1, 0]) >= width_along(positions, [0, 1]) ? [1, 0] : [0, 1];
}

/** The box that a motion fills in all its time. */
function box_of_motion(motion) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k <= 60; ++k) {
    const positions = motion.at((k / 60) * motion.duration_s);
    for (let i = 0; i < positions.length; ++i) {
      low[i % 3] = Math.min(low[i % 3], positions[i]);
      high[i % 3] = Math.max(high[i % 3], positions[i]);
    }
  }
  return { centre: low.map((least, d) => 0.5 * (least + high[d])), size: Math.hypot(...low.map((least, d) => high[d] - least)) };
}

/** A floor with lines every `step` metres and finer ones every tenth, drawn in its shader: lines of geometry would fight its depth. */
function grid_material(step, lines) {
  const material = new MeshLambertMaterial();
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { grid_step: { value: step }, grid_colour: { value: lines } });
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nvarying vec3 world_place;')
      .replace('#include <begin_vertex>', '#include <begin_vertex>\nworld_place = (modelMatrix * vec4(position, 1.0)).xyz;');
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>
        varying vec3 world_place;
        uniform float grid_step;
        uniform vec3 grid_colour;
        float line_share(float spacing, float pixels) {
          vec2 place = world_place.xz / spacing;
          vec2 width = fwidth(place);
          vec2 away = abs(fract(place - 0.5) - 0.5) / width;
          vec2 share = clamp(pixels - away, 0.0, 1.0) * clamp(1.0 - 2.5 * width, 0.0, 1.0);
          return max(share.x, share.y);
        }`)
      .replace('#include <color_fragment>', `#include <color_fragment>
        float share = max(0.55 * line_share(grid_step, 1.2), 0.25 * line_share(0.1 * grid_step, 1.0));
        diffuseColor.rgb = mix(diffuseColor.rgb, grid_colour, share);`);
  };
  return material;
}

/** The body that a motion moves, and what it wears. */
function performer_of(told) {
  const skin = { nodes: indices(told.skin.nodes), weights: floats(told.skin.weights) };
  const rest = floats(told.body.nodes);
  return {
    skin, rest, triangles: indices(told.skin.triangles), edges: indices(told.body.edges), looks: told.looks,
    morphs: told.morphs && new Morphs(told.morphs, skin, rest),
  };
}

export class Stage {
  constructor(canvas, page) {
    this.canvas = canvas;
    this.performers = [page, ...(page.others ?? [])].map(performer_of);
    this.length = page.report.body.length_m || 1;
    this.ground_normal = new Vector3(...page.ground_normal);
    this.ground_height = page.ground_height;
    this.is_scene = !!page.report.simulation;
    this.is_flat = page.report.simulation?.dimension === 2;
    const box = page.report.simulation ? box_of_motion(page.motions[0]) : null;
    // A scene that fits into the view is seen as a whole; otherwise the view goes with the body, as it does with a creature.
    this.whole = box && box.size < 10 * this.length ? box : null;
    if (this.whole) this.length = Math.max(this.length, 0.5 * box.size);
    this.view = 'overlay';
    this.follows = true;
    this.shows_mesh = false;

    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(35, 1, 0.05 * this.length, 60 * this.length);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.495 * Math.PI;
    this.controls.addEventListener('change', () => this.draw());

    this.add_lights();
    this.add_ground(page);
    this.obstacles = page.obstacles.map((obstacle) => this.add_obstacle(obstacle));
    this.bodies = page.motions.filter((motion) => kRoles[motion.role]).map((motion) => this.add_body(motion));
    this.leader = (this.bodies.find((body) => body.motion.role === 'replay') ?? this.bodies[0])?.motion;
    for (const body of this.bodies) if (body.motion.role === 'replay') this.add_control_mesh(body);
    if (this.leader) this.place_camera();
  }

  add_lights() {
    this.scene.add(new HemisphereLight(0xffffff, 0x8c8275, 1.4), new AmbientLight(0xffffff, 0.35));
    this.sun = new DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.radius = 3;
    const reach = 2.2 * this.length;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1, far: 12 * this.length });
    this.sun.shadow.normalBias = 0.004 * this.length;
    this.scene.add(this.sun, this.sun.target);
  }

  add_ground(page) {
    this.grid_step = 10 ** Math.round(Math.log10(this.length));
    this.line_colour = new Color();
    const extent = 120 * this.length;
    this.floor = new Mesh(new PlaneGeometry(extent, extent), grid_material(this.grid_step, this.line_colour));
    this.floor.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), this.ground_normal);
    this.floor.visible = page.has_ground;
    this.floor.receiveShadow = true;
    this.scene.add(this.floor);
  }

  add_body(motion) {
    const performer = this.performers[motion.performer ?? 0];
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array((performer.skin.nodes.length / 4) * 3), 3));
    geometry.setIndex(new BufferAttribute(performer.triangles, 1));
    const { colour, label } = mark_of(motion);
    const material = new MeshStandardMaterial({ color: colour, roughness: 0.75, side: DoubleSide, flatShading: this.is_scene });
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    this.scene.add(mesh);
    const is_replay = motion.role === 'replay';
    const body = { motion, performer, mesh, is_main: is_replay && !motion.performer, visible: is_replay || ['clip', 'target'].includes(motion.role) };
    if (motion.morphs) body.morphs = new Morphs(motion.morphs, performer.skin, performer.rest);
    if (is_replay && performer.looks) {
      body.looks = new Looks(performer.looks, colour, () => this.draw());
      mesh.add(...body.looks.meshes);
    }
    if (motion.name !== undefined) {
      body.label = this.canvas.parentElement.appendChild(document.createElement('div'));
      body.label.className = 'body_name legend_entry';
      body.label.style.setProperty('--mark', colour);
      body.label.textContent = label;
    }
    return body;
  }

  add_obstacle(told) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(floats(told.vertices), 3));
    geometry.setIndex(new BufferAttribute(indices(told.triangles), 1));
    const material = new MeshStandardMaterial({ color: 0x8d949c, roughness: 0.9, side: DoubleSide, flatShading: true });
    const mesh = new Mesh(geometry, material);
    // An endless plate is drawn as glass, or it would hide what it presses on.
    Object.assign(material, told.is_endless ? { transparent: true, opacity: 0.25, depthWrite: false } : {});
    mesh.castShadow = mesh.receiveShadow = !told.is_endless;
    this.scene.add(mesh);
    return { mesh, rate_hz: told.rate_hz, travel: floats(told.travel) };
  }

  move_obstacles(t) {
    for (const { mesh, rate_hz, travel } of this.obstacles) {
      const last = travel.length / 3 - 1;
      const place = Math.min(Math.max(0, t * rate_hz), last);
      const [from, to] = [Math.floor(place), Math.min(Math.floor(place) + 1, last)];
      const along = (d) => travel[3 * from + d] + (place - from) * (travel[3 * to + d] - travel[3 * from + d]);
      mesh.position.set(along(0), along(1), along(2));
    }
  }

  /** A replay's springs, coloured by their stretch. */
  add_control_mesh(body) {
    const count = body.performer.edges.length;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(count * 3), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(count * 3), 3));
    body.springs = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
    body.springs.frustumCulled = false;
    this.scene.add(body.springs);
  }

  place_camera() {
    const [hx, hz] = this.is_flat ? [1, 0] : heading_of(this.leader, this.length);
    this.aside = [-hz, hx];
    const positions = this.bodies.map((body) => body.motion).find((motion) => motion.of_skin)?.at(0) ?? this.leader.at(0);
    const widths = this.bodies.filter((body) => body.motion.performer).map((body) => width_along(body.motion.at(0), this.aside));
    this.spacing = Math.max(width_along(positions, this.aside), ...widths) + 0.35 * this.length;
    const start = centre(this.leader.at(0));
    this.focus = new Vector3(start[0], 0.5 * (start[1] + this.ground_height), start[2]);
    if (this.is_scene) this.focus.set(...(this.whole?.centre ?? start));
    this.ground_view = { focus: this.focus.y, centre: start[1] };
    this.controls.target.copy(this.focus);
    this.camera_way = new Vector3(0.45 * hx - hz, 0.42, 0.45 * hz + hx).normalize();
    if (this.is_flat) this.camera_way.set(...(this.performers.length > 1 ? [0.8, 0.7, 1] : [0.12, 0.16, 1])).normalize(); // side by side is one behind the other
    this.set_distance();
  }

  set_distance() {
    // A narrow view needs more distance to hold the body's length.
    const room = Math.max(1, 1.25 / this.camera.aspect);
    const distance = this.length * (this.view === 'side' ? 3.4 : 2.3) * room;
    this.camera.position.copy(this.controls.target).addScaledVector(this.camera_way, distance);
    this.controls.update();
  }

  set_view(view) {
    this.view = view;
    if (this.leader) this.set_distance();
  }

  set_theme(colours) {
    const background = new Color(colours.background);
    this.scene.background = background;
    this.scene.fog = new Fog(background, 6 * this.length, 22 * this.length);
    this.floor.material.color.set(colours.floor);
    this.line_colour.set(colours.grid);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  show(t) {
    const shown = this.bodies.filter((body) => body.visible);
    const side = this.view === 'side';
    for (const body of this.bodies) {
      body.mesh.visible = body.visible;
      if (body.springs) body.springs.visible = this.shows_mesh && body.visible;
      if (!body.visible) continue;
      const rank = side ? shown.indexOf(body) - (shown.length - 1) / 2 : 0;
      body.mesh.position.set(rank * this.spacing * this.aside[0], 0, rank * this.spacing * this.aside[1]);
      this.dress(body, side);
      this.move_skin(body, t);
      if (body.springs?.visible) this.move_springs(body, t);
    }
    this.move_obstacles(t);
    this.follow(t);
    this.draw();
  }

  /** The replay is solid; in the overlay what it is compared with is glass, and is seen where it stands out by some 0.5 % of L:
      surfaces nearer than that would blotch each other. Other replays wear their own look beside it, and their colour over it. */
  dress(body, side) {
    const is_solid = body.is_main || side;
    const opacity = body.springs?.visible ? 0.3 : is_solid ? 1 : 0.3;
    body.wears_looks = !!body.looks && is_solid;
    for (const part of body.looks?.meshes ?? []) part.visible = body.wears_looks;
    const material = body.mesh.material;
    material.visible = !body.wears_looks;
    material.transparent = opacity < 1;
    material.opacity = opacity;
    material.depthWrite = opacity === 1;
    Object.assign(material, { polygonOffset: !is_solid, polygonOffsetFactor: 1, polygonOffsetUnits: 500 });
    body.mesh.castShadow = is_solid && !body.wears_looks;
    body.mesh.renderOrder = opacity < 1 ? 1 : 0;
    body.looks?.dress(opacity);
  }

  move_skin(body, t) {
    const { skin, morphs } = body.performer;
    const attribute = body.mesh.geometry.getAttribute('position');
    const positions = body.motion.at(t);
    if (body.motion.of_skin) {
      attribute.array.set(positions);
    } else {
      embed(positions, skin, attribute.array);
      for (const worn of [morphs, body.morphs]) worn?.put_on(t, positions, (body.turns ??= new Map()), attribute.array);
    }
    if (body.wears_looks) return body.looks.move(attribute.array);
    attribute.needsUpdate = true;
    body.mesh.geometry.computeVertexNormals();
  }

  move_springs({ motion, performer: { edges, rest }, springs, mesh }, t) {
    const nodes = motion.at(t);
    const place = springs.geometry.getAttribute('position');
    const colour = springs.geometry.getAttribute('color');
    const distance = (positions, a, b) =>
      Math.hypot(positions[3 * a] - positions[3 * b], positions[3 * a + 1] - positions[3 * b + 1], positions[3 * a + 2] - positions[3 * b + 2]);
    const tint = new Color();
    for (let e = 0; e < edges.length; e += 2) {
      const [a, b] = [edges[e], edges[e + 1]];
      const strain = distance(nodes, a, b) / distance(rest, a, b) - 1;
      const strength = Math.min(1, Math.abs(strain) / 0.15);
      tint.setHSL(strain < 0 ? 0.6 : 0.02, strength, 0.5);
      [a, b].forEach((n, end) => {
        place.setXYZ(e + end, nodes[3 * n], nodes[3 * n + 1], nodes[3 * n + 2]);
        colour.setXYZ(e + end, tint.r, tint.g, tint.b);
      });
    }
    springs.position.copy(mesh.position);
    place.needsUpdate = true;
    colour.needsUpdate = true;
  }

  /** Camera, light and floor go with the replay; the floor's grid stays in the world. */
  follow(t) {
    if (!this.leader) return;
    const [x, y, z] = centre(this.leader.at(t));
    const leap = Math.max(0, y - this.ground_view.centre - kLowLeap * this.length); // what is no higher stays in view
    const climb = (this.is_scene ? y : this.ground_view.focus + leap) - this.focus.y;
    const move = this.whole ? new Vector3() : new Vector3(x - this.focus.x, climb, z - this.focus.z);
    this.focus.add(move);
    if (this.follows) {
      this.controls.target.add(move);
      this.camera.position.add(move);
      this.camera.lookAt(this.controls.target);
    }
    const seen = this.controls.target;
    this.floor.position.set(seen.x, this.floor_height(seen.x, seen.z), seen.z);
    this.sun.target.position.copy(seen);
    this.sun.position.copy(seen).add(new Vector3(1.2, 4, 1.6).multiplyScalar(this.length));
  }

  floor_height(x, z) {
    return this.ground_height - (this.ground_normal.x * x + this.ground_normal.z * z) / this.ground_normal.y;
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
    for (const body of this.bodies) if (body.label) this.place_label(body);
  }

  /** The name of a compared body, over it; in the overlay the switches below tell them apart. */
  place_label({ label, visible, motion, mesh }) {
    label.hidden = !visible || this.view !== 'side';
    if (label.hidden) return;
    const [x, , z] = centre(motion.positions);
    let top = -Infinity;
    for (let i = 1; i < motion.positions.length; i += 3) top = Math.max(top, motion.positions[i]);
    const place = new Vector3(x, top, z).add(mesh.position).project(this.camera);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    label.style.transform = `translate(-50%, -130%) translate(${(0.5 + 0.5 * place.x) * width}px, ${(0.5 - 0.5 * place.y) * height}px)`;
  }
}
