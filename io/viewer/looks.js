// What the replay wears: the parts of its skin with the materials, images and normals of the clip file.
import {
  BufferAttribute, BufferGeometry, ClampToEdgeWrapping, Color, DoubleSide, FrontSide, LinearFilter, LinearMipmapLinearFilter,
  LinearMipmapNearestFilter, Mesh, MeshBasicMaterial, MeshStandardMaterial, MirroredRepeatWrapping, NearestFilter,
  NearestMipmapLinearFilter, NearestMipmapNearestFilter, RepeatWrapping, SRGBColorSpace, TextureLoader,
} from 'three';

import { floats, indices } from './data.js';

const kWraps = { 33071: ClampToEdgeWrapping, 33648: MirroredRepeatWrapping, 10497: RepeatWrapping };
const kFilters = {
  9728: NearestFilter, 9729: LinearFilter, 9984: NearestMipmapNearestFilter, 9985: LinearMipmapNearestFilter,
  9986: NearestMipmapLinearFilter, 9987: LinearMipmapLinearFilter,
};
const [kMask, kBlend] = [1, 2];

export class Looks {
  /** `redraw` is called as images become ready. */
  constructor(told, plain_colour, redraw) {
    this.told = told;
    this.redraw = redraw;
    this.textures = new Map();
    const materials = told.materials.map((material) => ({ material, parameters: this.parameters(material) }));
    this.parts = told.parts.map((part) => this.add_part(part, materials[part.material], plain_colour));
    this.meshes = this.parts.map((part) => part.mesh);
    this.number_normals();
  }

  texture(map, is_colour) {
    const address = this.told.images[map.image];
    if (!address) return null;
    const key = JSON.stringify([map, is_colour]);
    if (!this.textures.has(key)) {
      const texture = new TextureLoader().load(address, this.redraw);
      texture.flipY = false;
      if (is_colour) texture.colorSpace = SRGBColorSpace;
      [texture.wrapS, texture.wrapT] = map.wrap.map((wrap) => kWraps[wrap]);
      texture.magFilter = kFilters[map.filters[0]] ?? LinearFilter;
      texture.minFilter = kFilters[map.filters[1]] ?? LinearMipmapLinearFilter;
      texture.channel = map.uv_set;
      texture.offset.set(...map.offset);
      texture.repeat.set(...map.scale);
      texture.rotation = map.turn;
      this.textures.set(key, texture);
    }
    return this.textures.get(key);
  }

  /** Metal would show what is around it, of which the page has nothing: all is drawn as if it were none. */
  parameters(told) {
    const [r, g, b, alpha] = told.base_colour;
    const parameters = {
      color: new Color().setRGB(r, g, b), map: this.texture(told.base_colour_map, true), side: told.double_sided ? DoubleSide : FrontSide,
      opacity: told.alpha_mode === kBlend ? alpha : 1, alphaTest: told.alpha_mode === kMask ? told.alpha_cutoff : 0,
    };
    if (told.unlit) return parameters;
    const normalMap = this.texture(told.normal_map, false);
    Object.assign(parameters, {
      roughness: Math.max(0.35, told.roughness), metalness: 0, emissive: new Color().setRGB(...told.emissive),
      emissiveMap: this.texture(told.emissive_map, true), normalMap,
    });
    return parameters;
  }

