// camera.js -- where the camera is and how it moves. Axes and units are the data set's; a camera is what a camera file says (docs/cameras.md).

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const mul = (a, s) => a.map(x => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = a => Math.sqrt(dot(a, a));
export const unit = a => mul(a, 1 / (length(a) || 1));

// Rodrigues: v turned about a unit axis.
function turned(v, axis, angle) {
    const c = Math.cos(angle), s = Math.sin(angle);
    return add(add(mul(v, c), mul(cross(axis, v), s)), mul(axis, dot(axis, v) * (1 - c)));
}

// The point nearest to all lines eye + t forward: the sum of (1 - f f^T) (x - eye) is 0.
export function meetingPoint(poses, fallback) {
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

export class Camera {
    constructor() {
        this.eye = [0, 0, -1];
        this.forward = [0, 0, 1];
        this.up = [0, -1, 0];
        this.pivot = [0, 0, 0];      // orbits go around it
        this.level = [0, -1, 0];     // up of the whole scene: orbits turn about it
        this.model = "pinhole";
        this.fov = 60;               // degrees from the left edge to the right
        this.view = -1;              // >= 0: exactly the camera of this photo
    }

    right() { return unit(cross(this.forward, this.up)); }
    distance() { return Math.max(length(sub(this.eye, this.pivot)), 1e-6); }

    // The pose of a camera file, and a pivot on its axis beside the middle of the scene.
    place(pose, middle) {
        this.eye = pose.origin.slice();
        this.forward = unit(sub(pose.target, pose.origin));
        this.up = unit(pose.up);
        const far = length(sub(middle, this.eye)), along = dot(sub(middle, this.eye), this.forward);
        this.pivot = add(this.eye, mul(this.forward, Math.max(along, 0.2 * far, 1e-3)));
    }

    // Turn eye and view as one body about a point.
    turn(about, axis, angle) {
        this.eye = add(about, turned(sub(this.eye, about), axis, angle));
        this.forward = unit(turned(this.forward, axis, angle));
        this.up = unit(turned(this.up, axis, angle));
    }

    // Angles in radians; about the pivot, or about the eye to look around. Not over the poles, where left and right would change places.
    orbit(yaw, pitch, about) {
        const height = Math.asin(Math.min(1, Math.max(-1, dot(this.forward, this.level))));
        const most = 88 * Math.PI / 180, next = Math.min(Math.max(height + pitch, Math.min(height, -most)), Math.max(height, most));
        this.turn(about, this.right(), next - height);
        this.turn(about, this.level, yaw);
    }

    move(right, up, forward) {
        const way = add(add(mul(this.right(), right), mul(this.up, up)), mul(this.forward, forward));
        this.eye = add(this.eye, way);
        this.pivot = add(this.pivot, way);
    }

    zoom(factor) { this.eye = add(this.pivot, mul(sub(this.eye, this.pivot), factor)); }

    // What an orthographic picture spans: what a pinhole would see at the pivot.
    viewWidth() { return 2 * this.distance() * Math.tan(Math.min(this.fov, 170) * Math.PI / 360); }

    file(width, height) {
        const file = { origin: this.eye, target: add(this.eye, mul(this.forward, this.distance())), up: this.up, width, height, model: this.model };
        if (this.model === "orthographic")
            file.view_width = this.viewWidth();
        else if (this.model !== "equirectangular")
            file.fov_x_deg = this.fov;
        return file;
    }
}
