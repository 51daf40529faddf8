/** What the camera looks at, from above: the corners of its field of view on the ground. */
import { unproject, type Camera } from "../../geometry/camera";
import type { Vec3 } from "../../geometry/vectors";

const EDGES = 9;

/**
 * The camera's place and the points at `reachM` along its view from the left to the right edge of
 * the image, in the world; empty when it looks straight up or down.
 */
export function viewCone(camera: Camera, reachM: number): readonly Vec3[] {
  const { widthPx, heightPx } = camera.intrinsics;
  const arc: Vec3[] = [];
  for (let index = 0; index < EDGES; index += 1) {
    const u = -0.5 + (widthPx * index) / (EDGES - 1);
    const ray = unproject(camera, [u, (heightPx - 1) / 2]);
    const flat = ray === null ? 0 : Math.hypot(ray[0], ray[1]);
    if (ray !== null && flat > 0.05) {
      const [x, y, z] = camera.center;
      arc.push([x + (ray[0] / flat) * reachM, y + (ray[1] / flat) * reachM, z]);
    }
  }
  return arc.length < 2 ? [] : [camera.center, ...arc];
}
