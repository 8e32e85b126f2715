// The same rays answered by the triangles that are drawn, to compare: three-mesh-bvh builds their tree in the page, and generates
// the WGSL that walks it.
import {
  BVHComputeData, bvhNodeBoundsStruct, bvhNodeStruct, intersectRayTriangle, rayIntersectionResultStruct, rayStruct, wgslTagFn,
} from './three-mesh-bvh/webgpu/index.js';
import { MeshBVH } from './three-mesh-bvh/core/MeshBVH.js';
import { SAH } from './three-mesh-bvh/core/Constants.js';

/**
 * { code, bytes, milliseconds }: code for makeNodes (nodes.js), the bytes of its buffers, and how long building took. A walk ends
 * at any triangle: three-mesh-bvh's own raycastFirstHit looks for the nearest, which is more work.
 */
export function triangleAnswers(geometry, { maxStorageBufferBindingSize: most }) {
  const start = performance.now();
  geometry.boundsTree = new MeshBVH(geometry, { strategy: SAH }); // its fastest tree; by default it would be another
  const data = new BVHComputeData(geometry);
  data.update();
  const { index, attributes, nodes, transforms } = data.storage;
  const sizes = [index, attributes, nodes, transforms].map((buffer) => buffer.value.array.byteLength), needed = Math.max(...sizes);
  if (needed > most) throw new Error(`The device allows ${most} bytes in a storage buffer, and the triangles need ${needed}`);
  const Ray = rayStruct, Hit = rayIntersectionResultStruct;
  const walk = data.getShapecastFn({
    name: 'trianglesHit',
    shapeStruct: Ray,
    resultStruct: Hit,
    boundsOrderFn: wgslTagFn`
      fn trianglesOrder(ray : ${Ray}, axis : u32, node : ${bvhNodeStruct}) -> bool {
        return ray.direction[axis] >= 0.0;
      }
    `,
    intersectsBoundsFn: wgslTagFn`
      fn trianglesMeetBox(ray : ${Ray}, bounds : ${bvhNodeBoundsStruct}, result : ptr<function, ${Hit}>) -> u32 {
        if (result.didHit) {
          return 0u;
        }
        let inverse = 1.0 / ray.direction;
        let a = (vec3f(bounds.min[0], bounds.min[1], bounds.min[2]) - ray.origin) * inverse;
        let b = (vec3f(bounds.max[0], bounds.max[1], bounds.max[2]) - ray.origin) * inverse;
        let near = min(a, b);
        let far = max(a, b);
        return select(0u, 1u, max(max(near.x, near.y), max(near.z, 0.0)) <= min(min(far.x, far.y), far.z));
      }
    `,
    intersectRangeFn: wgslTagFn`
      fn trianglesMeetLeaf(ray : ${Ray}, offset : u32, count : u32, result : ptr<function, ${Hit}>) -> bool {
        for (var i = offset; i < offset + count && !result.didHit; i++) {
          let a = ${attributes}[${index}[3u * i]].position.xyz;
          let b = ${attributes}[${index}[3u * i + 1u]].position.xyz;
          let c = ${attributes}[${index}[3u * i + 2u]].position.xyz;
          let found = ${intersectRayTriangle}(ray, a, b, c, 0.0);
          result.didHit = found.didHit;
        }
        return result.didHit;
      }
    `,
  });
  const visible = wgslTagFn`
    fn nifVisible(origin : vec3f, direction : vec3f) -> bool {
      var ray : ${Ray};
      ray.origin = origin;
      ray.direction = direction;
      var result : ${Hit};
      return !${walk}(ray, &result);
    }
  `;
  return { code: [visible], bytes: sizes.reduce((sum, size) => sum + size, 0), milliseconds: performance.now() - start };
}
