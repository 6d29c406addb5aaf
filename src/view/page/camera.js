/* SPDX-License-Identifier: Apache-2.0 */
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

export class Camera {
    constructor() {
        this.eye = [0, 0, -1];
        this.forward = [0, 0, 1];
        this.up = [0, -1, 0];
        this.pivot = [0, 0, 0];      // orbits go around it
        this.level = [0, -1, 0];     // up of the whole scene: orbits turn about it
        this.model = "pinhole";
        this.fov = 60;               // degrees from the left edge of the frame to the right: what every picture shows, and more beside it
        this.aspect = 4 / 3;         // of the frame, width by height
        this.view = -1;              // >= 0: exactly the camera of this photo
    }

    right() { return unit(cross(this.forward, this.up)); }
    distance() { return length(sub(this.eye, this.pivot)) || 1; }

    // The pose of a camera file, and a pivot on its axis beside the middle of the scene.
    place(pose, middle) {
        this.eye = pose.origin.slice();
        this.forward = unit(sub(pose.target, pose.origin));
        this.up = unit(pose.up);
        const far = length(sub(middle, this.eye)), along = dot(sub(middle, this.eye), this.forward);
        this.pivot = add(this.eye, mul(this.forward, Math.max(along, 0.2 * far) || 1));
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

    // The picture's width when it is as high as the frame, or as wide, so that the whole frame is in it.
    wider(width, height) { return Math.max(1, width / height / this.aspect); }

    fovOf(width, height) {
        const wider = this.wider(width, height);
        return this.model === "fisheye" ? Math.min(360, wider * this.fov) : 360 / Math.PI * Math.atan(wider * Math.tan(this.fov * Math.PI / 360));
    }

    // What a pinhole sees from left to right at the pivot: so much an orthographic picture spans.
    viewWidth(width, height) { return this.wider(width, height) * 2 * this.distance() * Math.tan(Math.min(this.fov, 170) * Math.PI / 360); }

    // From where it looks, but so that `radius` around the middle fills the frame.
    fit({ middle, radius }) {
        const spread = Math.tan(Math.min(this.fov, 120) * Math.PI / 360) * Math.min(1, 1 / this.aspect);
        this.pivot = middle.slice();
        this.eye = sub(middle, mul(this.forward, radius / spread));
    }

    file(width, height) {
        const file = { origin: this.eye, target: add(this.eye, mul(this.forward, this.distance())), up: this.up, width, height, model: this.model };
        if (this.model === "orthographic")
            file.view_width = this.viewWidth(width, height);
        else if (this.model !== "equirectangular")
            file.fov_x_deg = this.fovOf(width, height);
        return file;
    }
}
