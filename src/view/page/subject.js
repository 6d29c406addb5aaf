/* SPDX-License-Identifier: Apache-2.0 */
// subject.js -- what the photos look at, and how large it is: where orbits turn, how fast flights are, what F shows.
import { cross, dot, length, sub, unit } from "./camera.js";

// The point nearest to all lines eye + t forward: the sum of (1 - f f^T) (x - eye) is 0.
function meetingPoint(poses, fallback) {
    const m = [0, 0, 0, 0, 0, 0, 0, 0, 0], b = [0, 0, 0];
    for (const { eye, forward } of poses)
        for (let i = 0; i < 3; i++)
            for (let j = 0; j < 3; j++) {
                const p = (i === j ? 1 : 0) - forward[i] * forward[j];
                m[3 * i + j] += p;
                b[i] += p * eye[j];
            }
    const rows = [m.slice(0, 3), m.slice(3, 6), m.slice(6, 9)];
    const det = dot(rows[0], cross(rows[1], rows[2]));
    if (!(Math.abs(det) > 1e-6 * poses.length ** 3))
        return fallback; // they are parallel, or there is none
    const columns = [0, 1, 2].map(k => rows.map(r => r[k]));
    return [0, 1, 2].map(k => {
        const c = columns.slice();
        c[k] = b;
        return dot(c[0], cross(c[1], c[2])) / det;
    });
}

// { middle, radius }: a photo shows `radius` around the middle, typically. Where they do not look at one thing, or there are none: as far as
// the middle half of the scene is wide.
export function findSubject(scene) {
    const poses = scene.views.map(v => ({
        eye: v.camera.origin, forward: unit(sub(v.camera.target, v.camera.origin)),
        spread: Math.tan(v.fov_x_deg * Math.PI / 360) * Math.min(1, v.height / v.width),
    }));
    const middle = meetingPoint(poses, scene.center), depth = p => dot(sub(middle, p.eye), p.forward);
    const seen = poses.filter(p => depth(p) > 0).map(p => depth(p) * p.spread).sort((a, b) => a - b);
    const radius = seen[seen.length >> 1];
    // Cameras that turned on the spot "meet" where they stand.
    if (2 * seen.length > poses.length && length(sub(middle, scene.center)) < 2 * scene.size && radius > 0.02 * scene.size)
        return { middle, radius };
    return { middle: scene.center, radius: scene.size || 1 };
}
