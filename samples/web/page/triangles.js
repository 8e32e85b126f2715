// Rays answered by the triangles of a .glb, with three-mesh-bvh.
import { BufferAttribute, BufferGeometry, DoubleSide, LoadingManager, MeshBasicMaterial, Ray, Vector3 } from './three/three.core.js';
import { GLTFLoader } from './three/loaders/GLTFLoader.js';
import { MeshBVH } from './three/three-mesh-bvh.js';

/** Rays need no materials, so pictures are dropped. */
const withoutMaterials = () => ({ name: 'none', loadMaterial: () => Promise.resolve(new MeshBasicMaterial()) });

async function meshesOf(bytes, name) {
  const manager = new LoadingManager();
  manager.setURLModifier((url) => {
    if (/^(blob|data):/.test(url)) return url;
    throw new Error('it refers to other files; a .glb with everything in it is needed');
  });
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== 'glTF') throw new Error(`${name} is not a .glb: it does not begin like one`);
  let gltf;
  try {
    gltf = await new GLTFLoader(manager).register(withoutMaterials).parseAsync(bytes.buffer, '');
  } catch (error) {
    throw new Error(`${name} cannot be read: ${error?.message ?? error}`);
  }
  const meshes = [];
  gltf.scene.updateMatrixWorld(true);
  gltf.scene.traverse((node) => node.isMesh && meshes.push(node));
  return meshes;
}

/** All triangles of the meshes as one geometry, in world space. */
function merged(meshes, name) {
  let vertices = 0, corners = 0;
  for (const { geometry } of meshes) {
    const count = geometry.getAttribute('position')?.count ?? 0;
    vertices += count;
    corners += geometry.index?.count ?? count;
  }
  if (corners < 3) throw new Error(`${name} has no triangles`);
  const positions = new Float32Array(3 * vertices), index = new Uint32Array(corners - (corners % 3));
  const point = new Vector3();
  let vertex = 0, corner = 0;
  for (const { geometry, matrixWorld } of meshes) {
    const position = geometry.getAttribute('position');
    if (!position) continue;
    for (let i = 0; i < position.count; ++i) point.fromBufferAttribute(position, i).applyMatrix4(matrixWorld).toArray(positions, 3 * (vertex + i));
    const count = geometry.index?.count ?? position.count;
    for (let i = 0; i + 2 < count || i % 3 !== 0; ++i) {
      const at = geometry.index?.getX(i) ?? i;
      if (!(at < position.count)) throw new Error(`${name} has a triangle with a corner ${at}, of ${position.count}`);
      index[corner++] = vertex + at;
    }
    vertex += position.count;
  }
  if (!positions.every(Number.isFinite)) throw new Error(`${name} has corners that are not numbers`);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute(index.subarray(0, corner), 1));
  return geometry;
}

export async function open(bytes, name) {
  const geometry = merged(await meshesOf(bytes, name), name);
  const bvh = new MeshBVH(geometry);
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  const nodes = MeshBVH.serialize(bvh, { cloneBuffers: false }).roots.reduce((sum, root) => sum + root.byteLength, 0);
  const off = Math.max(max.x - min.x, max.y - min.y, max.z - min.z) / 1000;
  const ray = new Ray();
  const first = (rays, i) => {
    ray.origin.fromArray(rays, 8 * i);
    ray.direction.fromArray(rays, 8 * i + 4);
    return bvh.raycastFirst(ray, DoubleSide, rays[8 * i + 3], rays[8 * i + 7]);
  };
  return {
    bounds: [min.toArray(), max.toArray()],
    memoryBytes: nodes + geometry.attributes.position.array.byteLength + geometry.index.array.byteLength,
    note: '',
    /** Like that of asset.js. */
    intersect(rays, count, { t, normal, bias }) {
      for (let i = 0; i < count; ++i) {
        const hit = first(rays, i);
        t[i] = hit ? hit.distance : Infinity;
        if (!hit) continue;
        bias[i] = off;
        const { x, y, z } = hit.face.normal;
        const side = x * rays[8 * i + 4] + y * rays[8 * i + 5] + z * rays[8 * i + 6] > 0 ? -1 : 1;
        normal[3 * i] = side * x;
        normal[3 * i + 1] = side * y;
        normal[3 * i + 2] = side * z;
      }
    },
    /** Like that of asset.js. There is no any-hit call, and a shapecast that stops at the first triangle is slower than this. */
    visible(rays, count, visible) {
      for (let i = 0; i < count; ++i) visible[i] = first(rays, i) ? 0 : 1;
    },
  };
}