  add_part(told, dressed, plain_colour) {
    const vertices = indices(told.vertices);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(3 * vertices.length), 3));
    geometry.setIndex(new BufferAttribute(indices(told.triangles), 1));
    told.uvs.forEach((uvs, set) => geometry.setAttribute(set ? `uv${set}` : 'uv', new BufferAttribute(floats(uvs), 2)));
    const colours = floats(told.colours);
    if (colours.length) geometry.setAttribute('color', new BufferAttribute(colours, 4));
    const bind_normals = floats(told.normals);
    const is_flat = bind_normals.length === 0;
    if (!is_flat) geometry.setAttribute('normal', new BufferAttribute(new Float32Array(3 * vertices.length), 3));
    const Kind = dressed?.material.unlit ? MeshBasicMaterial : MeshStandardMaterial;
    const plain = { color: colours.length ? 0xffffff : plain_colour, roughness: 0.75, side: DoubleSide };
    const material = new Kind({ ...(dressed?.parameters ?? plain), vertexColors: colours.length > 0 });
    if (!dressed?.material.unlit) material.flatShading = is_flat;
    // Without tangents three.js takes v to run upward.
    if (material.normalMap) material.normalScale.set(dressed.material.normal_map.strength, -dressed.material.normal_map.strength);
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    mesh.castShadow = true;
    return { mesh, vertices, bind_normals, is_flat, opacity: material.opacity, is_glass: dressed?.material.alpha_mode === kBlend };
  }

  /** Where the clip file has one normal for several drawn vertices of one place, they keep one: its edges stay as they are. */
  number_normals() {
    const numbers = new Map();
    for (const part of this.parts.filter((other) => !other.is_flat)) {
      part.normals = new Uint32Array(part.vertices.length);
      part.vertices.forEach((vertex, d) => {
        const key = `${vertex} ${[0, 1, 2].map((k) => Math.round(1000 * part.bind_normals[3 * d + k]))}`;
        if (!numbers.has(key)) numbers.set(key, numbers.size);
        part.normals[d] = numbers.get(key);
      });
    }
    this.normals = new Float32Array(3 * numbers.size);
  }

  dress(opacity) {
    for (const { mesh, opacity: own, is_glass } of this.parts) {
      const { material } = mesh;
      material.transparent = is_glass || opacity < 1;
      material.opacity = own * opacity;
      material.depthWrite = opacity === 1 && !is_glass;
      mesh.renderOrder = material.transparent ? 1 : 0;
    }
  }

  /** `skin`: positions of the skin's vertices, x y z by vertex. */
  move(skin) {
    for (const { mesh, vertices } of this.parts) {
      const attribute = mesh.geometry.getAttribute('position');
      for (let d = 0; d < vertices.length; ++d) {
        for (let k = 0; k < 3; ++k) attribute.array[3 * d + k] = skin[3 * vertices[d] + k];
      }
      attribute.needsUpdate = true;
    }
    this.turn_normals();
  }

  /** The mean of the triangles around, weighted by area. */
  turn_normals() {
    this.normals.fill(0);
    const smooth = this.parts.filter((part) => !part.is_flat);
    for (const { mesh, normals } of smooth) {
      const { array: at } = mesh.geometry.getAttribute('position');
      const { array: corners } = mesh.geometry.index;
      for (let i = 0; i < corners.length; i += 3) {
        const [a, b, c] = [3 * corners[i], 3 * corners[i + 1], 3 * corners[i + 2]];
        const [px, py, pz] = [at[b] - at[a], at[b + 1] - at[a + 1], at[b + 2] - at[a + 2]];
        const [qx, qy, qz] = [at[c] - at[a], at[c + 1] - at[a + 1], at[c + 2] - at[a + 2]];
        for (let k = i; k < i + 3; ++k) {
          const n = 3 * normals[corners[k]];
          this.normals[n] += py * qz - pz * qy;
          this.normals[n + 1] += pz * qx - px * qz;
          this.normals[n + 2] += px * qy - py * qx;
        }
      }
    }
    for (const { mesh, normals } of smooth) {
      const attribute = mesh.geometry.getAttribute('normal');
      for (let d = 0; d < normals.length; ++d) {
        const [x, y, z] = this.normals.subarray(3 * normals[d], 3 * normals[d] + 3);
        const size = Math.hypot(x, y, z) || 1;
        attribute.setXYZ(d, x / size, y / size, z / size);
      }
      attribute.needsUpdate = true;
    }
  }
}
